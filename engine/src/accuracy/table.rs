//! What was measured: a table for each kind of body, error against cells across it and Courant number. Each file says
//! what its error is an error of.

use crate::scene::{Material, Pressure};
use crate::world::{Body, World};

/// Bodies whose errors were measured apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Elastic, held somewhere: it bends.
    Held,
    /// Elastic, free, on the grid of all: it falls and strikes.
    Free,
    /// The same on a grid of its own.
    FreeOwn,
    /// Von Mises.
    Plastic,
    /// Snow.
    Snow,
    /// Foam.
    Foam,
    /// Sand.
    Sand,
    /// Liquid of the grid.
    Liquid,
    /// Liquid of SPH, by DFSPH.
    Dfsph,
    /// Liquid of SPH, by WCSPH.
    Wcsph,
}

/// A measured setting.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row {
    /// Cells, or particles of SPH, across a body's smallest size.
    pub cells: f32,
    /// Courant number.
    pub courant: f32,
    /// Error, relative: 0.01 is 1 %.
    pub error: f32,
}

impl Kind {
    /// Every kind.
    pub const ALL: [Self; 10] = [
        Self::Held,
        Self::Free,
        Self::FreeOwn,
        Self::Plastic,
        Self::Snow,
        Self::Foam,
        Self::Sand,
        Self::Liquid,
        Self::Dfsph,
        Self::Wcsph,
    ];

    /// Of a body of `world`, whose elastic bodies are on grids of their `own` or not.
    pub fn of(body: &Body, world: &World, own: bool) -> Self {
        match body.material {
            Material::Elastic { .. } | Material::NeoHookean { .. } if body.pinned.contains(&true) => Self::Held,
            Material::Elastic { .. } | Material::NeoHookean { .. } if own => Self::FreeOwn,
            Material::Elastic { .. } | Material::NeoHookean { .. } => Self::Free,
            Material::Plastic { .. } => Self::Plastic,
            Material::Snow { .. } => Self::Snow,
            Material::Foam { .. } => Self::Foam,
            Material::Sand { .. } => Self::Sand,
            Material::Liquid { .. } => Self::Liquid,
            Material::Sph { .. } if world.fluid.pressure == Pressure::Dfsph => Self::Dfsph,
            Material::Sph { .. } => Self::Wcsph,
        }
    }

    /// Name of its file.
    pub fn name(self) -> &'static str {
        match self {
            Self::Held => "held",
            Self::Free => "free",
            Self::FreeOwn => "free_own",
            Self::Plastic => "plastic",
            Self::Snow => "snow",
            Self::Foam => "foam",
            Self::Sand => "sand",
            Self::Liquid => "liquid",
            Self::Dfsph => "dfsph",
            Self::Wcsph => "wcsph",
        }
    }

    /// Its table. Snow has none, as more cells do not bring it nearer to a finer run, nor foam, whose unseen blocks do not get
    /// worse with fewer cells; nor WCSPH, whose finer runs take too long for a table that is made in minutes.
    pub fn table(self) -> Vec<Row> {
        let text = match self {
            Self::Held => include_str!("held.csv"),
            Self::Free => include_str!("free.csv"),
            Self::FreeOwn => include_str!("free_own.csv"),
            Self::Plastic => include_str!("plastic.csv"),
            Self::Sand => include_str!("sand.csv"),
            Self::Liquid => include_str!("liquid.csv"),
            Self::Dfsph => include_str!("dfsph.csv"),
            Self::Snow | Self::Foam | Self::Wcsph => "",
        };
        read(text)
    }
}

/// Lines of three numbers; others are words about them.
fn read(text: &str) -> Vec<Row> {
    let row = |line: &str| {
        let mut numbers = line.split(',').map(str::parse::<f32>);
        Some(Row { cells: numbers.next()?.ok()?, courant: numbers.next()?.ok()?, error: numbers.next()?.ok()? })
    };
    text.lines().filter_map(row).collect()
}
