//! Ctrl-C as a question a loop can ask between frames. Does not know what is being done.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use crate::error::AppError;

/// Two signals closer than this are one request.
const TWICE: Duration = Duration::from_millis(500);

/// Whether the user asked to stop.
#[derive(Clone, Debug, Default)]
pub struct Interrupt(Arc<AtomicBool>);

impl Interrupt {
    /// Listens for Ctrl-C from now on. The first asks the run to stop, at the latest after its frame; one that comes
    /// half a second later or more stops the program. A request to terminate counts as one, and some programs
    /// (`timeout`) send it twice at once.
    ///
    /// # Errors
    /// The system's refusal.
    pub fn listen() -> Result<Self, AppError> {
        let asked = Arc::new(AtomicBool::new(false));
        let heard = Arc::clone(&asked);
        let mut first: Option<Instant> = None;
        let handler = move || {
            heard.store(true, Ordering::Relaxed);
            if first.get_or_insert_with(Instant::now).elapsed() >= TWICE {
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
