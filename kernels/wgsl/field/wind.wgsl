//! member 2 of fn (f: Field, x: vec3f, v: vec3f, t: f32) -> vec3f = vec3f(0.0)
// Linear drag towards the air's velocity a [m/s]: drag rate p0 [1/s], gusts of relative size p1 at p2 [Hz].

fn field_wind(f: Field, x: vec3f, v: vec3f, t: f32) -> vec3f {
    let gust = 1.0 + f.p1 * sin(6.2831853 * f.p2 * (t - f.start));
    return f.p0 * (f.a.xyz * gust - v);
}
