//! Problems with a known answer, each small, with a control that must fail. Ids are those of the method papers' usual
//! suite: M1 motion, M2 and M4 manufactured, M5 vibrating bar, M6 colliding discs, M7 cantilever, M8 column, M9 sand, S1 and S2 liquid. Worlds and
//! measures are in `physvideo_tests::problems`.

mod bar;
mod budget;
mod cantilever;
mod cap;
mod column;
mod discs;
mod emitter;
mod fields;
mod flows;
mod guard;
mod liquid;
mod manufactured;
mod motion;
mod recycle;
mod rest;
mod sleep;
mod suite;
mod yielding;

use physvideo_tests::problems::{Setting, order};

/// The solver's own way, at a resolution and a Courant number.
fn at(resolution: u32, courant: f32) -> Setting {
    by("updated_lagrangian", resolution, courant)
}

fn by(method: &'static str, resolution: u32, courant: f32) -> Setting {
    Setting { method, resolution, courant }
}
