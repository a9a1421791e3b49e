//! Rest under gravity: finds the stress with which a body carries its weight in the shape it has. A photograph
//! shows the sagged shape; without this a soft body would collapse on the first frame.

use physvideo_gpu::kernels::{Forces, Particle, mpm};
use physvideo_gpu::{GpuError, Recording};

use super::mpm::{Mpm, QUARANTINED};
use crate::world::World;

/// Share of gravity under which the rest state is sought: small, so that the body stays in the linear range; large
/// enough that f32 strains keep four digits.
const LOAD: f32 = 1e-2;
/// Peaks of kinetic energy after which the rest of the motion is given up; each takes about an order of magnitude.
const PEAKS: u32 = 12;
/// Bound on the search [slices]; a body that nothing holds would fall forever.
const SLICES: u32 = 4000;

impl Mpm<'_> {
    /// Dynamic relaxation with kinetic damping (Cundall 1987) under a small load; the stress is scaled to the full
    /// load and kept, the particles go back to where they stood.
    pub(super) fn find_rest(&mut self, world: &World) -> Result<(), GpuError> {
        let start: Vec<Particle> = self.gpu.read(self.particles)?;
        let deformations = self.gpu.read(self.deformations)?;
        let held: Vec<Particle> = start
            .iter()
            .map(|p| {
                let mut p = *p;
                p.v = [0.0; 3];
                if !world.bodies[(p.tag & 0xff) as usize].prestress {
                    p.tag |= QUARANTINED;
                }
                p
            })
            .collect();
        let forces: Forces = self.gpu.read(self.forces)?[0];
        self.gpu.write(self.forces, 0, &[Forces { count: 0, ..forces }])?;
        self.gpu.write(self.particles, 0, &held)?;
        self.update_stress()?;
        let Self { particles, prestress, clock, .. } = *self;
        let mut halt = Recording::new("halt");
        halt.each(&mpm::Halt { particles, clock }, &self.constants, start.len() as u64);
        // A slice is a few wave crossings of a cell, far shorter than any swing whose peak is to be seen.
        let slice = 16.0 * world.courant * world.dx
            / world.bodies.iter().map(crate::world::Body::wave_speed).fold(1e-6, f32::max);
        let (mut before, mut first_peak, mut peaks) = (0.0, 0.0, 0);
        for _ in 0..SLICES {
            self.advance(slice, world.courant, LOAD)?;
            let kinetic = (0..world.bodies.len())
                .filter(|b| world.bodies[*b].prestress)
                .try_fold(0.0, |sum, b| Ok::<_, GpuError>(sum + self.measure(b)?.kinetic))?;
            if kinetic < before {
                peaks += 1;
                first_peak = f64::max(first_peak, before);
                self.gpu.run(&halt)?;
                // A millionth of the first swing's energy is a thousandth of its amplitude.
                if before < 1e-6 * first_peak || peaks >= PEAKS {
                    break;
                }
                before = 0.0;
                continue;
            }
            before = kinetic;
        }
        self.start_clock(1.0, world.courant, LOAD)?;
        let mut keep = Recording::new("prestress");
        keep.each(&mpm::Prestress { particles, prestress, clock }, &self.constants, start.len() as u64);
        self.gpu.run(&keep)?;
        self.gpu.write(self.forces, 0, &[forces])?;
        self.gpu.write(self.particles, 0, &start)?;
        self.gpu.write(self.deformations, 0, &deformations)
    }
}
