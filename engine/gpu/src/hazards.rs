//! Barriers, derived: a command waits for the ones before it exactly when their reads and writes overlap.

use std::collections::{HashMap, HashSet};

use crate::recording::Command;

/// A step of a schedule: a barrier over everything before it, or the command of this index.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Step {
    /// All earlier commands finish, and what they wrote is seen by all later ones.
    Barrier,
    /// Run command `i`.
    Run(usize),
}

/// Puts a barrier before each command that reads or writes a buffer written since the last barrier, or writes one
/// read since then. Read after read needs none.
pub fn schedule(commands: &[Command]) -> Vec<Step> {
    let mut steps = Vec::with_capacity(commands.len() * 2);
    let mut read: HashSet<u32> = HashSet::new();
    let mut written: HashSet<u32> = HashSet::new();
    for (i, command) in commands.iter().enumerate() {
        // One buffer may be bound twice in a call; its accesses count together.
        let mut access: HashMap<u32, (bool, bool)> = HashMap::new();
        for (id, r, w) in command.access() {
            let entry = access.entry(id).or_default();
            *entry = (entry.0 | r, entry.1 | w);
        }
        let clash = access.iter().any(|(id, (_, w))| written.contains(id) || (*w && read.contains(id)));
        if clash {
            steps.push(Step::Barrier);
            read.clear();
            written.clear();
        }
        for (id, (r, w)) in access {
            if r {
                read.insert(id);
            }
            if w {
                written.insert(id);
            }
        }
        steps.push(Step::Run(i));
    }
    steps
}
