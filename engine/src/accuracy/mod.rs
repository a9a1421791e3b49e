//! How fine a grid an error that is asked for needs: a measured table of error against cells across a body and Courant
//! number, and how thick bodies are. Knows neither solvers nor what a scene looks like.

mod size;

use thiserror::Error;

use crate::world::World;

pub use self::size::size;

/// What `tools/bench wp budget` measured with 8 particles a cell.
const ELASTIC: &str = include_str!("elastic.csv");

/// A measured setting.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row {
    /// Cells across a body's smallest size.
    pub cells: f32,
    /// Courant number.
    pub courant: f32,
    /// Error, relative: 0.01 is 1 %.
    pub error: f32,
}

/// The table of elastic bodies: error of how far one bends under its own weight.
pub fn elastic() -> Vec<Row> {
    let row = |line: &str| {
        let mut numbers = line.split(',').map(str::parse::<f32>);
        Some(Row { cells: numbers.next()?.ok()?, courant: numbers.next()?.ok()?, error: numbers.next()?.ok()? })
    };
    ELASTIC.lines().filter_map(row).collect()
}

/// The cheapest setting whose error is small enough.
#[derive(Clone, Debug, PartialEq)]
pub struct Fit {
    /// Its line of the table.
    pub row: Row,
    /// The thinnest body.
    pub body: String,
    /// Its size [m].
    pub size: f32,
    /// Cells a metre.
    pub grid_density: f32,
}

/// Why there is none.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum Unfit {
    /// A material that was not measured.
    #[error("no error is known of '{body}', which is {material}: only elastic and neo_hookean bodies were measured")]
    Unmeasured {
        /// Name of the body.
        body: String,
        /// Its material.
        material: &'static str,
    },
    /// Less than any setting reaches.
    #[error(
        "an error of {asked} is out of reach: the least that was measured is {least}, with {cells} cells across '{body}' \
         ({size} m): simulation.grid_density = {grid_density:.0}"
    )]
    OutOfReach {
        /// Error asked for.
        asked: f32,
        /// Least error.
        least: f32,
        /// Its cells.
        cells: f32,
        /// The thinnest body.
        body: String,
        /// Its size [m].
        size: f32,
        /// Its cells a metre.
        grid_density: f32,
    },
}

/// The cheapest setting for bodies of `world` whose error is at most `asked`; none where nothing is simulated. Work grows
/// with the cells of a volume and the steps across a cell: cells⁴ over the Courant number.
///
/// # Errors
/// A material that was not measured, or an error out of reach.
pub fn fit(world: &World, asked: f32) -> Result<Option<Fit>, Unfit> {
    if let Some(other) = world.bodies.iter().find(|b| !b.material.elastic()) {
        return Err(Unfit::Unmeasured { body: other.name.clone(), material: other.material.name() });
    }
    let sizes = world.bodies.iter().map(|b| (size(&b.positions, b.particle_volume.cbrt()), b.name.clone()));
    let Some((size, body)) = sizes.min_by(|a, b| a.0.total_cmp(&b.0)) else { return Ok(None) };
    let table = elastic();
    let work = |row: &Row| row.cells.powi(4) / row.courant;
    let good = table.iter().filter(|r| r.error <= asked).min_by(|a, b| work(a).total_cmp(&work(b)));
    match (good, table.iter().min_by(|a, b| a.error.total_cmp(&b.error))) {
        (Some(row), _) => Ok(Some(Fit { row: *row, body, size, grid_density: row.cells / size })),
        (None, best) => {
            let (least, cells) = best.map_or((f32::INFINITY, 0.0), |r| (r.error, r.cells));
            Err(Unfit::OutOfReach { asked, least, cells, body, size, grid_density: cells / size })
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Material;
    use crate::world::Body;

    /// A bar of 20 × 4 × 4 particles, half a metre apart.
    fn bar(material: Material) -> World {
        let at = |i: i32| [i % 20, i / 20 % 4, i / 80].map(|c| 0.5 * (c as f32 + 0.5));
        let positions: Vec<[f32; 3]> = (0..320).map(at).collect();
        let body = Body {
            name: "bar".into(),
            material,
            density: 1.0,
            particle_volume: 0.125,
            velocities: vec![],
            pinned: vec![],
            gravity: None,
            prestress: false,
            friction: 0.2,
            fields: 0,
            recycle: None,
            emission: None,
            positions,
        };
        World {
            bodies: vec![body],
            gravity: [0.0; 3],
            fields: vec![],
            colliders: vec![],
            domain: ([0.0; 3], [10.0; 3]),
            dx: 1.0,
            courant: 0.75,
            force_dt: None,
            fluid: Default::default(),
        }
    }

    #[test]
    fn the_table_is_whole_and_more_work_buys_less_error() {
        let table = elastic();
        let lines = ELASTIC.lines().filter(|l| !l.starts_with('#')).count() - 1;
        assert!(table.len() == lines && lines >= 12, "{table:?}");
        let world = bar(Material::Elastic { young: 1e4, poisson: 0.0 });
        let mut before = f32::MAX;
        for asked in [0.01, 0.02, 0.04, 0.1] {
            let found = fit(&world, asked).unwrap().unwrap();
            assert!(found.row.error <= asked && table.contains(&found.row), "{found:?}");
            // Two metres thick.
            assert!((found.grid_density * 2.0 - found.row.cells).abs() < 1e-4, "{found:?}");
            let work = found.row.cells.powi(4) / found.row.courant;
            assert!(work < before, "a larger error costs less: {found:?}");
            before = work;
        }
    }

    #[test]
    fn what_is_not_known_is_refused() {
        let steel = fit(&bar(Material::Elastic { young: 1e4, poisson: 0.0 }), 1e-6);
        assert!(matches!(steel, Err(Unfit::OutOfReach { least, .. }) if least < 0.02), "{steel:?}");
        let sand = fit(&bar(Material::Sand { young: 1e5, poisson: 0.3, friction: 0.5 }), 0.1);
        assert!(matches!(sand, Err(Unfit::Unmeasured { material: "sand", .. })), "{sand:?}");
        let nothing = World { bodies: vec![], ..bar(Material::Elastic { young: 1.0, poisson: 0.0 }) };
        assert_eq!(fit(&nothing, 0.1), Ok(None));
    }
}
