// A pinhole camera in OpenCV axes (x right, y down, z forward), camera-from-world. Pixel centres lie at + 0.5.

struct Camera {
    right: vec4f,       // rows of the rotation, translation in w [m]
    down: vec4f,
    forward: vec4f,
    focal: vec2f,       // [px]
    center: vec2f,      // principal point [px]
    near: f32,          // what is nearer is not drawn [m]
}

fn in_camera(c: Camera, x: vec3f) -> vec3f {
    return vec3f(dot(c.right.xyz, x) + c.right.w, dot(c.down.xyz, x) + c.down.w, dot(c.forward.xyz, x) + c.forward.w);
}

fn in_world(c: Camera, q: vec3f) -> vec3f {
    let r = q - vec3f(c.right.w, c.down.w, c.forward.w);
    return r.x * c.right.xyz + r.y * c.down.xyz + r.z * c.forward.xyz;
}
