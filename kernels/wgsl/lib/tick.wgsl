// How time goes on: `clock` and `live` are those of the kernel, of which one invocation comes here.

// Shortest step as a share of the frame: four times the rounding of time in f32, below which time does not pass.
const LEAST_STEP: f32 = 2.5e-7;

// Ends the last substep and chooses the next from the fastest wave and motion of the last.
fn tick() {
    clock.t += clock.dt;
    let full = atomicLoad(&live.overflow) + atomicLoad(&live.crowded) > 0u;
    // What leaves the domain at a speed it may have is no fault.
    let lost = atomicLoad(&clock.quarantined) - atomicLoad(&clock.left);
    let fault = clock.watch != 0u && atomicLoad(&clock.clamped_velocity) + lost > 0u;
    // The host makes room, wakes what sleeps or takes smaller steps, and repeats the frame.
    if (full || fault || clock.stalled != 0u || atomicLoad(&clock.stirred) > 0u) {
        stop();
        return;
    }
    let left = clock.frame_length - clock.t;
    if (left <= 1e-6 * clock.frame_length) {
        stop();
        clock.t = clock.frame_length;
        return;
    }
    // Bits above those of the largest finite number are no speed: NaN would stop the clock for ever.
    let speed = bitcast<f32>(min(atomicExchange(&clock.speed_bits, 0u), 0x7f7fffffu));
    let waves = clock.courant * clock.dx / max(clock.wave_speed, speed);
    let limit = select(waves, min(waves, clock.longest), clock.longest > 0.0);
    // What is left is divided evenly, so that no frame ends with a sliver of a step.
    let even = left / max(1.0, ceil(left / limit - 1e-3));
    let dt = select(even, min(clock.force_dt, left), clock.force_dt > 0.0);
    if (dt < LEAST_STEP * clock.frame_length) {
        atomicStore(&clock.speed_bits, bitcast<u32>(speed));
        clock.stalled = 1u;
        stop();
        return;
    }
    clock.dt = dt;
    clock.substeps += 1u;
    clock.dt_min = select(min(clock.dt_min, dt), dt, clock.dt_min == 0.0);
    clock.dt_max = max(clock.dt_max, dt);
    clock.particle_groups = vec3u((clock.particles - clock.idle + 63u) / 64u, 1u, 1u);
    for (var i = 0u; i < RUNS; i++) {
        let count = clock.runs[i].w;
        clock.runs[i] = vec4u((count + 63u) / 64u, 1u, 1u, count);
    }
}

// No more substeps in this frame: what is still submitted finds no work.
fn stop() {
    clock.dt = 0.0;
    clock.particle_groups = vec3u(0u, 1u, 1u);
    for (var i = 0u; i < RUNS; i++) { clock.runs[i].x = 0u; }
}
