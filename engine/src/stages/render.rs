//! Draws display points as discs with the semantics of PyTorch3D's point renderer. Knows nothing of what moves them.

mod settings;

use physvideo_gpu::kernels::{Bins, Room, Screen, points};
use physvideo_gpu::{Buf, Constants, Feature, Gpu, Kernel, Recording};

use crate::scene::Compositing;

pub use settings::{Background, Display, Image, MOST_PER_PIXEL, RenderError, RenderSettings};

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
    /// Subgroups of at least 8 lanes.
    subgroups: bool,
}

/// The buffers of the way points take to pixels.
#[derive(Debug)]
enum Path {
    /// One 64-bit word a pixel, written with 64-bit atomics.
    Nearest { keys: Buf<u64> },
    /// The same words, written in two passes with 32-bit atomics.
    NearestTwoPass { splats: Buf<[f32; 4]>, keys: Buf<u64> },
    /// Lists of points for each tile.
    Blended(Lists),
}

/// The points that may reach each tile of 8 × 8 pixels.
#[derive(Clone, Copy, Debug)]
struct Lists {
    splats: Buf<[f32; 4]>,
    counts: Buf<u32>,
    starts: Buf<u32>,
    list: Buf<u32>,
    bins: Buf<Bins>,
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
            Path::Blended(Lists {
                splats: projected()?,
                counts: gpu.alloc("run", "tile counts", settings.tiles())?,
                starts: gpu.alloc("run", "tile starts", settings.tiles())?,
                list: gpu.alloc("run", "tile lists", settings.room(display.count))?,
                bins: gpu.alloc("run", "tile totals", 1)?,
            })
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
            subgroups: gpu.can_run(<points::Blend as Kernel>::INFO) && gpu.info.subgroup_size >= 8,
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
            Path::Blended(lists) => {
                self.project(rec, lists.splats);
                self.blend(rec, *lists);
            }
        }
        self.compose(rec);
    }

    /// Entries of the tile lists that found no room in the image drawn last: 0 means that it is complete.
    ///
    /// # Errors
    /// [`RenderError::TooDense`], or the device's refusal.
    pub fn missing(&self, gpu: &Gpu) -> Result<u64, RenderError> {
        let Path::Blended(Lists { list, bins, .. }) = &self.path else { return Ok(0) };
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
        let Path::Blended(Lists { list, .. }) = &mut self.path else { return Ok(()) };
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

    fn each_point<K: Kernel>(&self, rec: &mut Recording, call: &K) {
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

    fn blend(&self, rec: &mut Recording, lists: Lists) {
        let Lists { splats, counts, starts, list, bins } = lists;
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
        let Display { colors, objects, .. } = self.display;
        let (ends, image, depths, ids) = (starts, self.layer, self.depth, self.ids);
        let lanes = self.settings.tiles() * u64::from(<points::Blend as Kernel>::INFO.workgroup[0]);
        if self.subgroups {
            let call = points::Blend { splats, counts, ends, list, colors, objects, image, depths, ids, immediates };
            rec.each(&call, &self.constants, lanes);
        } else {
            let call =
                points::BlendShared { splats, counts, ends, list, colors, objects, image, depths, ids, immediates };
            rec.each(&call, &self.constants, lanes);
        }
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
