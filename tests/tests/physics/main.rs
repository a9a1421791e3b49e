//! Problems with a known answer, each with a control that must fail. Ids are those of the method papers' usual suite:
//! M1 motion, M5 vibrating bar, M6 colliding discs, M7 cantilever.

mod bar;
mod cantilever;
mod discs;
mod emitter;
mod fields;
mod guard;
mod motion;
mod recycle;
mod rest;
mod setup;
