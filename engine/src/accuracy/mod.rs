//! How fine a grid an error that is asked for needs: measured tables of error against cells across a body and Courant
//! number, a table for each kind of body, and how thick bodies are. Knows neither solvers nor what a scene looks like.

mod reach;
mod size;
mod table;

use thiserror::Error;

use crate::world::World;

pub use self::size::size;
pub use self::table::{Kind, Row};

/// The cheapest setting whose error is small enough for every body.
#[derive(Clone, Debug, PartialEq)]
pub struct Fit {
    /// Cells, or particles of SPH, a metre.
    pub density: f32,
    /// Courant number.
    pub courant: f32,
    /// The largest error that its tables say, relative.
    pub error: f32,
    /// The body with that error.
    pub body: String,
    /// What it is.
    pub kind: Kind,
    /// Its size [m].
    pub size: f32,
}

/// Why there is none.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum Unfit {
    /// A kind of body that has no table.
    #[error("no error is known of '{body}', which is {kind}: nothing that was measured holds for others")]
    Unmeasured {
        /// Name of the body.
        body: String,
        /// Its kind.
        kind: &'static str,
    },
    /// A body unlike those that were measured.
    #[error("no error is known of '{body}': it {what}")]
    Beyond {
        /// Name of the body.
        body: String,
        /// What it is beyond.
        what: String,
    },
    /// Less than any setting reaches.
    #[error(
        "an error of {asked} is out of reach: the least that was measured is {least}, for '{body}' ({size} m) with {density:.0} \
         cells a metre"
    )]
    OutOfReach {
        /// Error asked for.
        asked: f32,
        /// Least error.
        least: f32,
        /// The body that has it.
        body: String,
        /// Its size [m].
        size: f32,
        /// Its cells a metre.
        density: f32,
    },
}

/// A body and what was measured of its kind.
struct Known<'a> {
    name: &'a str,
    kind: Kind,
    size: f32,
    table: Vec<Row>,
}

impl Known<'_> {
    /// The error with so many cells a metre: that of the measured row with the most cells that are not more.
    fn error(&self, density: f32, courant: f32) -> Option<f32> {
        let cells = density * self.size * (1.0 + 1e-4);
        let rows = self.table.iter().filter(|r| r.courant == courant && r.cells <= cells);
        rows.max_by(|a, b| a.cells.total_cmp(&b.cells)).map(|r| r.error)
    }
}

/// The cheapest setting for bodies of `world`, the elastic ones on grids of their `own` or on that of all, whose error is
/// at most `asked`; none where nothing is simulated. Work grows with the cells of a volume and the steps across a cell:
/// density⁴ over the Courant number.
///
/// # Errors
/// A body that the tables know nothing of, or an error out of reach.
pub fn fit(world: &World, own: bool, asked: f32) -> Result<Option<Fit>, Unfit> {
    let mut bodies = Vec::new();
    for body in world.bodies.iter().filter(|b| !b.positions.is_empty()) {
        let kind = Kind::of(body, world, own);
        let table = kind.table();
        if table.is_empty() {
            return Err(Unfit::Unmeasured { body: body.name.clone(), kind: kind.name() });
        }
        bodies.push(Known { name: &body.name, kind, size: reach::reach(body, world, kind)?, table });
    }
    // Every setting at which some body's table has a row, with the body that is worst off.
    let mut settings: Vec<Fit> = Vec::new();
    for (known, row) in bodies.iter().flat_map(|b| b.table.iter().map(move |r| (b, r))) {
        let (density, courant) = (row.cells / known.size, row.courant);
        let errors: Option<Vec<f32>> = bodies.iter().map(|b| b.error(density, courant)).collect();
        let worst = errors.iter().flatten().copied().zip(&bodies).max_by(|a, b| a.0.total_cmp(&b.0));
        if let (Some(_), Some((error, b))) = (&errors, worst) {
            settings.push(Fit { density, courant, error, body: b.name.into(), kind: b.kind, size: b.size });
        }
    }
    let work = |f: &&Fit| f.density.powi(4) / f.courant;
    let cheapest = settings.iter().filter(|f| f.error <= asked).min_by(|a, b| work(a).total_cmp(&work(b)));
    match (cheapest, settings.iter().min_by(|a, b| a.error.total_cmp(&b.error))) {
        (Some(fit), _) => Ok(Some(fit.clone())),
        (None, Some(best)) => {
            let Fit { error: least, ref body, size, density, .. } = *best;
            Err(Unfit::OutOfReach { asked, least, body: body.clone(), size, density })
        }
        (None, None) => Ok(None),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Material;
    use crate::world::Body;

    const JELLY: Material = Material::Elastic { young: 1e4, poisson: 0.0 };

    /// A bar of 20 × 4 × 4 particles, half a metre apart.
    pub(super) fn bar(material: Material) -> World {
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
            damping: 0.0,
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

    /// The bar, held at one end.
    fn held() -> World {
        let mut world = bar(JELLY);
        world.bodies[0].pinned = vec![true; 10];
        world
    }

    #[test]
    fn more_work_buys_less_error() {
        let world = held();
        let mut before = f32::MAX;
        for asked in [0.02, 0.04, 0.1] {
            let found = fit(&world, false, asked).unwrap().unwrap();
            assert!(found.error <= asked && found.kind == Kind::Held, "{found:?}");
            // Two metres thick.
            let row = Row { cells: found.density * 2.0, courant: found.courant, error: found.error };
            assert!(Kind::Held.table().contains(&row), "{found:?}");
            let work = found.density.powi(4) / found.courant;
            assert!(work < before, "a larger error costs less: {found:?}");
            before = work;
        }
    }

    #[test]
    fn what_is_not_known_is_refused() {
        let steel = fit(&held(), false, 1e-6);
        assert!(matches!(steel, Err(Unfit::OutOfReach { least, .. }) if least < 0.02), "{steel:?}");
        let mut emitted = bar(JELLY);
        emitted.bodies[0].recycle = Some(Default::default());
        assert!(matches!(fit(&emitted, false, 0.5), Err(Unfit::Beyond { .. })));
        let nothing = World { bodies: vec![], ..held() };
        assert_eq!(fit(&nothing, false, 0.1), Ok(None));
    }

    #[test]
    fn of_several_bodies_the_strictest_counts() {
        let mut world = held();
        let alone = fit(&world, false, 0.05).unwrap().unwrap();
        // The same at half the size needs twice the density; and one that falls has another table.
        let mut small = world.bodies[0].clone();
        small.name = "small".into();
        small.positions.iter_mut().for_each(|x| x.iter_mut().for_each(|c| *c *= 0.5));
        small.particle_volume /= 8.0;
        world.bodies.push(small);
        let both = fit(&world, false, 0.05).unwrap().unwrap();
        assert!(both.density >= 2.0 * alone.density && both.body == "small", "{both:?}");
        world.bodies.push(Body { name: "loose".into(), ..bar(JELLY).bodies.remove(0) });
        let loose = fit(&world, false, 0.2).unwrap().unwrap();
        let table = Kind::Free.table();
        assert!(table.iter().any(|r| r.error == loose.error) && loose.body == "loose", "{loose:?}");
        // On a grid of its own it has another table, and the one that is held has the same.
        let own = fit(&world, true, 0.2).unwrap().unwrap();
        let both = [Kind::FreeOwn.table(), Kind::Held.table()].concat();
        assert!(own.density < loose.density && both.iter().any(|r| r.error == own.error), "{own:?}");
    }
}
