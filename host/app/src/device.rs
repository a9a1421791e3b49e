//! What the program says of devices, and how much memory a run may take on one. Opens none.

use physvideo_gpu::{DeviceInfo, DeviceKind};
use serde::Serialize;

/// A device in reports and lists.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct DeviceEntry {
    /// What `--device` takes.
    pub index: usize,
    /// Name.
    pub name: String,
    /// Driver and its version.
    pub driver: String,
    /// `discrete`, `integrated`, `cpu` or `other`.
    #[serde(rename = "type")]
    pub kind: &'static str,
    /// Size of its largest heap [bytes].
    pub memory: u64,
    /// Optional features it offers.
    pub features: Vec<String>,
}

impl From<&DeviceInfo> for DeviceEntry {
    fn from(info: &DeviceInfo) -> Self {
        let kind = match info.kind {
            DeviceKind::Discrete => "discrete",
            DeviceKind::Integrated => "integrated",
            DeviceKind::Cpu => "cpu",
            DeviceKind::Other => "other",
        };
        Self {
            index: info.index,
            name: info.name.clone(),
            driver: info.driver.clone(),
            kind,
            memory: info.memory,
            features: info.features.iter().map(|f| format!("{f:?}")).collect(),
        }
    }
}

/// Bytes a run may take on a device. One that shares the host's memory has no more than what is free of it.
pub fn available(info: &DeviceInfo) -> u64 {
    let shared = info.kind != DeviceKind::Discrete;
    host_memory().filter(|_| shared).map_or(info.memory, |host| host.min(info.memory))
}

/// Free memory of the host [bytes], where the system tells.
pub fn host_memory() -> Option<u64> {
    let text = std::fs::read_to_string("/proc/meminfo").ok()?;
    let line = text.lines().find_map(|l| l.strip_prefix("MemAvailable:"))?;
    let kib: u64 = line.trim().trim_end_matches("kB").trim().parse().ok()?;
    kib.checked_mul(1024)
}
