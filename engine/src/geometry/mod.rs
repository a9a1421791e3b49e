//! Geometry of a scene as plain arrays: photograph, surfaces, volumes, ground, display points. Runs once per
//! scene on the CPU; knows nothing of files, GPUs or stages.

mod complete;
mod display;
mod error;
mod ground;
mod mesh;
mod photo;
mod shading;
mod smooth;
mod surface;
mod thickness;
mod unproject;
mod volume;

#[cfg(test)]
mod aloe_tests;

pub use display::{Carrier, DisplayPoints, attach, display_points, surface_point};
pub use error::GeometryError;
pub use ground::{GroundPlane, WorldFromCamera, find_ground};
pub use mesh::TriangleMesh;
pub use photo::PhotoData;
pub use shading::{checks, shade};
pub use smooth::{Smoothing, smooth};
pub use surface::SurfaceMap;
pub use thickness::{silhouette_distance, thickness};
pub use unproject::Pinhole;
pub use volume::{Lattice, MaskBody, Particles};
