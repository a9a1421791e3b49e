//! use lib/texel lib/grid lib/clock lib/collider lib/particle lib/work
// What happens at a node of the grid once its momentum and mass are summed.

// Mass below which a node's slowing down is not counted [kg]: the gradient of a B-spline falls off slower than its
// weight, so nodes at the rim of a body are thrown about however short the step, and carry next to nothing.
override SPARSE: f32 = 0.0;

// Nodes nearer to an obstacle than this meet it [cells]. Material comes to rest 0.3 cells behind the last node that is
// held; so, over all places of a surface between nodes, it rests at the surface.
const CONTACT: f32 = 0.8;

// Bit i: obstacle i may hold nodes of the block whose lowest node is at `low`.
fn obstacle_near(i: u32, low: vec3f, time: f32) -> u32 {
    // Half the diagonal of 3 × 3 × 3 cells around the block's middle, and how far contact reaches.
    let middle = low + vec3f(1.5) * grid.dx;
    return select(0u, 1u << i, gap(load_collider(i), middle, time) <= (2.6 + CONTACT) * grid.dx);
}

// Velocity of a node from its momentum and mass.
fn node_velocity(sum: vec4f) -> vec3f {
    let v = sum.xyz / select(1.0, sum.w, sum.w > 0.0);
    // One bad particle must not poison all it touches.
    if (!finite(v)) {
        if (sum.w > 0.0) { atomicAdd(&clock.clamped_velocity, 1u); }
        return vec3f(0.0);
    }
    return v;
}

// Velocity v of a node at x with some mass after contact with obstacle c. In the obstacle's own frame contact takes
// energy, so what it gives is no more than its impulse times its velocity.
fn meet(c: Collider, x: vec3f, v: vec3f, mass: f32, time: f32) -> vec3f {
    let after = collide(c, x, v, time, CONTACT * grid.dx);
    if (COUNTS_WORK) { count_work(mass * dot(after - v, obstacle_velocity(c, x, time))); }
    return after;
}

// What is kept of a node: its velocity after all it met, not more than what the step allows, and its mass.
fn node(velocity: vec3f, mass: f32, dt: f32) -> vec4f {
    if (!(mass > 0.0)) { return vec4f(0.0); }
    // Nothing may cross more than a cell in a step; a sparsely filled node can be thrown faster than that.
    let fastest = 0.9 * grid.dx / dt;
    let speed = length(velocity);
    if (speed <= fastest) { return vec4f(velocity, mass); }
    if (mass > SPARSE) { atomicAdd(&clock.clamped_velocity, 1u); }
    return vec4f(velocity * (fastest / speed), mass);
}
