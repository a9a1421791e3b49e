//! `schema`: the JSON Schema of scene files.

use super::print;
use crate::error::AppError;

pub(super) fn schema() -> Result<(), AppError> {
    let text = serde_json::to_string_pretty(&physvideo::scene::schema());
    print(&text.map_err(|e| AppError::Internal(format!("the schema cannot be written as JSON: {e}")))?);
    Ok(())
}
