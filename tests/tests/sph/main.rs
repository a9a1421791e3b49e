//! Liquids of SPH: problems with a known answer, each with a control that must fail.

mod channel;
mod dam;
mod drop;
mod emitter;
mod guard;
mod lists;
mod motion;
mod slump;
mod spin;
mod tank;
mod twist;
mod vortex;
mod walls;
mod work;
