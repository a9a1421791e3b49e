//! A scene file and the files it names, decoded; what is wrong with any of them is said at its key in the scene. Does
//! not know what is made of them.

use std::path::{Path, PathBuf};

use physvideo::assemble::Inputs;
use physvideo::geometry::PhotoData;
use physvideo::plan::Plan;
use physvideo::scene::{Depth, Kind, Photo, Problem, Scene, SceneErrors, Source, check_paths, parse};
use sha2::{Digest, Sha256};

use crate::cli::Overrides;
use crate::error::AppError;
use crate::io::ReadError;
use crate::io::read::{AssetRoot, read_color_image, read_label_image, read_mesh, read_points, read_scalar_map};

/// A parsed scene and where its files are.
#[derive(Debug)]
pub struct Loaded {
    /// The scene, with what the command line says in its place.
    pub scene: Scene,
    text: String,
    file_name: String,
    root: AssetRoot,
}

impl Loaded {
    /// Reads and checks a scene file, and the paths in it.
    ///
    /// # Errors
    /// Every problem of the scene, or why the file cannot be read.
    pub fn open(path: &Path, overrides: &Overrides) -> Result<Self, AppError> {
        let root = AssetRoot::of_scene(path)?;
        let text = read_text(path)?;
        let file_name = path.display().to_string();
        let mut scene = parse(&text, &file_name)?;
        check_paths(&scene, &text, &file_name, depth_below(&root, path))?;
        scene.seed = overrides.seed.unwrap_or(scene.seed);
        scene.output.frames = overrides.frames.unwrap_or(scene.output.frames);
        scene.simulation.error_budget = overrides.error_budget.or(scene.simulation.error_budget);
        scene.output.until = overrides.output.map_or(scene.output.until, Into::into);
        Ok(Self { scene, text, file_name, root })
    }

    /// The plan for what the scene asks for.
    pub fn plan(&self) -> Plan {
        Plan::new(&self.scene, self.scene.output.until)
    }

    /// The SHA-256 of the scene file as 64 hexadecimal digits.
    pub fn sha256(&self) -> String {
        Sha256::digest(self.text.as_bytes()).iter().map(|byte| format!("{byte:02x}")).collect()
    }

    /// The real path of a file or folder that the scene names.
    ///
    /// # Errors
    /// As [`AssetRoot::resolve`].
    pub fn resolve(&self, path: &Path) -> Result<PathBuf, ReadError> {
        self.root.resolve(path)
    }

    /// The same, told at the key that names it.
    ///
    /// # Errors
    /// The problem at its place.
    pub fn resolve_at(&self, key: &str, path: &Path) -> Result<PathBuf, AppError> {
        self.resolve(path).map_err(|e| self.locate(vec![Problem::new(Kind::Path, key, e.to_string())]))
    }

    /// Problems found later, at their places in the scene file.
    pub fn locate(&self, problems: Vec<Problem>) -> AppError {
        AppError::Scene(SceneErrors::locate(&self.text, &self.file_name, problems))
    }

    /// Decodes the files that the plan needs, and no others.
    ///
    /// # Errors
    /// Every file that cannot be used, and images that do not fit together.
    pub fn inputs(&self, plan: &Plan) -> Result<Inputs, AppError> {
        let mut reading = Reading { root: &self.root, problems: Vec::new() };
        let mut inputs = Inputs::default();
        if plan.runs("photo")
            && let Some(photo) = &self.scene.photo
        {
            inputs.photo = reading.photo(photo, &self.scene);
        }
        for (index, object) in self.scene.objects.iter().enumerate() {
            let needed = plan.runs(if object.material.is_some() { "bodies" } else { "display" });
            match &object.source {
                Source::Mesh { file, .. } if needed => {
                    if let Some(mesh) = reading.file(&format!("object[{index}].source.mesh.file"), file, read_mesh) {
                        inputs.meshes.insert(index, (mesh.vertices, mesh.triangles));
                    }
                }
                Source::Points { file, .. } if needed => {
                    let key = format!("object[{index}].source.points.file");
                    if let Some(points) = reading.file(&key, file, read_points) {
                        inputs.points.insert(index, (points.positions, points.colors));
                    }
                }
                _ => {}
            }
        }
        if reading.problems.is_empty() { Ok(inputs) } else { Err(self.locate(reading.problems)) }
    }
}

fn read_text(path: &Path) -> Result<String, ReadError> {
    let failed = |source: std::io::Error| ReadError::Io { path: path.into(), source };
    let meta = std::fs::metadata(path).map_err(failed)?;
    if meta.is_dir() {
        return Err(ReadError::Folder { path: path.into() });
    }
    if !meta.is_file() {
        return Err(ReadError::Format { path: path.into(), expected: "a regular file" });
    }
    std::fs::read_to_string(path).map_err(|e| match e.kind() {
        std::io::ErrorKind::InvalidData => ReadError::Format { path: path.into(), expected: "UTF-8 text" },
        _ => failed(e),
    })
}

/// Folders between the asset root and the scene file.
fn depth_below(root: &AssetRoot, scene: &Path) -> usize {
    let real = std::fs::canonicalize(scene).unwrap_or_else(|_| scene.to_path_buf());
    let folder = real.parent().map(Path::to_path_buf).unwrap_or_default();
    folder.strip_prefix(root.folder()).map_or(0, |below| below.components().count())
}

