//! member 4 of fn (f: Field, x: vec3f, v: vec3f, t: f32) -> vec3f = vec3f(0.0)
// A curl about the axis through b [m] along the unit vector a: acceleration p0 exp(−r/p1) [m/s²] along the circles around
// it, r [m] the distance from the axis. It swings as a sine of p2 [Hz]; 0: steady.

fn field_vortex(f: Field, x: vec3f, v: vec3f, t: f32) -> vec3f {
    let along = cross(f.a.xyz, x - f.b.xyz);
    let r = length(along);
    let swing = select(sin(6.2831853 * f.p2 * (t - f.start)), 1.0, f.p2 == 0.0);
    // On the axis itself there is no direction.
    return along * (f.p0 * swing * exp(-r / f.p1) / max(r, 1e-20));
}
