//! The files a scene names, and whether their paths stay inside the asset root. Looks at text only, never at a disk.

use std::path::Path;

use super::errors::{Kind, Problem, SceneErrors};
use super::{Depth, Object, Scene, Source};

impl Object {
    /// Whether the shape given is the one sagged under gravity: as the scene says, else true for a body from a
    /// photograph. Always false without a material, since such an object stands still.
    pub fn prestressed(&self) -> bool {
        self.material.is_some() && self.prestress.unwrap_or(matches!(self.source, Source::Mask { .. }))
    }
}

impl Scene {
    /// Every file the scene needs, as (key path, path as written, relative to the scene's folder).
    pub fn paths(&self) -> Vec<(String, &Path)> {
        let mut paths: Vec<(String, &Path)> = Vec::new();
        if let Some(photo) = &self.photo {
            paths.push(("photo.image".to_owned(), &photo.image));
            paths.push(("photo.labels".to_owned(), &photo.labels));
            match &photo.depth {
                Depth::Metric { file, .. } => paths.push(("photo.depth.metric.file".to_owned(), file)),
                Depth::Disparity { file, .. } => paths.push(("photo.depth.disparity.file".to_owned(), file)),
            }
        }
        for (index, object) in self.objects.iter().enumerate() {
            match &object.source {
                Source::Mesh { file, .. } => paths.push((format!("object[{index}].source.mesh.file"), file.as_path())),
                Source::Points { file, .. } => {
                    paths.push((format!("object[{index}].source.points.file"), file.as_path()))
                }
                Source::Mask { .. } | Source::Box { .. } | Source::Ball { .. } => {}
            }
        }
        if let Some(flow) = &self.flow {
            paths.push(("flow.model".to_owned(), &flow.model));
            let named = [("embeddings", &flow.embeddings), ("negative_embeddings", &flow.negative_embeddings)];
            paths.extend(named.into_iter().filter_map(|(k, p)| Some((format!("flow.{k}"), p.as_deref()?))));
            if let Some(input) = &flow.input {
                paths.push(("flow.input.frames".to_owned(), &input.frames));
                let named = [("masks", &input.masks), ("image", &input.image), ("background", &input.background)];
                paths.extend(named.into_iter().filter_map(|(k, p)| Some((format!("flow.input.{k}"), p.as_deref()?))));
            }
        }
        paths
    }
}

/// Why a path is refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum OutsideRoot {
    /// Starts at the root of a file system or drive.
    #[error("absolute paths are refused")]
    Absolute,
    /// `..` leads above the asset root.
    #[error("the path leaves the asset root")]
    Escapes,
    /// A character that is no part of a name on every system.
    #[error("the path holds a backslash, a colon or a control character")]
    Character,
}

/// Checks a path as written in a scene that lies `depth` folders below its asset root (0: in the root itself).
///
/// # Errors
/// Absolute paths, paths that climb above the root at any point, and names that are not portable. Links on the disk
/// are the caller's to check.
pub fn inside_root(depth: usize, path: &Path) -> Result<(), OutsideRoot> {
    let text = path.to_string_lossy();
    let drive = text.chars().nth(1) == Some(':');
    if text.starts_with('/') || text.starts_with('\\') || drive || path.is_absolute() {
        return Err(OutsideRoot::Absolute);
    }
    if text.chars().any(|c| matches!(c, '\\' | ':') || c.is_control()) {
        return Err(OutsideRoot::Character);
    }
    let mut depth = depth;
    for step in text.split('/') {
        match step {
            "" | "." => {}
            ".." => depth = depth.checked_sub(1).ok_or(OutsideRoot::Escapes)?,
            _ => depth = depth.saturating_add(1),
        }
    }
    Ok(())
}

/// Checks every path of a parsed scene; `text` and `file_name` are those it was parsed from, `depth` as in
/// [`inside_root`].
///
/// # Errors
/// Every refused path, at its place in the text.
pub fn check_paths(scene: &Scene, text: &str, file_name: &str, depth: usize) -> Result<(), SceneErrors> {
    let problems: Vec<Problem> = scene
        .paths()
        .into_iter()
        .filter_map(|(key, path)| {
            let why = inside_root(depth, path).err()?;
            let help = "give a path relative to the scene's folder, with `/`, inside the folder of assets.toml";
            Some(Problem::new(Kind::Path, key, format!("{why}: {}", path.display())).help(help))
        })
        .collect();
    if problems.is_empty() { Ok(()) } else { Err(SceneErrors::locate(text, file_name, problems)) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::parse;

    #[test]
    fn paths_stay_inside_the_root() {
        let check = |depth, path: &str| inside_root(depth, Path::new(path));
        assert_eq!(check(0, "a/b.png"), Ok(()));
        assert_eq!(check(0, "./a/../b.png"), Ok(()));
        assert_eq!(check(1, "../images/a.png"), Ok(()));
        assert_eq!(check(2, "../../a.png"), Ok(()));
        assert_eq!(check(0, "../a.png"), Err(OutsideRoot::Escapes));
        assert_eq!(check(1, "../../a.png"), Err(OutsideRoot::Escapes));
        // Back inside by name is still a look outside.
        assert_eq!(check(1, "../../top/a.png"), Err(OutsideRoot::Escapes));
        assert_eq!(check(0, "a/../../b"), Err(OutsideRoot::Escapes));
        assert_eq!(check(9, "/etc/passwd"), Err(OutsideRoot::Absolute));
        assert_eq!(check(9, "C:/a"), Err(OutsideRoot::Absolute));
        assert_eq!(check(9, "\\\\host\\a"), Err(OutsideRoot::Absolute));
        assert_eq!(check(0, "a\\..\\..\\b"), Err(OutsideRoot::Character));
        assert_eq!(check(0, "a\0b"), Err(OutsideRoot::Character));
    }

    #[test]
    fn only_what_moves_and_comes_from_a_photo_is_prestressed() {
        let prestressed = |source: &str, rest: &str| {
            let photo = "[photo]\nimage = 'a'\nlabels = 'b'\nfocal_px = 1\ndepth.metric.file = 'c'\n";
            let text = format!("{photo}[[object]]\nname = 'o'\nsource.{source}\n{rest}");
            parse(&text, "o.toml").unwrap().objects[0].prestressed()
        };
        let (mask, ball) = ("mask.label = 1", "ball = { center = [0, 0, 0], radius = 1 }");
        assert!(prestressed(mask, "material.elastic = {}"));
        assert!(!prestressed(mask, ""));
        assert!(!prestressed(mask, "material.elastic = {}\nprestress = false"));
        assert!(!prestressed(ball, "material.elastic = {}"));
        assert!(prestressed(ball, "material.elastic = {}\nprestress = true"));
    }
}