/// Collects what is wrong, so that all of it is told at once.
struct Reading<'a> {
    root: &'a AssetRoot,
    problems: Vec<Problem>,
}

impl Reading<'_> {
    fn file<T>(&mut self, key: &str, path: &Path, read: impl Fn(&Path) -> Result<T, ReadError>) -> Option<T> {
        match self.root.resolve(path).and_then(|real: PathBuf| read(&real)) {
            Ok(value) => Some(value),
            Err(error) => {
                self.problems.push(Problem::new(Kind::Path, key, error.to_string()));
                None
            }
        }
    }

    fn photo(&mut self, photo: &Photo, scene: &Scene) -> Option<PhotoData> {
        let (depth_key, depth_file) = match &photo.depth {
            Depth::Metric { file, .. } => ("photo.depth.metric.file", file),
            Depth::Disparity { file, .. } => ("photo.depth.disparity.file", file),
        };
        let image = self.file("photo.image", &photo.image, read_color_image);
        let labels = self.file("photo.labels", &photo.labels, read_label_image);
        let map = self.file(depth_key, depth_file, read_scalar_map);
        let (image, labels, map) = (image?, labels?, map?);
        for (key, what, width, height) in [
            ("photo.labels", "the label image", labels.width, labels.height),
            (depth_key, "the depth map", map.width, map.height),
        ] {
            if (width, height) != (image.width, image.height) {
                let message = format!(
                    "{what} is {width} × {height} pixels, the photograph is {} × {}",
                    image.width, image.height
                );
                let help = "all images of a photograph have one size; scale this one";
                self.problems.push(Problem::new(Kind::Path, key, message).help(help));
            }
        }
        if !self.problems.is_empty() {
            return None;
        }
        let data = PhotoData {
            width: image.width,
            height: image.height,
            rgb: image.rgb.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect(),
            labels: labels.labels,
            depth: map.data.iter().map(|value| metres(&photo.depth, photo.focal_px, *value)).collect(),
            focal_px: photo.focal_px,
            principal: photo.principal_px.unwrap_or([0.5 * image.width as f32, 0.5 * image.height as f32]),
        };
        self.masks(scene, &data);
        Some(data)
    }

    /// Every object seen in the photograph has pixels, and depth in some of them.
    fn masks(&mut self, scene: &Scene, photo: &PhotoData) {
        let mut pixels = [0_u64; 256];
        let mut known = [0_u64; 256];
        for (label, depth) in photo.labels.iter().zip(&photo.depth) {
            pixels[usize::from(*label)] += 1;
            known[usize::from(*label)] += u64::from(*depth > 0.0);
        }
        for (index, object) in scene.objects.iter().enumerate() {
            let Source::Mask { label, .. } = object.source else { continue };
            let (message, help) = match (pixels[usize::from(label)], known[usize::from(label)]) {
                (0, _) => {
                    let there: Vec<String> = (1..256).filter(|l| pixels[*l] > 0).map(|l| l.to_string()).collect();
                    let help = match there.join(", ") {
                        none if none.is_empty() => "the label image is all background".to_owned(),
                        labels => format!("the labels in the image are {labels}"),
                    };
                    (format!("no pixel of the label image is {label}"), help)
                }
                (n, 0) => (
                    format!("the depth of all {n} pixels of label {label} is unknown"),
                    "give a depth map that covers the object".to_owned(),
                ),
                _ => continue,
            };
            let key = format!("object[{index}].source.mask.label");
            self.problems.push(Problem::new(Kind::Path, key, message).help(help));
        }
    }
}

/// Depth along the view axis [m] of a stored value; 0 is unknown.
fn metres(depth: &Depth, focal_px: f32, value: f32) -> f32 {
    if value <= 0.0 {
        return 0.0;
    }
    let z = match depth {
        Depth::Metric { scale, .. } => value * scale,
        Depth::Disparity { baseline, offset_px, scale, .. } => focal_px * baseline / (value * scale + offset_px),
    };
    if z.is_finite() && z > 0.0 { z } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stored_values_become_metres() {
        let metric = Depth::Metric { file: PathBuf::new(), scale: 1e-3 };
        // 1e-3 is not a float: the product is a rounding off.
        assert!((metres(&metric, 500.0, 1500.0) - 1.5).abs() < 1e-6);
        assert_eq!(metres(&metric, 500.0, 0.0), 0.0);
        // Middlebury: Z = f · B / (d + doffs).
        let stereo = Depth::Disparity { file: PathBuf::new(), baseline: 0.16, offset_px: 270.0, scale: 0.5 };
        assert!((metres(&stereo, 3740.0, 60.0) - 3740.0 * 0.16 / 300.0).abs() < 1e-6);
        assert_eq!(metres(&stereo, 3740.0, 0.0), 0.0);
    }

    #[test]
    fn a_disparity_behind_infinity_is_unknown() {
        let stereo = Depth::Disparity { file: PathBuf::new(), baseline: 0.16, offset_px: -10.0, scale: 1.0 };
        assert_eq!(metres(&stereo, 500.0, 10.0), 0.0);
        assert_eq!(metres(&stereo, 500.0, 4.0), 0.0);
        assert!(metres(&stereo, 500.0, 11.0) > 0.0);
    }
}
