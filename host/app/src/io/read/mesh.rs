//! Triangle meshes from OBJ. Does not know whether a mesh is closed.

use std::path::Path;

use tobj::{LoadError, LoadOptions};

use super::{MAX_POINTS, ReadError, open};

/// Triangles over shared vertices, in the file's own units and axes; every index is below `vertices.len()`.
#[derive(Debug, Clone, PartialEq)]
pub struct TriMesh {
    pub vertices: Vec<[f32; 3]>,
    pub triangles: Vec<[u32; 3]>,
}

/// Reads all groups of an OBJ as one mesh. Polygons become fans; texture coordinates, normals, materials, lines and
/// points are ignored, so that vertices stay shared across seams. No triangles and values that are not finite are
/// refused.
pub fn read_mesh(path: &Path) -> Result<TriMesh, ReadError> {
    let (mut reader, length) = open(path)?;
    // Every vertex and triangle takes more than 4 bytes of text.
    if length > 4 * MAX_POINTS * 16 {
        let what = format!("has {length} bytes");
        return Err(ReadError::TooLarge { path: path.into(), what, limit: format!("{} bytes", 4 * MAX_POINTS * 16) });
    }
    let options = LoadOptions { triangulate: true, ignore_lines: true, ignore_points: true, ..LoadOptions::default() };
    // Materials are not needed: their file is not opened.
    let no_materials = |_: &Path| Err(LoadError::OpenFileFailed);
    let (models, _) = tobj::load_obj_buf(&mut reader, &options, no_materials).map_err(|e| failed(path, e))?;

    let mut mesh = TriMesh { vertices: Vec::new(), triangles: Vec::new() };
    for model in models {
        let base = mesh.vertices.len();
        mesh.vertices.extend(model.mesh.positions.chunks_exact(3).map(|v| [v[0], v[1], v[2]]));
        for t in model.mesh.indices.chunks_exact(3) {
            let mut triangle = [0; 3];
            for (to, &from) in triangle.iter_mut().zip(t) {
                let index = base + from as usize;
                if index >= mesh.vertices.len() || index > u32::MAX as usize {
                    return Err(ReadError::damaged(
                        path,
                        format!("a face of {:?} names a vertex that is not there", model.name),
                    ));
                }
                *to = index as u32;
            }
            mesh.triangles.push(triangle);
        }
    }
    if mesh.triangles.is_empty() {
        return Err(ReadError::content(path, "has no faces", "Give an OBJ with at least one triangle."));
    }
    if let Some(row) = mesh.vertices.iter().position(|p| p.iter().any(|v| !v.is_finite())) {
        let what = format!("vertex {row} (counted from 0) is {:?}", mesh.vertices[row]);
        return Err(ReadError::content(path, what, "Remove vertices that are not finite numbers."));
    }
    Ok(mesh)
}

fn failed(path: &Path, error: LoadError) -> ReadError {
    match error {
        LoadError::FaceVertexOutOfBounds => ReadError::damaged(path, "a face names a vertex that is not there"),
        LoadError::PositionParseError => ReadError::damaged(path, "a vertex line does not hold three numbers"),
        LoadError::ReadError => ReadError::format(path, "an OBJ text file"),
        e => ReadError::damaged(path, e),
    }
}
