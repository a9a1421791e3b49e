//! What `lib/work` must have counted: energy in whole units of a clock.

use physvideo_gpu::kernels::Clock;

use super::Compared;

/// What one unit stands for [J]: a node's work is some billions of them, around the width of a word.
pub const UNIT: f32 = 1e-12;

/// A clock that has counted near the edge of its lower word.
pub fn begun(clock: Clock) -> Clock {
    Clock { work_unit: UNIT, work_low: 0xffff_fff0, work_high: 7, ..clock }
}

fn units(clock: &Clock) -> i64 {
    (u64::from(clock.work_high) << 32 | u64::from(clock.work_low)) as i64
}

/// Work as twins see it.
#[derive(Clone, Copy, Debug, Default)]
pub struct Work {
    /// Its sum [J].
    pub sum: f64,
    /// Sum of the sizes of what it is made of, products of momenta and velocities [J].
    pub size: f64,
    /// What rounding may have decided otherwise, or what has no value [J].
    pub doubt: f64,
    /// Parts, each rounded to whole units.
    pub parts: f64,
}

impl Work {
    /// Adds a part of some size, which is certain or not.
    pub fn add(&mut self, joules: f64, size: f64, certain: bool) {
        self.sum += joules;
        self.size += size;
        self.doubt += if certain { 0.0 } else { 2.0 * size };
        self.parts += 1.0;
    }

    /// The device's count between two clocks against it; `share` of the sizes is lost to rounding.
    pub fn compare(&self, before: &Clock, after: &Clock, counts: bool, share: f64) -> Compared {
        let got = units(after).wrapping_sub(units(before)) as f64;
        let unit = f64::from(UNIT);
        let near = (got * unit - self.sum).abs() <= share * self.size + self.doubt + self.parts * unit;
        Compared::fact("work is counted", if counts { near || !self.size.is_finite() } else { got == 0.0 })
    }
}
