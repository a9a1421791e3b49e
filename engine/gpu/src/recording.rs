//! What the device is asked to do, as plain data in order. Nobody writes a barrier here: see `hazards`.

use bytemuck::Pod;
use physvideo_kernels::{AnyBuf, Buf, Kernel, KernelInfo};

use crate::pipeline::Constants;

/// How many workgroups a call has.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Groups {
    /// Known now.
    Direct([u32; 3]),
    /// Read by the device from three u32 at this byte offset.
    Indirect(AnyBuf, u64),
}

/// One entry of a recording.
#[derive(Clone, Debug)]
pub enum Command {
    /// Run a kernel.
    Call {
        /// Which.
        kernel: &'static KernelInfo,
        /// Values of its overrides.
        constants: Constants,
        /// Its buffers by binding number.
        bufs: Vec<AnyBuf>,
        /// Its immediates.
        immediates: Vec<u8>,
        /// How many workgroups.
        groups: Groups,
    },
    /// Set every 32-bit word of a buffer.
    Fill(AnyBuf, u32),
    /// Copy the beginning of one buffer to another [bytes].
    Copy(AnyBuf, AnyBuf, u64),
    /// Begin a timed, labelled section; it ends where the next begins.
    Section(String),
}

impl Command {
    /// Buffers it reads and writes.
    pub fn access(&self) -> Vec<(u32, bool, bool)> {
        match self {
            Command::Call { kernel, bufs, groups, .. } => {
                let bound = bufs.iter().zip(kernel.bindings).map(|(b, info)| (b.id, info.reads, info.writes));
                let sizes = match groups {
                    Groups::Indirect(buf, _) => Some((buf.id, true, false)),
                    Groups::Direct(_) => None,
                };
                bound.chain(sizes).collect()
            }
            Command::Fill(buf, _) => vec![(buf.id, false, true)],
            Command::Copy(from, to, _) => vec![(from.id, true, false), (to.id, false, true)],
            Command::Section(_) => vec![],
        }
    }
}

/// A list of commands.
#[derive(Clone, Debug)]
pub struct Recording {
    /// Name for labels and errors.
    pub name: String,
    /// What to do, in order.
    pub commands: Vec<Command>,
}

impl Recording {
    /// An empty recording.
    pub fn new(name: &str) -> Self {
        Self { name: name.into(), commands: Vec::new() }
    }

    /// Calls a kernel with `groups` workgroups.
    pub fn call<K: Kernel>(&mut self, call: &K, constants: &Constants, groups: Groups) {
        self.commands.push(Command::Call {
            kernel: K::INFO,
            constants: constants.clone(),
            bufs: call.bufs(),
            immediates: call.immediates().to_vec(),
            groups,
        });
    }

    /// Calls a kernel so that there is an invocation for each of `items` along x. No items, no call.
    pub fn each<K: Kernel>(&mut self, call: &K, constants: &Constants, items: u64) {
        let groups = items.div_ceil(u64::from(K::INFO.workgroup[0]));
        if let Some(groups) = u32::try_from(groups).ok().filter(|g| *g > 0) {
            // More than 65,535 workgroups along x are folded into rows; kernels take their index from both.
            let rows = groups.div_ceil(65_535);
            self.call(call, constants, Groups::Direct([groups.div_ceil(rows), rows, 1]));
        }
    }

    /// Sets every 32-bit word of a buffer.
    pub fn fill<T: Pod>(&mut self, buf: Buf<T>, word: u32) {
        self.commands.push(Command::Fill(buf.erase(), word));
    }

    /// Copies all of `from` to the beginning of `to`.
    pub fn copy<T: Pod>(&mut self, from: Buf<T>, to: Buf<T>) {
        let bytes = from.erase().bytes.min(to.erase().bytes);
        self.commands.push(Command::Copy(from.erase(), to.erase(), bytes));
    }

    /// Begins a timed, labelled section.
    pub fn section(&mut self, name: &str) {
        self.commands.push(Command::Section(name.into()));
    }

    /// Appends another recording's commands.
    pub fn extend(&mut self, other: &Recording) {
        self.commands.extend(other.commands.iter().cloned());
    }
}
