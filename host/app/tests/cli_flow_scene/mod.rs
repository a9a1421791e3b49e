//! Scenes whose frames come from files, for tests of networks.
#![allow(dead_code)] // Each test file uses a part of it.

use crate::cli_scene::Folder;

/// The folder of a shipped model.
pub fn model(name: &str) -> String {
    format!("{}/../../assets/models/{name}", env!("CARGO_MANIFEST_DIR"))
}

/// Writes `NAME/frames` and `NAME/masks`: a bright square that moves over a gradient.
pub fn clip(folder: &Folder, name: &str, width: u32, height: u32, frames: u32) {
    for kind in ["frames", "masks"] {
        std::fs::create_dir_all(folder.path(&format!("{name}/{kind}"))).unwrap();
    }
    for frame in 0..frames {
        let left = frame % (width / 2);
        let inside = |x: u32, y: u32| (left..left + width / 4).contains(&x) && (height / 4..height / 2).contains(&y);
        let picture = image::RgbImage::from_fn(width, height, |x, y| {
            if inside(x, y) { image::Rgb([230, 60, 50]) } else { image::Rgb([(4 * x) as u8, (4 * y) as u8, 90]) }
        });
        let mask = image::GrayImage::from_fn(width, height, |x, y| image::Luma([255 * u8::from(inside(x, y))]));
        picture.save(folder.path(&format!("{name}/frames/{frame:04}.png"))).unwrap();
        mask.save(folder.path(&format!("{name}/masks/{frame:04}.png"))).unwrap();
    }
}

/// Writes `scene.toml` with a flow over frames from files.
pub fn scene(folder: &Folder, keys: &str, input: &str, frames: u32) {
    let text = format!("[flow]\nmodel = 'elsewhere'\n{keys}\n\n[flow.input]\n{input}\n\n[output]\nframes = {frames}\n");
    folder.write("scene.toml", text);
}
