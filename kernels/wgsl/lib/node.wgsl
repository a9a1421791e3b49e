//! use lib/texel lib/grid lib/clock lib/collider lib/particle
// What happens at a node of the grid once its momentum and mass are summed.

// Mass below which a node's slowing down is not counted [kg]: the gradient of a B-spline falls off slower than its
// weight, so nodes at the rim of a body are thrown about however short the step, and carry next to nothing.
override SPARSE: f32 = 0.0;

// Bit i: obstacle i may hold nodes of the block whose lowest node is at `low`.
fn obstacle_near(i: u32, low: vec3f, time: f32) -> u32 {
    // Half the diagonal of 3 × 3 × 3 cells around the block's middle.
    let middle = low + vec3f(1.5) * grid.dx;
    return select(0u, 1u << i, gap(load_collider(i), middle, time) <= 2.6 * grid.dx);
}

// Velocity of a node at x with momentum and mass `sum`, after contact with the obstacles of `near`.
fn node_velocity(sum: vec4f, x: vec3f, near: u32, time: f32, dt: f32) -> vec3f {
    var v = sum.xyz / sum.w;
    // One bad particle must not poison all it touches.
    if (!finite(v)) {
        v = vec3f(0.0);
        atomicAdd(&clock.clamped_velocity, 1u);
    }
    for (var left = near; left != 0u; left &= left - 1u) {
        v = collide(load_collider(firstTrailingBit(left)), x, v, time);
    }
    // Nothing may cross more than a cell in a step; a sparsely filled node can be thrown faster than that.
    let fastest = 0.9 * grid.dx / dt;
    let speed = length(v);
    if (!(speed <= fastest)) {
        v *= fastest / speed;
        if (sum.w > SPARSE) { atomicAdd(&clock.clamped_velocity, 1u); }
    }
    return v;
}
