//! One case per kernel, with an f64 twin written from the equation. A kernel is a line in `CASES`; what is done with
//! the cases lives in `harness`.

pub mod call;
pub mod cells;
pub mod cloud;
pub mod compare;
pub mod harness;
pub mod lagrangian;
pub mod latent;
pub mod lattice;
pub mod mpm;
pub mod points;
pub mod source;
pub mod sph;
pub mod work;

pub use call::{Buffers, Call};
pub use compare::{Compared, Report};

/// Every case. Its file mirrors the kernel's: `wgsl/mpm/p2g.wgsl` is proved in `proof/mpm/p2g.rs`.
pub static CASES: &[&Case] = &[
    &cells::clear::CASE,
    &cells::count::CASE,
    &cells::link::CASE,
    &cells::locate::CASE,
    &cells::place::CASE,
    &cells::range::CASE,
    &lagrangian::advance::CASE,
    &lagrangian::bend::CASE,
    &lagrangian::contact::CASE,
    &lagrangian::core::CASE,
    &lagrangian::force::CASE,
    &lagrangian::meet::CASE,
    &lagrangian::press::CASE,
    &lagrangian::sample::CASE,
    &lagrangian::surface::CASE,
    &lagrangian::thin::CASE,
    &latent::adapt::CASE,
    &latent::flow_step::CASE,
    &latent::mask_pool::CASE,
    &latent::mix::CASE,
    &latent::sde_step::CASE,
    &latent::stats::CASE,
    &mpm::clock::CASE,
    &mpm::g2p::CASE,
    &mpm::grid::CASE,
    &mpm::grid_rows::CASE,
    &mpm::measure::CASE,
    &mpm::p2g::CASE,
    &mpm::p2g_fixed::CASE,
    &mpm::p2g_float::CASE,
    &mpm::receive::CASE,
    &mpm::settle::CASE,
    &mpm::stress_case::CASE,
    &mpm::survey::CASE,
    &points::bin_count::CASE,
    &points::bin_place::CASE,
    &points::bin_range::CASE,
    &points::bind::CASE,
    &points::blend::CASE,
    &points::blend_shared::CASE,
    &points::carry::CASE,
    &points::compose::CASE,
    &points::nearest32::CASE,
    &points::nearest64::CASE,
    &points::project::CASE,
    &points::resolve::CASE,
    &points::uncover::CASE,
    &points::unproject::CASE,
    &source::recycle::CASE,
    &sph::adopt::CASE,
    &sph::advance::CASE,
    &sph::clock::CASE,
    &sph::cohesion::CASE,
    &sph::density::CASE,
    &sph::descend::CASE,
    &sph::force::CASE,
    &sph::judge::CASE,
    &sph::pack::CASE,
    &sph::press::CASE,
    &sph::relax::CASE,
    &sph::resist::CASE,
    &sph::search::CASE,
    &sph::source::CASE,
    &sph::spread::CASE,
    &sph::surround::CASE,
    &sph::total::CASE,
    &sph::weigh::CASE,
];

/// What is needed to prove and to time a kernel.
pub struct Case {
    /// The kernel's name.
    pub kernel: &'static str,
    /// Seeded inputs.
    pub inputs: fn(Ask) -> Call,
    /// Computes the twin in f64 and sets it against what the kernel wrote.
    pub compare: fn(&Call, &Buffers) -> Vec<Compared>,
    /// Largest error allowed, relative to the scale of each [`Compared`].
    pub tolerance: f64,
    /// Why that much.
    pub reason: &'static str,
    /// Outputs that may differ between two runs (an order of atomics that nothing depends on).
    pub unordered: &'static [&'static str],
    /// Memory traffic an item, counted once for each value read or written [bytes].
    pub bytes: f64,
    /// Arithmetic an item [flop].
    pub flops: f64,
}

/// What inputs to make.
#[derive(Clone, Copy, Debug)]
pub struct Ask {
    /// Items: particles, points, pixels, tiles, or fours of a latent's elements.
    pub items: usize,
    /// Seed; also chooses between variants of a kernel.
    pub seed: u64,
    /// With NaN, infinite, huge and out-of-grid values in a few items.
    pub poison: bool,
}

/// The case of a kernel.
pub fn find(kernel: &str) -> Option<&'static Case> {
    CASES.iter().copied().find(|c| c.kernel == kernel)
}
