//! `devices`: what `--device` can name.

use super::print;
use crate::device::DeviceEntry;
use crate::error::AppError;

pub(super) fn devices(json: bool) -> Result<(), AppError> {
    let entries: Vec<DeviceEntry> = physvideo_gpu::list_devices()?.iter().map(DeviceEntry::from).collect();
    if json {
        let text = serde_json::to_string_pretty(&entries);
        print(&text.map_err(|e| AppError::Internal(format!("devices cannot be written as JSON: {e}")))?);
        return Ok(());
    }
    for d in entries {
        print(&format!("{}  {} ({}, {})  {} MiB", d.index, d.name, d.kind, d.driver, d.memory >> 20));
    }
    Ok(())
}
