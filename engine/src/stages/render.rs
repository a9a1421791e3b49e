//! Draws display points as discs with the semantics of PyTorch3D's point renderer. Knows nothing of what moves them.

use physvideo_gpu::kernels::{Bins, Camera, Room, Screen, points};
use physvideo_gpu::{Buf, Constants, Feature, Gpu, GpuError, Recording};

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

/// Draws one set of points into one size of image, as often as wanted.
#[derive(Debug)]
pub struct PointRenderer {
    settings: RenderSettings,
    display: Display,
    constants: Constants,
    layer: Buf<u32>,
    composed: Option<Buf<u32>>,
    depth: Buf<f32>,
    ids: Buf<u32>,
    path: Path,
}

/// The buffers of the way points take to pixels.
#[derive(Debug)]
enum Path {
    /// One 64-bit word a pixel, written with 64-bit atomics.
    Nearest { keys: Buf<u64> },
    /// The same words, written in two passes with 32-bit atomics.
    NearestTwoPass { splats: Buf<[f32; 4]>, keys: Buf<u64> },
    /// Lists of points for each tile.
    Blended { splats: Buf<[f32; 4]>, counts: Buf<u32>, starts: Buf<u32>, list: Buf<u32>, bins: Buf<Bins> },
}

impl RenderSettings {
    fn check(&self, display: &Display) -> Result<(), RenderError> {
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

    fn pixels(&self) -> u64 {
        u64::from(self.width) * u64::from(self.height)
    }

    fn tiles(&self) -> u64 {
        u64::from(self.width).div_ceil(TILE) * u64::from(self.height).div_ceil(TILE)
    }

    /// Entries of the tile lists to start with: discs of up to about 4 pixels meet no more than 4 tiles.
    fn room(&self, points: u64) -> u64 {
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

impl PointRenderer {
    /// Allocates what drawing needs, in the arena `run`; outputs that are not asked for take no memory.
    ///
    /// # Errors
    /// [`RenderError::Settings`] before anything is allocated, or the device's refusal.
    pub fn new(gpu: &Gpu, settings: RenderSettings, display: Display) -> Result<Self, RenderError> {
        settings.check(&display)?;
        let pixels = settings.pixels();
        let optional = |wanted: bool| if wanted { pixels } else { 1 };
        let projected = || gpu.alloc("run", "points projected", display.count);
        let path = if settings.per_pixel > 1 {
            Path::Blended {
                splats: projected()?,
                counts: gpu.alloc("run", "tile counts", settings.tiles())?,
                starts: gpu.alloc("run", "tile starts", settings.tiles())?,
                list: gpu.alloc("run", "tile lists", settings.room(display.count))?,
                bins: gpu.alloc("run", "tile totals", 1)?,
            }
        } else if gpu.has(Feature::Int64Atomic) && gpu.has(Feature::Int64) {
            Path::Nearest { keys: gpu.alloc("run", "nearest points", pixels)? }
        } else {
            Path::NearestTwoPass { splats: projected()?, keys: gpu.alloc("run", "nearest points", pixels)? }
        };
        let composed = match settings.background {
            Some(_) => Some(gpu.alloc("run", "frame", pixels)?),
            None => None,
        };
        let alpha = f64::from(u8::from(settings.compositing == Compositing::Alpha));
        let mut constants = Constants::none()
            .with("ALPHA", alpha)
            .with("RADIUS_IN_PIXELS", f64::from(u8::from(settings.radius_in_pixels)))
            .with("WANT_DEPTH", f64::from(u8::from(settings.depth)))
            .with("WANT_IDS", f64::from(u8::from(settings.ids)))
            .with("K", f64::from(settings.per_pixel));
        if let Some(depth) = settings.blend_depth {
            // Weights inside a disc are at least 6e-8, so this bound only guards the division.
            constants = constants.with("BLEND_DEPTH", f64::from(depth)).with("LEAST_WEIGHT", 1e-12);
        }
        Ok(Self {
            layer: gpu.alloc("run", "point layer", pixels)?,
            composed,
            depth: gpu.alloc("run", "depth", optional(settings.depth))?,
            ids: gpu.alloc("run", "object ids", optional(settings.ids))?,
            settings,
            display,
            constants,
            path,
        })
    }

    /// The image it makes on the device, RGBA8: over the background if there is one, else with alpha 0 where nothing is.
    pub fn image(&self) -> Buf<u32> {
        self.composed.unwrap_or(self.layer)
    }

    /// The points alone on the device, RGBA8; alpha is 255 where a point is and else 0: the mask.
    pub fn layer(&self) -> Buf<u32> {
        self.layer
    }

    /// Records drawing one image of what the points and the camera are when it is submitted.
    pub fn record(&self, rec: &mut Recording) {
        rec.section("render");
        match &self.path {
            Path::Nearest { keys } => {
                rec.fill(*keys, u32::MAX);
                let Display { points, camera, .. } = self.display;
                self.each_point(rec, &points::Nearest64 { points, camera, keys: *keys, immediates: self.screen() });
                self.resolve(rec, *keys);
            }
            Path::NearestTwoPass { splats, keys } => {
                rec.fill(*keys, u32::MAX);
                self.project(rec, *splats);
                let pass = points::Nearest32 { splats: *splats, keys: keys.cast(), immediates: self.screen() };
                rec.each(&pass, &self.constants.clone().with("NUMBERS", 0.0), self.display.count);
                rec.each(&pass, &self.constants.clone().with("NUMBERS", 1.0), self.display.count);
                self.resolve(rec, *keys);
            }
            Path::Blended { splats, counts, starts, list, bins } => {
                self.project(rec, *splats);
                self.blend(rec, *splats, *counts, *starts, *list, *bins);
            }
        }
        self.compose(rec);
    }

    /// Entries of the tile lists that found no room in the image drawn last: 0 means that it is complete.
    ///
    /// # Errors
    /// [`RenderError::TooDense`], or the device's refusal.
    pub fn missing(&self, gpu: &Gpu) -> Result<u64, RenderError> {
        let Path::Blended { list, bins, .. } = &self.path else { return Ok(0) };
        let found = gpu.read(*bins)?;
        let Some(Bins { total, wrapped, .. }) = found.first() else { return Ok(0) };
        if *wrapped != 0 {
            return Err(RenderError::TooDense { points: self.display.count, room: u64::from(u32::MAX) });
        }
        Ok(u64::from(*total).saturating_sub(list.len()))
    }

    /// Makes room for what [`Self::missing`] reported, and half as much again; recordings made before are stale.
    ///
    /// # Errors
    /// [`RenderError::TooDense`] when the device has no buffer of that size.
    pub fn grow(&mut self, gpu: &Gpu) -> Result<(), RenderError> {
        let missing = self.missing(gpu)?;
        if missing == 0 {
            return Ok(());
        }
        let Path::Blended { list, .. } = &mut self.path else { return Ok(()) };
        let most = (gpu.info.max_buffer.min(gpu.info.memory) / 4).min(u64::from(u32::MAX));
        let need = list.len() + missing;
        if need > most {
            return Err(RenderError::TooDense { points: self.display.count, room: most });
        }
        *list = gpu.alloc("run", "tile lists", (need + need / 2).min(most))?;
        Ok(())
    }

    /// Draws one image now, making room as needed, and reads it.
    ///
    /// # Errors
    /// As [`Self::missing`] and [`Self::grow`].
    pub fn draw(&mut self, gpu: &Gpu) -> Result<Image, RenderError> {
        loop {
            let mut rec = Recording::new("render");
            self.record(&mut rec);
            gpu.run(&rec)?;
            if self.missing(gpu)? == 0 {
                return self.read(gpu);
            }
            self.grow(gpu)?;
        }
    }

    /// Reads the image drawn last.
    ///
    /// # Errors
    /// The device's refusal.
    pub fn read(&self, gpu: &Gpu) -> Result<Image, RenderError> {
        let pixels = gpu.read(self.image())?;
        Ok(Image {
            width: self.settings.width,
            height: self.settings.height,
            rgb: pixels.iter().flat_map(|p| p.to_le_bytes().into_iter().take(3)).collect(),
            depth: if self.settings.depth { Some(gpu.read(self.depth)?) } else { None },
            ids: if self.settings.ids { Some(gpu.read(self.ids)?) } else { None },
        })
    }

    fn screen(&self) -> Screen {
        // `check` bounds the count.
        let points = u32::try_from(self.display.count).unwrap_or(u32::MAX);
        Screen { width: self.settings.width, height: self.settings.height, points }
    }

    fn each_point<K: physvideo_gpu::Kernel>(&self, rec: &mut Recording, call: &K) {
        rec.each(call, &self.constants, self.display.count);
    }

    fn project(&self, rec: &mut Recording, splats: Buf<[f32; 4]>) {
        let Display { points, camera, .. } = self.display;
        self.each_point(rec, &points::Project { points, camera, splats, immediates: self.screen() });
    }

    fn resolve(&self, rec: &mut Recording, keys: Buf<u64>) {
        let Display { points, colors, objects, camera, .. } = self.display;
        let call = points::Resolve {
            keys: keys.cast(),
            points,
            camera,
            colors,
            objects,
            image: self.layer,
            depths: self.depth,
            ids: self.ids,
            immediates: self.screen(),
        };
        rec.each(&call, &self.constants, self.settings.pixels());
    }

    fn blend(
        &self,
        rec: &mut Recording,
        splats: Buf<[f32; 4]>,
        counts: Buf<u32>,
        starts: Buf<u32>,
        list: Buf<u32>,
        bins: Buf<Bins>,
    ) {
        let screen = self.screen();
        let immediates = Room {
            width: screen.width,
            height: screen.height,
            points: screen.points,
            room: u32::try_from(list.len()).unwrap_or(u32::MAX),
        };
        rec.fill(counts, 0);
        rec.fill(bins, 0);
        self.each_point(rec, &points::BinCount { splats, counts, immediates: screen });
        rec.each(
            &points::BinRange { counts, starts, bins, immediates: screen },
            &self.constants,
            self.settings.tiles(),
        );
        self.each_point(rec, &points::BinPlace { splats, starts, list, immediates });
        let call = points::Blend {
            splats,
            counts,
            ends: starts,
            list,
            colors: self.display.colors,
            objects: self.display.objects,
            image: self.layer,
            depths: self.depth,
            ids: self.ids,
            immediates,
        };
        let lanes = u64::from(<points::Blend as physvideo_gpu::Kernel>::INFO.workgroup[0]);
        rec.each(&call, &self.constants, self.settings.tiles() * lanes);
    }

    fn compose(&self, rec: &mut Recording) {
        let (Some(image), Some(background)) = (self.composed, self.settings.background) else { return };
        let (picture, [r, g, b]) = match background {
            Background::Picture(picture) => (Some(picture), [0; 3]),
            Background::Color(color) => (None, color),
        };
        let call = points::Compose {
            layer: self.layer,
            background: picture.unwrap_or(self.layer),
            image,
            immediates: physvideo_gpu::kernels::Background {
                pixels: u32::try_from(self.settings.pixels()).unwrap_or(u32::MAX),
                color: u32::from_le_bytes([r, g, b, 255]),
            },
        };
        let constants = Constants::none().with("PICTURE", f64::from(u8::from(picture.is_some())));
        rec.each(&call, &constants, self.settings.pixels());
    }
}
