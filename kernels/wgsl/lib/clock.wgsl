// Time on the device. One invocation of `cells/range` or `mpm/clock` writes it (lib/tick), everything else reads it.

// Eight stretches of particles, six calls.
const RUNS: u32 = 15u;

struct Clock {
    frame_start: f32,     // [s] since the start of the run
    frame_length: f32,    // [s]
    t: f32,               // [s] since frame_start, at the start of this substep
    dt: f32,              // [s] this substep; 0 when the frame is done
    dx: f32,              // [m]
    courant: f32,
    wave_speed: f32,      // [m/s] least speed that counts: of the slowest body's waves at rest
    force_dt: f32,        // [s] > 0 overrides the choice
    speed_bits: atomic<u32>,  // bits of the largest |v| + c of a particle [m/s]; non-negative floats order like their bits
    substeps: u32,        // since the frame began
    dt_min: f32,          // [s] since the frame began
    dt_max: f32,
    clamped_velocity: atomic<u32>,
    clamped_strain: atomic<u32>,
    clamped_volume: atomic<u32>,
    quarantined: atomic<u32>,
    particle_groups: vec3u,   // workgroups of 64 for per-particle kernels; x = 0 when the frame is done
    particles: u32,
    longest: f32,         // [s] > 0: no step is longer, whatever the waves allow
    watch: u32,           // 1: a node that ran away or a particle that was lost ends the attempt
    idle: u32,            // particles that are left out
    stalled: u32,         // 1: the step came out too short for the frame ever to end
    runs: array<vec4u, RUNS>,  // of each stretch of particles with one material, then of each call of bodies on grids of their
                        // own: workgroups of 64, 1, 1; its particles, or items, in w
    starts: array<u32, 8>,  // and where they begin in the list of those that are worked on
    stir: f32,            // [m/s] speed beside what is asleep that ends the attempt
    stirred: atomic<u32>, // particles there that were faster
    work_unit: f32,       // [J] what one step of the next two stands for
    work_low: atomic<u32>,    // energy that moving obstacles and new starts have brought in this frame: a whole number of 64
    work_high: atomic<u32>,   // bits in two's complement
    left: atomic<u32>,        // of those quarantined, finite ones that went over the domain's edge
    sunk: atomic<u32>,    // particles of a liquid found deeper in an obstacle than half of their size, at the end of the frame
}
