//! The data of the SDE's figures, and their laws after any number of iterations without Monte Carlo.

use physvideo::flow::{SdeRule, stable_gamma};
use physvideo::scene::Sde;
use physvideo_gpu::GpuError;
use physvideo_tests::flow::data::{Data, normal};
use physvideo_tests::flow::laws::{self, Moments};
use physvideo_tests::flow::run::{Lab, Summary};
use physvideo_tests::flow::transfer::{Law, Transfer};

use super::{Bench, CHAIN, MANY, START, TAU};

/// Mean, variance and share above 0 (NaN where it is not asked for).
#[derive(Clone, Copy, Debug)]
pub struct Figures {
    pub mean: f64,
    pub variance: f64,
    pub upper: f64,
}

impl From<&Law> for Figures {
    fn from(law: &Law) -> Self {
        Self { mean: law.mean(), variance: law.variance(), upper: law.upper() }
    }
}

impl From<Summary> for Figures {
    fn from(s: Summary) -> Self {
        Self { mean: s.mean, variance: s.variance, upper: s.upper }
    }
}

impl Figures {
    /// Errors against what is right: of the mean over τ, of the variance relative, of the share; all in percent.
    pub fn errors(self, right: Self, tau: f64) -> [f64; 3] {
        [(self.mean - right.mean) / tau, self.variance / right.variance - 1.0, self.upper - right.upper]
            .map(|e| 100.0 * e)
    }
}

/// Data and the noise level of the SDE.
pub struct Problem {
    pub name: &'static str,
    pub data: Data,
    pub tau: f64,
}

impl Problem {
    /// The problems of the figures.
    pub fn all() -> Vec<Self> {
        let p = |name, data, tau| Self { name, data, tau };
        vec![
            p("Gaussian, s = 1, τ = 28/29", Data::gaussian(0.0, 1.0), TAU),
            p("point, s = 0, τ = 28/29", Data::point(0.0), TAU),
            p("Gaussian, s = 1, τ = 0.8", Data::gaussian(0.0, 1.0), 0.8),
            p("point, s = 0, τ = 0.8", Data::point(0.0), 0.8),
            p("two modes, τ = 28/29", Data::two_points(TAU, 1.5, 0.5), TAU),
            p("two modes 0.7 : 0.3, τ = 28/29", Data::two_points(TAU, 1.5, 0.3), TAU),
        ]
    }

    /// Whether a quadrature is needed.
    pub fn mixed(&self) -> bool {
        self.data.0.len() > 1
    }

    fn line(&self) -> ((f64, f64), f64) {
        let mode = self.data.0[0];
        let s2 = mode.deviation * mode.deviation;
        (laws::line(self.tau, mode.mean, s2), s2)
    }

    /// Mean and variance of the start: the forward sample of a point at one of the two modes.
    pub fn start(&self) -> (f64, f64) {
        (1.5 * self.tau, self.tau * self.tau)
    }

    fn start_law(&self) -> Law {
        let (mean, variance) = self.start();
        Law::new(|z| normal(z, mean, variance))
    }

    /// The marginal, to which the SDE goes.
    pub fn target(&self) -> Figures {
        let upper = if self.mixed() { Law::marginal(&self.data, self.tau).upper() } else { f64::NAN };
        Figures { mean: self.data.mean(self.tau), variance: self.data.variance(self.tau), upper }
    }

    /// The rule with this step, where it has one that is stable.
    pub fn rule(&self, sde: Sde, gamma: f64) -> Option<SdeRule> {
        let stable = sde == Sde::Exponential || gamma < stable_gamma(self.tau);
        SdeRule::new(sde, gamma, self.tau, None, false).ok().filter(|_| stable)
    }

    /// The law of a rule after so many iterations from the start.
    pub fn after(&self, rule: SdeRule, iterations: u32) -> Figures {
        if self.mixed() {
            return Figures::from(&Transfer::new(rule, &self.data).after(&self.start_law(), iterations));
        }
        let ((mean, variance), (line, _)) = (self.start(), self.line());
        let m = (0..iterations).fold(Moments::start(mean, variance), |m, n| m.step(rule.step(n), line, 0.0));
        Figures { mean: m.mean, variance: m.variance, upper: f64::NAN }
    }

    /// The laws of a rule after 0, 1, … iterations.
    pub fn course(&self, rule: SdeRule, iterations: u32) -> Vec<Figures> {
        let (transfer, start) = (Transfer::new(rule, &self.data), self.start_law());
        (0..=iterations).map(|n| Figures::from(&transfer.after(&start, n))).collect()
    }

    /// The law in which a rule settles.
    pub fn settled(&self, rule: SdeRule) -> Figures {
        if self.mixed() {
            let law = Transfer::new(rule, &self.data).settled(&Law::marginal(&self.data, self.tau));
            return Figures::from(&law);
        }
        let s = laws::spread(self.tau, self.line().1);
        let variance = laws::settled_variance(rule.sde, rule.gamma, self.tau, s);
        Figures { mean: self.data.mean(self.tau), variance, upper: f64::NAN }
    }

    /// The law of the Langevin equation itself after `time`: closed form, or Euler–Maruyama by quadrature with 256, 512
    /// and 1024 steps and two extrapolations.
    pub fn langevin(&self, time: f64) -> Figures {
        if self.mixed() {
            let at = |n: u32| {
                let gamma = time / f64::from(n);
                self.rule(Sde::EulerMaruyama, gamma).map(|rule| self.after(rule, n))
            };
            let (Some(a), Some(b), Some(c)) = (at(256), at(512), at(1024)) else { return self.target() };
            let limit = |f: fn(&Figures) -> f64| (8.0 * f(&c) - 6.0 * f(&b) + f(&a)) / 3.0;
            return Figures { mean: limit(|f| f.mean), variance: limit(|f| f.variance), upper: limit(|f| f.upper) };
        }
        let s = laws::spread(self.tau, self.line().1);
        let (mean, variance) = laws::langevin(s, self.data.mean(self.tau), self.start(), time);
        Figures { mean, variance, upper: f64::NAN }
    }

    /// A rule on the device: from the start, or from the marginal.
    pub fn measure(
        &self,
        bench: &Bench,
        rule: SdeRule,
        iterations: u32,
        from_marginal: bool,
    ) -> Result<Summary, GpuError> {
        let mut lab = Lab::plain(bench.gpu, MANY)?;
        if from_marginal {
            let parts: Vec<_> = self.data.marginal(self.tau).collect();
            // The first parts' share of the numbers begins in the first part; all parts are as wide as each other.
            let first = (parts[0].0 * 10.0).round() as usize;
            let mean = |i: usize| if i % 10 < first { parts[0].1 } else { parts[parts.len() - 1].1 };
            lab.start(|i| mean(i) as f32, parts[0].2.sqrt(), START)?;
        } else {
            lab.start(|_| self.start().0 as f32, self.start().1.sqrt(), START)?;
        }
        let fast = self.data.fast(self.tau);
        lab.sde(rule, iterations, CHAIN, &|z, v| fast.fill(z, v))?;
        lab.summary()
    }
}
