//! What the photograph shows where objects in motion stand: the pixels to fill, and the edge that they uncover.

use physvideo_gpu::kernels::EdgePixel;

use crate::assemble::View;
use crate::backdrop::{self, FillError, FillSettings};
use crate::scene::{Scene, Source};
use crate::stages::display::{DisplayArrays, rgba};

/// How far beyond a mask its pixels may still hold the object's colour [px at the working size].
const FRINGE: u32 = 4;
/// Slits and windows in a mask narrower than twice this are filled with it; what is seen through them is too little
/// to continue a texture from [px].
const SLIT: u32 = 6;

/// The pixels that objects in motion cover in the photograph.
pub(crate) struct Holes {
    pub moving: Vec<bool>,
    still: Vec<bool>,
    pub hole: Vec<bool>,
}

impl Holes {
    pub fn new(scene: &Scene, view: &View) -> Result<Self, FillError> {
        let (w, h) = (view.photo.width, view.photo.height);
        let of = |moves: bool| -> Vec<bool> {
            let labels: Vec<u8> = scene
                .objects
                .iter()
                .filter(|o| o.material.is_some() == moves)
                .filter_map(|o| if let Source::Mask { label, .. } = o.source { Some(label) } else { None })
                .collect();
            view.photo.labels.iter().map(|l| labels.contains(l)).collect()
        };
        let (moving, still) = (of(true), of(false));
        let mut hole = backdrop::dilate(w, h, &backdrop::close(w, h, &moving, SLIT)?, FRINGE)?;
        for (hole, still) in hole.iter_mut().zip(&still) {
            *hole &= !still;
        }
        Ok(Self { moving, still, hole })
    }

    /// The photograph with the holes filled: first with what is behind everything, then, where a still object is
    /// partly hidden, with that object.
    pub fn fill(&self, view: &View, seed: u64) -> Result<Vec<[u8; 3]>, FillError> {
        let (w, h) = (view.photo.width, view.photo.height);
        let settings = FillSettings { seed, ..Default::default() };
        let exclude = backdrop::dilate(w, h, &self.still, 3)?;
        let filled = backdrop::fill(w, h, &view.photo.rgb, &self.hole, Some(&exclude), settings)?;
        if !self.still.contains(&true) {
            return Ok(filled);
        }
        // A still object goes on behind what hides it where its own outline closes over the gap.
        let closed = backdrop::close(w, h, &self.still, 24)?;
        let near = backdrop::dilate(w, h, &self.moving, 3)?;
        let hidden: Vec<bool> =
            (0..closed.len()).map(|i| (self.hole[i] && closed[i]) || (self.still[i] && near[i])).collect();
        let other: Vec<bool> = self.still.iter().map(|s| !s).collect();
        if !hidden.contains(&true) || !self.still.iter().zip(&hidden).any(|(s, h)| *s && !h) {
            return Ok(filled);
        }
        backdrop::fill(w, h, &filled, &hidden, Some(&other), settings)
    }
}

/// Pixels of the hole beyond the mask, each with the display point nearest to it in the picture.
pub(crate) fn edge(view: &View, holes: &Holes, filled: &[[u8; 3]], arrays: &DisplayArrays) -> Vec<EdgePixel> {
    let (w, h) = (view.photo.width as usize, view.photo.height as usize);
    let camera = view.photo.camera();
    let mut point_at = vec![u32::MAX; w * h];
    for (i, x) in arrays.points.iter().enumerate() {
        let at = camera.project(view.world.to_camera(glam::Vec3::new(x[0], x[1], x[2])));
        if let Some(([u, v], _)) = at
            && (0.0..w as f32).contains(&u)
            && (0.0..h as f32).contains(&v)
        {
            let pixel = v as usize * w + u as usize;
            if holes.moving[pixel] {
                point_at[pixel] = i as u32;
            }
        }
    }
    let reach = (FRINGE + SLIT) as isize;
    let mut out = Vec::new();
    for pixel in (0..w * h).filter(|i| holes.hole[*i] && !holes.moving[*i]) {
        let (x, y) = ((pixel % w) as isize, (pixel / w) as isize);
        let mut best = (isize::MAX, u32::MAX);
        for dy in -reach..=reach {
            for dx in -reach..=reach {
                let (u, v) = (x + dx, y + dy);
                if u >= 0 && v >= 0 && (u as usize) < w && (v as usize) < h {
                    let point = point_at[v as usize * w + u as usize];
                    let far = dx * dx + dy * dy;
                    if point != u32::MAX && far < best.0 {
                        best = (far, point);
                    }
                }
            }
        }
        if best.1 != u32::MAX {
            out.push(EdgePixel {
                pixel: pixel as u32,
                point: best.1,
                photo: rgba(view.photo.rgb[pixel]),
                filled: rgba(filled[pixel]),
            });
        }
    }
    out
}
