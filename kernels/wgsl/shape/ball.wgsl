//! member 2 of fn (c: Collider, r: vec3f, side: u32) -> vec4f = vec4f(0.0, 0.0, 1.0, 1.0)
// Ball of radius size.x.

fn shape_ball(c: Collider, r: vec3f, side: u32) -> vec4f {
    let d = length(r);
    return vec4f(select(vec3f(0.0, 0.0, 1.0), r / max(d, 1e-20), d > 0.0), d - c.size.x);
}
