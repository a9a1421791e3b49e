//! Which particles a substep works on, in groups of 64: none that are not emitted yet.

use std::ops::Range;

use physvideo_gpu::GpuError;

use super::Mpm;

/// The groups of 64 that hold any of the particles in `ranges`, ascending.
fn groups(ranges: impl Iterator<Item = Range<u64>>) -> Vec<u32> {
    let mut all: Vec<u32> =
        ranges.filter(|r| !r.is_empty()).flat_map(|r| (r.start / 64) as u32..=((r.end - 1) / 64) as u32).collect();
    all.sort_unstable();
    all.dedup();
    all
}

impl Mpm<'_> {
    /// Tells the sort which groups hold anything that moves.
    pub(super) fn choose_groups(&mut self) -> Result<(), GpuError> {
        let bodies = self.ranges.iter().enumerate();
        let busy = bodies.flat_map(|(i, all)| match self.emitters.iter().find(|e| e.body == i) {
            Some(emitter) => emitter.out().to_vec(),
            None => vec![all.clone()],
        });
        self.groups = groups(busy);
        self.cells.sort_only(self.gpu, &self.groups)
    }

    /// Groups of 64 that hold any of `count` particles from `first` on and are worked on.
    pub(super) fn busy_groups(&self, first: u32, count: u32) -> u32 {
        let (low, high) = (first / 64, (first + count).div_ceil(64));
        self.groups.iter().filter(|g| (low..high).contains(g)).count() as u32
    }
}

#[cfg(test)]
mod tests {
    use super::groups;

    #[test]
    fn a_group_is_named_once_however_many_ranges_touch_it() {
        assert_eq!(groups([0..1, 10..64, 64..65, 200..200, 300..449].into_iter()), [0, 1, 4, 5, 6, 7]);
        assert!(groups(std::iter::once(5..5)).is_empty());
    }
}
