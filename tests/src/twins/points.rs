//! f64 twins of `points/*`: pinhole projection, PyTorch3D's naive point rasteriser and its two compositors (Ravi 2020),
//! and points carried by particles. Slow on purpose: every pixel looks at every point.

use glam::{DMat3, DVec2, DVec3, DVec4};
use physvideo::scene::Compositing;
use physvideo_kernels::Camera;

/// A pinhole camera in f64.
#[derive(Clone, Copy, Debug)]
pub struct View {
    /// Camera-from-world rotation.
    pub rotation: DMat3,
    /// Camera-from-world translation [m].
    pub translation: DVec3,
    /// Focal lengths [px].
    pub focal: DVec2,
    /// Principal point [px].
    pub center: DVec2,
    /// Near plane [m].
    pub near: f64,
}

impl View {
    /// What a kernel's camera says.
    pub fn of(c: &Camera) -> Self {
        let rows = [c.right, c.down, c.forward].map(|r| DVec4::from(r.map(f64::from)));
        Self {
            rotation: DMat3::from_cols(rows[0].truncate(), rows[1].truncate(), rows[2].truncate()).transpose(),
            translation: DVec3::new(rows[0].w, rows[1].w, rows[2].w),
            focal: DVec2::from(c.focal.map(f64::from)),
            center: DVec2::from(c.center.map(f64::from)),
            near: f64::from(c.near),
        }
    }

    /// Centre [px], depth [m] and radius [px] of a point's disc, if it is drawn.
    pub fn disc(&self, point: [f32; 4], radius_in_pixels: bool) -> Option<[f64; 4]> {
        let [x, y, z, r] = point.map(f64::from);
        let q = self.rotation * DVec3::new(x, y, z) + self.translation;
        let radius = if radius_in_pixels { r } else { r * self.focal.x / q.z };
        let at = self.focal * q.truncate() / q.z + self.center;
        let drawn = q.is_finite() && at.is_finite() && radius.is_finite() && q.z >= self.near && radius > 0.0;
        drawn.then_some([at.x, at.y, q.z, radius])
    }

    /// World position of a pixel of known depth.
    pub fn unproject(&self, x: u32, y: u32, depth: f64) -> DVec3 {
        let pixel = DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5);
        let q = ((pixel - self.center) / self.focal * depth).extend(depth);
        self.rotation.transpose() * (q - self.translation)
    }
}

/// What is drawn, and how.
pub struct Scene<'a> {
    /// The discs, none where a point is not drawn.
    pub discs: &'a [Option<[f64; 4]>],
    /// RGBA8 of each point.
    pub colors: &'a [u32],
    /// Object of each point.
    pub objects: &'a [u32],
    /// Size of the image [px].
    pub size: [u32; 2],
    /// Points blended per pixel.
    pub k: usize,
    /// Compositor.
    pub compositing: Compositing,
    /// Only points this close behind the nearest [m].
    pub blend_depth: Option<f64>,
    /// Rounding may decide otherwise when a boundary is this close: [px] for discs, relative for depths.
    pub margin: [f64; 2],
    /// Negative control: the rim belongs to the disc, d² ≤ r².
    pub closed: bool,
}

/// A pixel before it is rounded to bytes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pixel {
    /// Some point hits it.
    pub hit: bool,
    /// 0 to 255.
    pub rgb: DVec3,
    /// [m], 0 where nothing is.
    pub depth: f64,
    /// Object, 0 where nothing is.
    pub id: u32,
    /// A boundary lies within the margin.
    pub unsure: bool,
}

/// The image, row by row from the top.
pub fn draw(scene: &Scene<'_>) -> Vec<Pixel> {
    let [width, height] = scene.size;
    let pixels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
    pixels.map(|(x, y)| pixel(scene, DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5))).collect()
}

/// The pixel whose centre is at `at` [px].
pub fn pixel(scene: &Scene<'_>, at: DVec2) -> Pixel {
    let mut unsure = false;
    // Depth, number and 1 − d²/r².
    let mut hits: Vec<(f64, usize, f64)> = Vec::new();
    for (i, disc) in scene.discs.iter().enumerate() {
        let Some([x, y, z, r]) = *disc else { continue };
        let d2 = (at - DVec2::new(x, y)).length_squared();
        unsure |= (d2.sqrt() - r).abs() < scene.margin[0];
        if d2 < r * r || (scene.closed && d2 == r * r) {
            hits.push((z, i, 1.0 - d2 / (r * r)));
        }
    }
    hits.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let close = |a: f64, b: f64| (a - b).abs() < scene.margin[1] * b;
    unsure |= hits.windows(2).take(scene.k).any(|w| close(w[0].0, w[1].0));
    hits.truncate(scene.k);
    let Some(&(depth, nearest, _)) = hits.first() else {
        return Pixel { hit: false, rgb: DVec3::ZERO, depth: 0.0, id: 0, unsure };
    };
    if let Some(limit) = scene.blend_depth {
        unsure |= hits.iter().any(|h| close(h.0, depth + limit));
        hits.retain(|h| h.0 <= depth + limit);
    }
    let color = |i: usize| DVec3::from([0, 8, 16].map(|s| f64::from((scene.colors[i] >> s) & 0xff)));
    let rgb = match scene.compositing {
        Compositing::NormWeighted => {
            let sum: DVec3 = hits.iter().map(|h| h.2 * color(h.1)).sum();
            let weight: f64 = hits.iter().map(|h| h.2).sum();
            // PyTorch3D never divides by less than 1e-4; with a blend depth the engine divides by what there is.
            sum / if scene.blend_depth.is_none() { weight.max(1e-4) } else { weight }
        }
        Compositing::Alpha => {
            let front_to_back = hits.iter().fold((DVec3::ZERO, 1.0), |(sum, through), h| {
                (sum + through * h.2 * color(h.1), through * (1.0 - h.2))
            });
            front_to_back.0
        }
    };
    Pixel { hit: true, rgb, depth, id: scene.objects[nearest], unsure }
}

/// A particle as points see it: where it was when they were bound, where it is, and its F then and now.
#[derive(Clone, Copy, Debug)]
pub struct Particle {
    /// Position when bound [m].
    pub x0: DVec3,
    /// Position [m].
    pub x: DVec3,
    /// F when bound.
    pub f0: DMat3,
    /// F.
    pub f: DMat3,
}

/// x = Σ w (x_p + F_p F_p0⁻¹ (X − X_p0)) / Σ w.
pub fn carry(rest: DVec3, carriers: &[(Particle, f64)]) -> DVec3 {
    let total: f64 = carriers.iter().map(|c| c.1).sum();
    let sum: DVec3 = carriers.iter().map(|(p, w)| *w * (p.x + p.f * p.f0.inverse() * (rest - p.x0))).sum();
    sum / total
}
