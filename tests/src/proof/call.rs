//! Inputs and outputs of one kernel call as plain bytes by the name of the binding. Knows no device.

use bytemuck::Pod;
use physvideo_gpu::{Constants, Groups};

/// The contents of buffers, by name.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Buffers(Vec<(&'static str, Vec<u8>)>);

impl Buffers {
    /// Adds or replaces one.
    pub fn set<T: Pod>(&mut self, name: &'static str, data: &[T]) {
        self.0.retain(|(n, _)| *n != name);
        self.0.push((name, bytemuck::cast_slice(data).to_vec()));
    }

    /// Elements of one.
    ///
    /// # Panics
    /// When there is none of that name.
    pub fn get<T: Pod>(&self, name: &str) -> Vec<T> {
        bytemuck::pod_collect_to_vec(self.bytes(name))
    }

    /// The only element of one.
    ///
    /// # Panics
    /// When there is none of that name, or it is empty.
    pub fn one<T: Pod>(&self, name: &str) -> T {
        self.get(name)[0]
    }

    /// Bytes of one.
    ///
    /// # Panics
    /// When there is none of that name.
    pub fn bytes(&self, name: &str) -> &[u8] {
        let found = self.0.iter().find(|(n, _)| *n == name);
        found.map(|(_, b)| b.as_slice()).unwrap_or_else(|| panic!("no buffer called `{name}`"))
    }
}

/// One call of a kernel, ready to be made.
#[derive(Clone, Debug)]
pub struct Call {
    /// Contents of its buffers before the call.
    pub buffers: Buffers,
    /// Values of its overrides.
    pub constants: Constants,
    /// Its immediates.
    pub immediates: Vec<u8>,
    /// Workgroups.
    pub groups: u32,
    /// Rows the workgroups are folded into.
    pub rows: u32,
    /// Bindings that are another name of the same buffer.
    pub same: Vec<(&'static str, &'static str)>,
    /// Least subgroup size the kernel is made for; devices with smaller ones run another kernel.
    pub lanes: u32,
}

impl Call {
    /// A call of `groups` workgroups.
    pub fn new(groups: usize) -> Self {
        Self {
            buffers: Buffers::default(),
            constants: Constants::none(),
            immediates: Vec::new(),
            groups: u32::try_from(groups).expect("fewer than 2^32 workgroups"),
            rows: 1,
            same: Vec::new(),
            lanes: 1,
        }
    }

    /// With a buffer.
    #[must_use]
    pub fn with<T: Pod>(mut self, name: &'static str, data: &[T]) -> Self {
        self.buffers.set(name, data);
        self
    }

    /// With a binding that is the buffer of another.
    #[must_use]
    pub fn same(mut self, name: &'static str, other: &'static str) -> Self {
        self.same.push((name, other));
        self
    }

    /// The binding whose buffer is bound under this name.
    pub fn buffer_of(&self, name: &'static str) -> &'static str {
        self.same.iter().find(|(n, _)| *n == name).map_or(name, |(_, other)| other)
    }

    /// With the value of an override.
    #[must_use]
    pub fn constant(mut self, name: &str, value: f64) -> Self {
        self.constants = self.constants.with(name, value);
        self
    }

    /// With the workgroups folded into rows, as a long dispatch is; the last row may have some too many.
    #[must_use]
    pub fn rows(self, rows: u32) -> Self {
        Self { rows, ..self }
    }

    /// Only for devices with subgroups of that size.
    #[must_use]
    pub fn lanes(self, lanes: u32) -> Self {
        Self { lanes, ..self }
    }

    /// What to dispatch.
    pub fn dispatch(&self) -> Groups {
        Groups::Direct([self.groups.div_ceil(self.rows), self.rows, 1])
    }

    /// With the grid as immediates, and among the buffers for the twin to read.
    #[must_use]
    pub fn grid(self, grid: &physvideo_gpu::kernels::Grid) -> Self {
        self.with("grid", &[*grid]).immediates(grid)
    }

    /// With immediates.
    #[must_use]
    pub fn immediates<T: Pod>(mut self, value: &T) -> Self {
        self.immediates = bytemuck::bytes_of(value).to_vec();
        self
    }
}
