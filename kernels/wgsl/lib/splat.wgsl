//! use lib/camera
// A display point (position in xyz, radius in w) as a disc in the image, with the semantics of PyTorch3D's point
// rasteriser: a pixel is hit when its centre lies strictly inside. Every path of the renderer uses these functions,
// so that all of them draw the same pixels.

// The radius of a point: pixels when true, else metres. PyTorch3D's radius in normalised coordinates, which span the
// shorter side of the image, is radius_px = radius_ndc * min(width, height) / 2.
override RADIUS_IN_PIXELS: bool = false;

// Size of the image and number of points, as kernels get them in immediates.
struct Screen {
    width: u32,         // [px]
    height: u32,        // [px]
    points: u32,
}

// Centre [px], depth [m] and radius [px] of a point's disc; all zero, which hits nothing, when it is not drawn:
// nearer than the near plane, no radius, or not finite.
fn splat(c: Camera, p: vec4f) -> vec4f {
    let q = in_camera(c, p.xyz);
    let at = c.focal * (q.xy / q.z) + c.center;
    var radius = p.w;
    if (!RADIUS_IN_PIXELS) { radius = p.w * c.focal.x / q.z; }
    let s = vec4f(at, q.z, radius);
    // Compilers may assume there is no NaN, so the test is on bits: exponent all ones.
    let exponent = bitcast<vec4u>(s) & vec4u(0x7f800000u);
    let drawn = all(exponent != vec4u(0x7f800000u)) && q.z >= c.near && q.z > 0.0 && radius > 0.0;
    return select(vec4f(0.0), s, drawn);
}

// First (xy) and last (zw) pixel whose centre may lie inside the disc; nothing when last < first.
// Rounding is monotonic and half-integers are exact, so no pixel that passes `weight` is left out.
fn reach(s: vec4f, screen: Screen) -> vec4i {
    let size = vec2f(f32(screen.width), f32(screen.height));
    let first = clamp(ceil(s.xy - s.w - vec2f(0.5)), vec2f(0.0), size);
    let last = clamp(floor(s.xy + s.w - vec2f(0.5)), vec2f(-1.0), size - vec2f(1.0));
    let none = s.w <= 0.0;
    return vec4i(vec2i(first), select(vec2i(last), vec2i(-1), vec2<bool>(none)));
}

// Squared distance of a pixel centre and squared radius [px²]; inside means x < y.
fn distances(s: vec4f, pixel: vec2u) -> vec2f {
    let d = vec2f(pixel) + vec2f(0.5) - s.xy;
    return vec2f(dot(d, d), s.w * s.w);
}

// 1 − d²/r² of a pixel inside the disc, in a form that is never rounded to zero there.
fn weight(d: vec2f) -> f32 {
    return (d.y - d.x) / d.y;
}
