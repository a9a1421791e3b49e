//! What ends a run for its numbers: frames without an end, bodies that are lost, values that are none.

use physvideo::animate::{Animation, Snapshot};
use physvideo::stages::solver::FrameStats;

use super::Clip;
use crate::error::AppError;

/// What to do about numbers that are none.
const SOFTER: &str = "Lower simulation.courant (or remove simulation.force_dt), or make the material softer";

impl Clip<'_> {
    /// A frame that would never end, or a body of which nothing is left, ends the run: what follows would be frames of
    /// nothing.
    pub(super) fn check_frame(&self, animation: &Animation, frame: u32, stats: &FrameStats) -> Result<(), AppError> {
        let named = |body: u32| self.report.particles.get(body as usize).map_or("", |p| p.object.as_str());
        if let Some(p) = stats.pressed {
            return Err(AppError::Numeric(format!(
                "liquid of '{}' is pressed together between obstacles in frame {frame}: they leave it {:.3e} m³ of the {:.3e} m³ \
                 that it needs, and no way out. Stop them earlier, or leave a gap of a particle or more",
                named(p.body),
                p.left,
                p.needed
            )));
        }
        if let Some(fast) = stats.stalled {
            let of = match (self.assembled.world.is_fluid(), self.assembled.elastic.total_lagrangian) {
                (true, _) => "sph",
                (_, true) => "lagrangian",
                _ => "mpm",
            };
            let forced = if self.scene.simulation.force_dt.is_some() { ", or remove simulation.force_dt" } else { "" };
            let object = named(fast.body);
            return Err(AppError::Numeric(format!(
                "frame {frame} has no end: `{of}/clock` asks for steps below the rounding of time. Particle {} of the buffer \
                 {of}/particles, of object '{object}', moves at {:e} m/s, is stretched to {:e} and has {:e} of its volume. \
                 Make it or what it meets softer or slower, or start it further from obstacles{forced}",
                fast.particle, fast.speed, fast.stretch, fast.volume
            )));
        }
        let Some(solver) = animation.solver.as_ref().filter(|_| stats.quarantined > 0) else { return Ok(()) };
        for (index, particles) in self.report.particles.iter().enumerate() {
            let lost = u64::from(solver.measure(index).map_err(AppError::Gpu)?.quarantined);
            if lost >= particles.count {
                return Err(AppError::Numeric(format!(
                    "object '{}' is lost in frame {frame}: all of its {lost} particles left the grid's domain or are no \
                     longer finite. Enlarge simulation.domain, give it something to land on, move it out of obstacles \
                     it starts in, or lower simulation.courant (or remove simulation.force_dt)",
                    particles.object
                )));
            }
        }
        Ok(())
    }

    /// Sums and particles are numbers at the end; a body of which they are not is named.
    pub(super) fn check_finite(&self, animation: &Animation) -> Result<(), AppError> {
        let Snapshot { positions, velocities, bodies, .. } = animation.particles()?;
        self.refuse_not_finite(self.report.frames.saturating_sub(1), &positions, &velocities, &bodies)?;
        match self.report.conservation.iter().find(|c| !c.end.finite()) {
            Some(c) => Err(AppError::Numeric(format!(
                "the sums of `mpm/measure` over object '{}' (buffer mpm/sums) are no longer finite after {} frames. {SOFTER}",
                c.object, self.report.frames
            ))),
            None => Ok(()),
        }
    }

    /// Nothing that is not a number is written.
    pub(super) fn refuse_not_finite(
        &self,
        frame: u32,
        x: &[[f32; 3]],
        v: &[[f32; 3]],
        bodies: &[u32],
    ) -> Result<(), AppError> {
        let Some(i) = x.iter().zip(v).position(|(x, v)| !x.iter().chain(v).all(|c| c.is_finite())) else {
            return Ok(());
        };
        let object = self.report.particles.get(bodies[i] as usize).map_or("", |p| p.object.as_str());
        Err(AppError::Numeric(format!(
            "particle {i} of the buffer mpm/particles, of object '{object}', is no longer finite after `mpm/g2p` in frame \
             {frame}: position {:?}, velocity {:?}. {SOFTER}",
            x[i], v[i]
        )))
    }
}
