//! A scene's files stay inside its asset root.

use std::fs;
use std::path::{Path, PathBuf};

use physvideo_app::io::ReadError;
use physvideo_app::io::read::AssetRoot;

/// `outside.png`, `pack/[assets.toml]`, `pack/images/a.png`, `pack/scenes/scene.toml`, `pack/scenes/near.png`.
fn tree(marked: bool) -> (tempfile::TempDir, PathBuf, PathBuf) {
    let dir = tempfile::tempdir().unwrap();
    let top = fs::canonicalize(dir.path()).unwrap();
    for folder in ["pack/images", "pack/scenes"] {
        fs::create_dir_all(top.join(folder)).unwrap();
    }
    for file in ["outside.png", "pack/images/a.png", "pack/scenes/scene.toml", "pack/scenes/near.png"] {
        fs::write(top.join(file), "").unwrap();
    }
    if marked {
        fs::write(top.join("pack/assets.toml"), "").unwrap();
    }
    let scene = top.join("pack/scenes/scene.toml");
    (dir, top, scene)
}

#[test]
fn the_nearest_marked_folder_is_the_root() {
    let (_dir, top, scene) = tree(true);
    let root = AssetRoot::of_scene(&scene).unwrap();
    assert_eq!(root.folder(), top.join("pack"));
    assert_eq!(root.resolve(Path::new("near.png")).unwrap(), top.join("pack/scenes/near.png"));
    assert_eq!(root.resolve(Path::new("../images/a.png")).unwrap(), top.join("pack/images/a.png"));
    fs::write(top.join("pack/scenes/assets.toml"), "").unwrap();
    let root = AssetRoot::of_scene(&scene).unwrap();
    assert_eq!(root.folder(), top.join("pack/scenes"));
    assert!(matches!(root.resolve(Path::new("../images/a.png")), Err(ReadError::Outside { .. })));
}

#[test]
fn without_a_mark_the_scenes_folder_is_the_root() {
    let (_dir, top, scene) = tree(false);
    let root = AssetRoot::of_scene(&scene).unwrap();
    assert_eq!(root.folder(), top.join("pack/scenes"));
    assert!(root.resolve(Path::new("./near.png")).is_ok());
    assert!(matches!(root.resolve(Path::new("../images/a.png")), Err(ReadError::Outside { .. })));
}

#[test]
fn paths_that_leave_or_miss_are_refused() {
    let (_dir, top, scene) = tree(true);
    let root = AssetRoot::of_scene(&scene).unwrap();
    let refused = |path: &str| root.resolve(Path::new(path)).unwrap_err();
    assert!(matches!(refused("../../outside.png"), ReadError::Outside { .. }));
    // The same answer whether the file outside exists or not.
    assert!(matches!(refused("../../nothing.png"), ReadError::Outside { .. }));
    assert!(matches!(refused(top.join("pack/images/a.png").to_str().unwrap()), ReadError::Absolute { .. }));
    assert!(matches!(refused("../images/nothing.png"), ReadError::Missing { .. }));
    // A folder of which the root's name is only the beginning is another folder.
    fs::create_dir(top.join("pack2")).unwrap();
    fs::write(top.join("pack2/b.png"), "").unwrap();
    assert!(matches!(refused("../../pack2/b.png"), ReadError::Outside { .. }));
    let text = refused("../../outside.png").to_string();
    assert!(text.contains("outside the asset root") && text.contains("../../outside.png"), "{text}");
    assert!(matches!(AssetRoot::of_scene(&top.join("none.toml")), Err(ReadError::Missing { .. })));
}

#[cfg(unix)]
#[test]
fn links_count_as_what_they_point_to() {
    use std::os::unix::fs::symlink;
    let (_dir, top, scene) = tree(true);
    let root = AssetRoot::of_scene(&scene).unwrap();
    symlink(top.join("outside.png"), top.join("pack/scenes/link.png")).unwrap();
    symlink(&top, top.join("pack/scenes/up")).unwrap();
    symlink(top.join("pack/images/a.png"), top.join("pack/scenes/inner.png")).unwrap();
    symlink("nowhere", top.join("pack/scenes/broken.png")).unwrap();
    assert!(matches!(root.resolve(Path::new("link.png")), Err(ReadError::Outside { .. })));
    assert!(matches!(root.resolve(Path::new("up/outside.png")), Err(ReadError::Outside { .. })));
    assert_eq!(root.resolve(Path::new("inner.png")).unwrap(), top.join("pack/images/a.png"));
    assert!(matches!(root.resolve(Path::new("broken.png")), Err(ReadError::Missing { .. })));
    // A linked scene lies where its file is.
    symlink(&scene, top.join("linked.toml")).unwrap();
    assert_eq!(AssetRoot::of_scene(&top.join("linked.toml")).unwrap(), root);
}
