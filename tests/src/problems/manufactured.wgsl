//! member 100 of fn (f: Field, x: vec3f, v: vec3f, t: f32) -> vec3f = vec3f(0.0)
// The acceleration under which a neo-Hookean body moves as u_i = a_i sin(k X_i) sin(w t + b_i): k is p0 [1/m], w is p1
// [1/s], λ/ρ and μ/ρ [m²/s²] are a.w and b.w.

fn field_manufactured(f: Field, x: vec3f, v: vec3f, t: f32) -> vec3f {
    let k = f.p0;
    let swing = f.a.xyz * sin(vec3f(f.p1 * t) + f.b.xyz);
    var rest = x;       // X of x = X + u(X) by Newton
    for (var i = 0; i < 5; i++) {
        rest -= (rest + swing * sin(k * rest) - x) / (1.0 + k * swing * cos(k * rest));
    }
    let stretch = 1.0 + k * swing * cos(k * rest);
    let log_j = log(stretch.x * stretch.y * stretch.z);
    let stiff = k * k * (f.b.w - (f.a.w * (log_j - 1.0) - f.b.w) / (stretch * stretch));
    return swing * sin(k * rest) * (stiff - f.p1 * f.p1);
}
