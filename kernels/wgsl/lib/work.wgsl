// Energy that comes in from outside: from obstacles that move, and with particles that start anew. Counted in whole units, so
// that the sum does not depend on its order.

override COUNTS_WORK: bool = false;     // there is such a source

// What f32 holds, and far more than the guard behind the step lets pass.
const MOST_UNITS: f32 = 9e18;

fn count_work(joules: f32) {
    // Once the frame is done, what is still submitted finds the nodes of the last step.
    if (clock.dt > 0.0) { count_units(joules); }
}

fn count_units(joules: f32) {
    let units = joules / clock.work_unit;
    let size = abs(units);
    if (!(size >= 1.0 && size < MOST_UNITS)) { return; }
    let high = floor(size / 4294967296.0);
    let low = u32(size - high * 4294967296.0);
    if (units > 0.0) {
        let was = atomicAdd(&clock.work_low, low);
        atomicAdd(&clock.work_high, u32(high) + select(0u, 1u, was + low < was));
    } else {
        let was = atomicSub(&clock.work_low, low);
        atomicSub(&clock.work_high, u32(high) + select(0u, 1u, was < low));
    }
}
