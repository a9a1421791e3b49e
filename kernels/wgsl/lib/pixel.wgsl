// From weighted colours to a pixel: PyTorch3D's two compositors, and colours packed as RGBA, 8 bits each.

// Front to back Σ w c Π(1 − w) when true, else Σ w c / Σ w.
override ALPHA: bool = false;
// Least Σ w that is divided by; PyTorch3D has 1e-4.
override LEAST_WEIGHT: f32 = 1e-4;

const NOTHING: u32 = 0xffffffffu;   // no point

struct Blend {
    sum: vec3f,         // Σ of weighted colours, 0 to 255
    weight: f32,        // Σ of weights
    through: f32,       // what the points so far let through
}

fn blend_in(b: ptr<function, Blend>, color: u32, weight: f32) {
    let rgb = vec3f(f32(color & 0xffu), f32((color >> 8u) & 0xffu), f32((color >> 16u) & 0xffu));
    var w = weight;
    if (ALPHA) { w *= (*b).through; }
    (*b).sum += w * rgb;
    (*b).weight += weight;
    (*b).through *= 1.0 - weight;
}

// The opaque pixel of what was blended in.
fn packed(b: Blend) -> u32 {
    var rgb = b.sum;
    if (!ALPHA) { rgb = b.sum / max(b.weight, LEAST_WEIGHT); }
    let bytes = vec3u(clamp(rgb, vec3f(0.0), vec3f(255.0)) + vec3f(0.5));
    return bytes.x | (bytes.y << 8u) | (bytes.z << 16u) | 0xff000000u;
}
