//! What can be wrong with geometry, in words a user can act on. Must not know where the data came from: the
//! caller adds the file.

/// Geometry that cannot be used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum GeometryError {
    /// An array of the photograph does not have width × height entries.
    #[error(
        "{what} has {got} pixels but the photograph is {width}×{height}; all images of a photo must be the same size"
    )]
    SizeMismatch { what: &'static str, width: u32, height: u32, got: usize },
    /// A number that must be positive and finite is not.
    #[error("{what} is {value}; it must be a positive finite number")]
    NotPositive { what: &'static str, value: f64 },
    /// No pixel carries the label.
    #[error("label {label} has no pixels in the label image; check the object's `label` (0 is background)")]
    EmptyMask { label: u8 },
    /// No pixel of the label has a depth.
    #[error("none of the {pixels} pixels of label {label} has a known depth; give a depth map that covers the object")]
    DepthUnknown { label: u8, pixels: usize },
    /// No lattice point falls inside the body.
    #[error(
        "object '{object}' got no particles: its smallest extent is {extent:.2e} m and the particle spacing is \
         {spacing:.2e} m; raise `simulation.grid_density` or make the object larger"
    )]
    NoParticles { object: String, extent: f64, spacing: f32 },
    /// A particle lattice needs n³ particles per cell.
    #[error("particles_per_cell is {0}; the lattice needs a cube: 1, 8, 27, 64, …")]
    NotACube(u32),
    /// An edge of a triangle mesh does not have two sides.
    #[error(
        "the mesh is not closed: the edge from vertex {a} {a_at:?} to vertex {b} {b_at:?} belongs to {count} \
         triangle(s), not 2; close the hole or remove the loose face"
    )]
    OpenMesh { a: u32, b: u32, a_at: [f32; 3], b_at: [f32; 3], count: usize },
    /// A triangle names a vertex that does not exist.
    #[error("triangle {triangle} names vertex {vertex}, but the mesh has {vertices} vertices (counted from 0)")]
    BadIndex { triangle: usize, vertex: u32, vertices: usize },
    /// A vertex position is NaN or infinite.
    #[error("vertex {vertex} of the mesh is not finite; repair the file")]
    BadVertex { vertex: usize },
    /// No plane below the objects.
    #[error(
        "no ground found below the objects ({inliers} of {candidates} background points agree); set `ground.height`, \
         or remove [ground]"
    )]
    NoGround { candidates: usize, inliers: usize },
    /// The up direction cannot be used.
    #[error("up is {0:?}; it must be a finite direction that is not along the view axis")]
    BadUp([f32; 3]),
}

/// `value` if it is positive and finite.
pub(crate) fn positive(what: &'static str, value: f64) -> Result<f64, GeometryError> {
    if value.is_finite() && value > 0.0 { Ok(value) } else { Err(GeometryError::NotPositive { what, value }) }
}
