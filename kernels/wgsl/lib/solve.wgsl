//! use lib/clock lib/grid
// An iteration that the device itself ends: the size of its passes is the counter they are dispatched by.

// Size and progress of an iteration.
struct Solve {
    groups: vec3u,          // workgroups of 64 of a pass; x = 0 when it is solved
    iterations: u32,        // of this solve
    residual: atomic<u32>,  // Σ of what is left of the error, in RESIDUAL
    all: u32,               // iterations since the frame began
    worst: u32,             // most of a solve since the frame began
    unsolved: u32,          // solves since the frame began that ended with too large an error
}
const RESIDUAL: f32 = 65536.0;
