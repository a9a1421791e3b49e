//! A driving video from files (`[flow.input]`), each problem told at its key. Does not know what becomes of it.

use std::path::{Path, PathBuf};

use physvideo::scene::{FlowInput, Kind, Problem};

use super::pixels::Pixels;
use crate::error::AppError;
use crate::io::ReadError;
use crate::io::read::{ColorImage, read_color_image};
use crate::load::Loaded;

/// Most frames of a driving video.
const MOST_FRAMES: usize = 100_000;

/// A driving video at its own size.
pub struct Source {
    /// Frames.
    pub frames: Vec<Pixels>,
    /// 1 where a frame guides, a byte a pixel.
    pub masks: Vec<Vec<u8>>,
    /// The image to be consistent with.
    pub image: Pixels,
    /// What is behind the moving things.
    pub background: Pixels,
}

impl Source {
    /// Reads all of it; `most` frames at most.
    ///
    /// # Errors
    /// Every file that cannot be used or does not fit the others, at its key in the scene.
    pub fn read(loaded: &Loaded, input: &FlowInput, most: usize) -> Result<Self, AppError> {
        let mut problems = Vec::new();
        let mut report =
            |key: &str, text: String| problems.push(Problem::new(Kind::Path, format!("flow.input.{key}"), text));
        let frames = folder(loaded, &input.frames).and_then(|files| pictures(&files, most));
        let frames = frames.unwrap_or_else(|e| {
            report("frames", e);
            Vec::new()
        });
        let size = frames.first().map_or((0, 0), |f| f.size);
        let mut masks = vec![vec![1; size.0 as usize * size.1 as usize]; frames.len()];
        if let Some(path) = &input.masks {
            match folder(loaded, path).and_then(|files| pictures(&files, most)) {
                Ok(read) if read.len() != frames.len() => {
                    report("masks", format!("{} masks for {} frames: give one for each", read.len(), frames.len()));
                }
                Ok(read) if read.iter().any(|m| m.size != size) => {
                    report("masks", format!("the frames are {} × {} pixels, a mask is not", size.0, size.1));
                }
                // White is where the frames guide.
                Ok(read) => masks = read.iter().map(|m| m.rgb.chunks_exact(3).map(|c| c[0] >> 7).collect()).collect(),
                Err(e) => report("masks", e),
            }
        }
        let mut one = |key: &str, path: &Option<PathBuf>| match path {
            None => None,
            Some(path) => match loaded.resolve(path).and_then(|p| read_color_image(&p)) {
                Ok(image) if (image.width, image.height) != size && !frames.is_empty() => {
                    let (w, h) = (image.width, image.height);
                    report(key, format!("it is {w} × {h} pixels, the frames are {} × {}", size.0, size.1));
                    None
                }
                Ok(image) => Some(pixels(image)),
                Err(e) => {
                    report(key, e.to_string());
                    None
                }
            },
        };
        let (image, background) = (one("image", &input.image), one("background", &input.background));
        match frames.first() {
            Some(first) if problems.is_empty() => {
                let image = image.unwrap_or_else(|| first.clone());
                let background = background.unwrap_or_else(|| image.clone());
                Ok(Self { masks, image, background, frames })
            }
            _ => Err(loaded.locate(problems)),
        }
    }
}

/// The PNG files of a folder, by name.
fn folder(loaded: &Loaded, path: &Path) -> Result<Vec<PathBuf>, String> {
    let folder = loaded.resolve(path).map_err(|e| e.to_string())?;
    let entries = std::fs::read_dir(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    let mut files: Vec<PathBuf> = entries
        .filter_map(|entry| entry.ok().map(|e| e.path()))
        .filter(|p| p.extension().is_some_and(|e| e.eq_ignore_ascii_case("png")))
        .collect();
    files.sort();
    match files.len() {
        0 => Err(format!("{} holds no PNG file", folder.display())),
        n if n > MOST_FRAMES => {
            Err(format!("{} holds {n} PNG files, at most {MOST_FRAMES} are read", folder.display()))
        }
        _ => Ok(files),
    }
}

fn pictures(files: &[PathBuf], most: usize) -> Result<Vec<Pixels>, String> {
    let mut all: Vec<Pixels> = Vec::new();
    for file in files.iter().take(most) {
        let read = read_color_image(file).map(pixels).map_err(|e: ReadError| e.to_string())?;
        if let Some(first) = all.first().filter(|f| f.size != read.size) {
            let ((w, h), (x, y)) = (read.size, first.size);
            return Err(format!("{} is {w} × {h} pixels, the first is {x} × {y}", file.display()));
        }
        all.push(read);
    }
    Ok(all)
}

fn pixels(image: ColorImage) -> Pixels {
    Pixels { size: (image.width, image.height), rgb: image.rgb }
}
