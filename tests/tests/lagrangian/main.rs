//! Elastic bodies on grids of their own: problems with a known answer, each with a control that must fail.

mod ball;
mod bar;
mod bounce;
mod cantilever;
mod choice;
mod contact;
mod damping;
mod guard;
mod mixed;
mod motion;
mod pair;
mod pierce;
mod rest;
mod setup;
mod shock;
mod thin;
