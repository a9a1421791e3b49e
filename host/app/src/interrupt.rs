//! Ctrl-C as a question a loop can ask between frames. Does not know what is being done.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::error::AppError;

/// Whether the user asked to stop.
#[derive(Clone, Debug, Default)]
pub struct Interrupt(Arc<AtomicBool>);

impl Interrupt {
    /// Listens for Ctrl-C from now on. The first asks the run to stop, at the latest
    /// after its frame; the second stops the program. A request to terminate counts as one.
    ///
    /// # Errors
    /// The system's refusal.
    pub fn listen() -> Result<Self, AppError> {
        let asked = Arc::new(AtomicBool::new(false));
        let heard = Arc::clone(&asked);
        let handler = move || {
            if heard.swap(true, Ordering::Relaxed) {
                std::process::exit(130);
            }
        };
        ctrlc::set_handler(handler).map_err(|e| AppError::Internal(format!("cannot listen for Ctrl-C: {e}")))?;
        Ok(Self(asked))
    }

    /// What is true then, for loops inside a frame.
    pub fn flag(&self) -> Arc<AtomicBool> {
        Arc::clone(&self.0)
    }

    /// True once Ctrl-C was pressed.
    pub fn asked(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}
