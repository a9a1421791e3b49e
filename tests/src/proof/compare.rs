//! Sets what a kernel wrote against what its twin expects, and says how far apart they are. Knows no kernel.

/// One output against its twin.
#[derive(Clone, Debug)]
pub struct Compared {
    what: &'static str,
    got: Vec<f64>,
    want: Vec<f64>,
    /// Size of the numbers whose rounding makes the error; 0 means equal.
    scale: Vec<f64>,
}

impl Compared {
    /// Numbers that are to be equal but for rounding, each relative to a scale of its own.
    pub fn close(what: &'static str, got: Vec<f64>, want: Vec<f64>, scale: Vec<f64>) -> Self {
        assert!(got.len() == want.len() && want.len() == scale.len(), "{what}: lengths differ");
        Self { what, got, want, scale }
    }

    /// Numbers that are to be equal but for rounding, relative to one scale.
    pub fn near(what: &'static str, got: Vec<f64>, want: Vec<f64>, scale: f64) -> Self {
        let scale = vec![scale; want.len()];
        Self::close(what, got, want, scale)
    }

    /// Integers that are to be equal.
    pub fn equal(what: &'static str, got: &[u32], want: &[u32]) -> Self {
        assert_eq!(got.len(), want.len(), "{what}: lengths differ");
        let of = |words: &[u32]| words.iter().map(|w| f64::from(*w)).collect();
        Self { what, got: of(got), want: of(want), scale: vec![0.0; got.len()] }
    }

    /// Something that is to be true.
    pub fn fact(what: &'static str, holds: bool) -> Self {
        Self::equal(what, &[u32::from(holds)], &[1])
    }

    /// The sums of both sides, to be equal within `share` of what their terms are allowed.
    #[must_use]
    pub fn total(&self, what: &'static str, share: f64) -> Self {
        let sum = |terms: &[f64]| terms.iter().sum::<f64>();
        Self::near(what, vec![sum(&self.got)], vec![sum(&self.want)], share * sum(&self.scale))
    }

    /// How far apart they are.
    pub fn report(&self) -> Report {
        let (mut max, mut sum, mut worst) = (0.0, 0.0, 0);
        for (i, ((got, want), scale)) in self.got.iter().zip(&self.want).zip(&self.scale).enumerate() {
            let apart = (got - want).abs();
            // A NaN on either side is as wrong as can be; so is any difference where none is allowed.
            let error = if apart == 0.0 {
                0.0
            } else if *scale > 0.0 && apart.is_finite() {
                apart / scale
            } else {
                f64::INFINITY
            };
            sum += error * error;
            if error > max {
                (max, worst) = (error, i);
            }
        }
        let rms = (sum / self.got.len().max(1) as f64).sqrt();
        let pair = (self.got.get(worst).copied().unwrap_or(0.0), self.want.get(worst).copied().unwrap_or(0.0));
        Report { what: self.what, items: self.got.len(), max, rms, worst, pair }
    }
}

/// The error of one output.
#[derive(Clone, Debug, PartialEq)]
pub struct Report {
    /// Which output.
    pub what: &'static str,
    /// How many numbers it has.
    pub items: usize,
    /// Largest error relative to the scale.
    pub max: f64,
    /// Root of the mean square.
    pub rms: f64,
    /// Index of the largest.
    pub worst: usize,
    /// Kernel and twin there.
    pub pair: (f64, f64),
}

impl std::fmt::Display for Report {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Report { what, max, rms, worst, pair: (got, want), .. } = self;
        write!(f, "{what}: max {max:.2e} rms {rms:.2e}, worst at {worst}: {got} where the twin has {want}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_are_found_where_they_are() {
        let report = Compared::near("x", vec![1.0, 2.0, 3.0], vec![1.0, 2.5, 3.0], 2.0).report();
        assert_eq!((report.worst, report.max, report.pair), (1, 0.25, (2.0, 2.5)));
        assert!((report.rms - 0.25 / 3f64.sqrt()).abs() < 1e-15);
    }

    #[test]
    fn nan_and_unequal_integers_are_infinitely_wrong() {
        assert_eq!(Compared::near("x", vec![f64::NAN], vec![1.0], 1.0).report().max, f64::INFINITY);
        assert_eq!(Compared::equal("k", &[1, 2], &[1, 3]).report().max, f64::INFINITY);
        assert_eq!(Compared::fact("f", false).report().max, f64::INFINITY);
        assert_eq!(Compared::equal("k", &[1, 2], &[1, 2]).report().max, 0.0);
    }
}
