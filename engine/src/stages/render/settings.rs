//! What is drawn, how, and what comes out, as plain data. Knows no kernels.

use physvideo_gpu::kernels::Camera;
use physvideo_gpu::{Buf, GpuError};

use crate::scene::Compositing;

/// Most points blended per pixel.
pub const MOST_PER_PIXEL: u32 = 8;
const MOST_POINTS: u64 = 1 << 26;
const MOST_SIDE: u32 = 16_384;
const TILE: u64 = 8;

/// Why points cannot be drawn.
#[derive(Debug, thiserror::Error)]
pub enum RenderError {
    /// The device refused.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// Settings that cannot be drawn.
    #[error("render: {0}")]
    Settings(String),
    /// The discs cover more tiles than can be listed.
    #[error(
        "render: the discs of {points} points cover more than {room} tiles of 8 × 8 pixels; make the radius smaller or blend one point per pixel"
    )]
    TooDense {
        /// Points drawn.
        points: u64,
        /// Entries the lists may have.
        room: u64,
    },
}

/// How points are drawn and what comes out.
#[derive(Clone, Debug, PartialEq)]
pub struct RenderSettings {
    /// Width of the image [px].
    pub width: u32,
    /// Height of the image [px].
    pub height: u32,
    /// Points blended per pixel (K), 1 to 8; 1 is the fast path.
    pub per_pixel: u32,
    /// How the points of a pixel are combined.
    pub compositing: Compositing,
    /// Only points this close behind the nearest are blended [m]. Absent: all K, exactly PyTorch3D, which also
    /// darkens a pixel whose weights sum to less than 1e-4.
    pub blend_depth: Option<f32>,
    /// The radius of points is in pixels instead of metres. PyTorch3D's radius r in normalised coordinates, which
    /// span the shorter side, is r · min(width, height) / 2 pixels.
    pub radius_in_pixels: bool,
    /// Make the depth of the nearest point of each pixel.
    pub depth: bool,
    /// Make the object of the nearest point of each pixel.
    pub ids: bool,
    /// What is behind the points; absent: black.
    pub background: Option<Background>,
}

impl Default for RenderSettings {
    fn default() -> Self {
        Self {
            width: 640,
            height: 480,
            per_pixel: MOST_PER_PIXEL,
            compositing: Compositing::NormWeighted,
            blend_depth: None,
            radius_in_pixels: false,
            depth: false,
            ids: false,
            background: None,
        }
    }
}

/// What is behind the points.
#[derive(Clone, Copy, Debug)]
pub enum Background {
    /// RGBA8 of each pixel, row by row from the top; its alpha is not looked at.
    Picture(Buf<u32>),
    /// One colour, RGB.
    Color([u8; 3]),
}

impl PartialEq for Background {
    fn eq(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Picture(a), Self::Picture(b)) => a.erase() == b.erase(),
            (Self::Color(a), Self::Color(b)) => a == b,
            _ => false,
        }
    }
}

/// The points that are drawn: buffers somebody else fills.
#[derive(Clone, Copy, Debug)]
pub struct Display {
    /// Position [m] in xyz and radius (metres or pixels, see [`RenderSettings::radius_in_pixels`]) in w. A radius of 0
    /// and anything not finite is not drawn.
    pub points: Buf<[f32; 4]>,
    /// RGBA8 (red in the lowest byte, sRGB-encoded) of each point; alpha is not looked at.
    pub colors: Buf<u32>,
    /// Object of each point, from 1 on: 0 in the output means nothing is there.
    pub objects: Buf<u32>,
    /// Number of points.
    pub count: u64,
    /// The view.
    pub camera: Buf<Camera>,
}

/// A drawn image, row by row from the top.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// Width [px].
    pub width: u32,
    /// Height [px].
    pub height: u32,
    /// RGB, 3 bytes a pixel.
    pub rgb: Vec<u8>,
    /// Depth of the nearest point [m], 0 where there is none; when asked for.
    pub depth: Option<Vec<f32>>,
    /// Object of the nearest point, 0 where there is none; when asked for.
    pub ids: Option<Vec<u32>>,
}

impl RenderSettings {
    /// Refuses what cannot be drawn.
    pub(super) fn check(&self, display: &Display) -> Result<(), RenderError> {
        let refuse = |text: String| Err(RenderError::Settings(text));
        if self.width == 0 || self.height == 0 || self.width > MOST_SIDE || self.height > MOST_SIDE {
            return refuse(format!(
                "an image of {} × {} pixels; both sides must be 1 to {MOST_SIDE}",
                self.width, self.height
            ));
        }
        if self.per_pixel == 0 || self.per_pixel > MOST_PER_PIXEL {
            return refuse(format!("{} points blended per pixel; there must be 1 to {MOST_PER_PIXEL}", self.per_pixel));
        }
        if self.blend_depth.is_some_and(|d| !d.is_finite() || d < 0.0) {
            return refuse("the blend depth must be a finite length, 0 or more".into());
        }
        let n = display.count;
        if n > MOST_POINTS || n > display.points.len() || n > display.colors.len() || n > display.objects.len() {
            return refuse(format!("{n} points; the buffers or the renderer ({MOST_POINTS}) hold fewer"));
        }
        if let Some(Background::Picture(picture)) = self.background
            && picture.len() < self.pixels()
        {
            return refuse(format!(
                "a background of {} pixels behind an image of {} × {}",
                picture.len(),
                self.width,
                self.height
            ));
        }
        Ok(())
    }

    pub(super) fn pixels(&self) -> u64 {
        u64::from(self.width) * u64::from(self.height)
    }

    pub(super) fn tiles(&self) -> u64 {
        u64::from(self.width).div_ceil(TILE) * u64::from(self.height).div_ceil(TILE)
    }

    /// Entries of the tile lists to start with: discs of up to about 4 pixels meet no more than 4 tiles.
    pub(super) fn room(&self, points: u64) -> u64 {
        4 * points + self.tiles()
    }

    /// Device memory a renderer of `points` points allocates before lists have to grow [bytes]; `two_pass` when the
    /// device has no 64-bit atomics.
    pub fn bytes(&self, points: u64, two_pass: bool) -> u64 {
        let outputs = 4 * (1 + u64::from(self.background.is_some()) + u64::from(self.depth) + u64::from(self.ids));
        let path = match self.per_pixel {
            1 => 8 * self.pixels() + if two_pass { 16 * points } else { 0 },
            _ => 16 * points + 8 * self.tiles() + 4 * self.room(points),
        };
        outputs * self.pixels() + path
    }
}
