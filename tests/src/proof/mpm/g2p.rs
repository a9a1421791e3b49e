//! Proof of `mpm/g2p`: v = Σ w v_i, C = 4/dx² Σ w v_i (x_i − x_p)ᵀ (Jiang 2015), F ← (I + dt Σ v_i ∇wᵀ) F or with
//! C for the gradient (Hu 2018), x ← x + dt v, V0 τ of the new F.

use std::collections::BTreeSet;

use physvideo_gpu::kernels::{Body, Clock, Deformation, Grid, Live, Particle};

use super::{Mat3, Vec3, affine, bodies, gradient, law, memory, spline, stress, vec3};
use crate::proof::cloud::{ASLEEP, Cloud, PINNED, QUARANTINED, WATCHED, grid};
use crate::proof::lattice::{Lattice, NOWHERE, key};
use crate::proof::{Ask, Buffers, Call, Case, Compared};
use crate::random::Random;
use physvideo_gpu::kernels::family::material::LIQUID;

pub static CASE: Case = Case {
    kernel: "mpm/g2p",
    inputs,
    compare,
    tolerance: 2e-6,
    reason: "weights to 1e-6 as in P2G, over 27 nodes; the stress adds ten Newton steps of the polar decomposition; \
             each relative to the size of its terms",
    // Which particle claims a block first is chance.
    unordered: &["list", "table"],
    bytes: 2.0 * 144.0 + 8.0 + 16.0 * 27.0 / 8.0,
    flops: 900.0,
};

const PACKED: f32 = 0.9;
const MAX_STRETCH: f64 = 0.5;
const MIN_VOLUME: f64 = 0.05;

/// Which particles a call is for, and of what.
#[derive(Clone, Copy, PartialEq)]
enum Form {
    /// All, in the order of their cells.
    All,
    /// A stretch of them.
    Stretch,
    /// A stretch of a liquid.
    Liquid,
}

fn form(call: &Call) -> Form {
    let on = |name: &str| call.constants == call.constants.clone().with(name, 1.0);
    match (on("ALL"), on("LIQUID")) {
        (true, _) => Form::All,
        (_, false) => Form::Stretch,
        _ => Form::Liquid,
    }
}

/// Odd seeds use the MLS gradient; every third takes a stretch, every third a stretch of a liquid; every fifth leaves it to
/// others to find the cells.
fn inputs(ask: Ask) -> Call {
    let mut random = Random::new(ask.seed ^ 0x62b);
    let (stretch, liquid) = (!ask.seed.is_multiple_of(3), ask.seed % 3 == 2);
    let mut cloud = Cloud::new(ask);
    // A deformation that is not sound is found here, where the stress is made.
    let (gone, torn) = cloud.poisoned.split_at(cloud.poisoned.len() / 2);
    let (gone, torn) = (gone.to_vec(), torn.to_vec());
    let sound = Cloud::new(Ask { poison: false, ..ask });
    for i in &torn {
        cloud.particles[*i] = sound.particles[*i];
        cloud.particles[*i].tag = (*i % 2) as u32; // a body whose material makes a stress of it
        let bad = [f32::NAN, f32::INFINITY, if liquid { f32::NAN } else { 3e38 }][*i % 3];
        if liquid { cloud.deformations[*i].f0[0] = bad } else { cloud.deformations[*i].f1[random.below(3)] = bad }
    }
    cloud.poisoned = gone;
    let mut cloud = cloud.quarantined();
    for p in cloud.particles.iter_mut().skip(1).step_by(3) {
        p.tag |= WATCHED;
    }
    // Some are squeezed flat: one more step would turn them inside out.
    for d in cloud.deformations.iter_mut().skip(7).step_by(50) {
        d.f2 = [d.f2[0] * 0.02, d.f2[1] * 0.02, d.f2[2] * 0.02, 0.0];
        if liquid {
            d.f0[0] = 0.051;
        }
    }
    let mut all = bodies();
    if liquid {
        let one = *all.iter().find(|b| b.material == LIQUID).expect("there is a liquid");
        all.fill(one);
    }
    let sorted = Lattice::new(grid(), &cloud.particles, ask.seed);
    let slots = sorted.grid.capacity as usize;
    let nodes: Vec<[f32; 4]> = (0..slots * 64)
        .map(|_| {
            let size = if random.chance(0.1) { 8.0 } else { 1.0 };
            let v = random.vector(size);
            // As dense as a liquid, more or less.
            let m = if liquid { random.range(5e-3, 1.2e-2) } else { random.range(0.0, 1e-3) };
            [v[0], v[1], v[2], m]
        })
        .collect();
    let mut clock = Clock {
        dt: 4e-3,
        speed_bits: 0.5f32.to_bits(),
        clamped_strain: 3,
        quarantined: 2,
        left: 1,
        stir: 0.4,
        stirred: 6,
        ..Default::default()
    };
    let flag = |on: bool| f64::from(u8::from(on));
    // Which of the stretches a call is for, where the list of particles is one after the other.
    let run = ask.seed as usize % 8;
    clock.starts[run] = ask.items as u32 / 4;
    clock.runs[run] = [9, 1, 1, ask.items as u32 / 2];
    let grid = Grid { run: run as u32, capacity: slots as u32 + 20, ..sorted.grid };
    let order = if stretch { (0..ask.items as u32).rev().collect() } else { sorted.order.clone() };
    Call::new(ask.items.div_ceil(64) + 1)
        .constant("TRUE_GRADIENT", flag(ask.seed.is_multiple_of(2)))
        .constant("ALL", flag(!stretch))
        .constant("LIQUID", flag(liquid))
        .constant("PACKED", f64::from(PACKED))
        .constant("LOCATES", flag(ask.seed % 5 != 4))
        .with("particles", &cloud.particles)
        .with("deformations", &cloud.deformations)
        .with("bodies", &all)
        .with("order", &order)
        .same("was", "particles")
        .same("deformed", "deformations")
        .with("keys", &sorted.cells())
        .same("cells", "keys")
        .with("links", &sorted.links)
        .with("slots", &sorted.table)
        .with("table", &vec![0u32; sorted.table.len()])
        .same("claimed", "table")
        .with("list", &vec![NOWHERE; slots + 20])
        .with("live", &[Live { placed: sorted.counters().cursor, ..Default::default() }])
        .with("nodes", &nodes)
        .grid(&grid)
        .with("clock", &[clock])
}

/// Got, wanted and scale of one output.
#[derive(Default)]
struct Column(Vec<f64>, Vec<f64>, Vec<f64>);

impl Column {
    fn add(&mut self, got: impl AsRef<[f64]>, want: impl AsRef<[f64]>, scale: f64) {
        self.0.extend(got.as_ref());
        self.1.extend(want.as_ref());
        self.2.resize(self.1.len(), scale);
    }

    fn done(self, what: &'static str) -> Compared {
        Compared::close(what, self.0, self.1, self.2)
    }
}

fn compare(call: &Call, out: &Buffers) -> Vec<Compared> {
    let input = &call.buffers;
    let (was, now): (Vec<Particle>, Vec<Particle>) = (input.get("particles"), out.get("particles"));
    let (def_was, def_now): (Vec<Deformation>, Vec<Deformation>) = (input.get("deformations"), out.get("deformations"));
    let (grid, clock): (Grid, Clock) = (input.one("grid"), input.one("clock"));
    let bodies: Vec<Body> = input.get("bodies");
    let nodes = Nodes { grid, table: input.get("slots"), nodes: input.get("nodes") };
    let on = |name: &str| call.constants == call.constants.clone().with(name, 1.0);
    let true_gradient = on("TRUE_GRADIENT");
    let (dx, dt) = (f64::from(grid.dx), f64::from(clock.dt));
    let sorted = Lattice::new(self::grid(), &was, 0);
    let form = form(call);
    let run = grid.run as usize;
    let meant: Vec<bool> = {
        let (first, order): (usize, Vec<u32>) = (clock.starts[run] as usize, input.get("order"));
        let mut meant = vec![form == Form::All; was.len()];
        order[first..first + clock.runs[run][3] as usize].iter().for_each(|p| meant[*p as usize] = true);
        meant
    };
    let (mut x, mut v, mut c, mut f, mut tau) = <(Column, Column, Column, Column, Column)>::default();
    let mut kept = Column::default();
    let (mut strained, mut squeezed, mut lost, mut left, mut idle) = (0, 0, 0, 0, true);
    let mut stirred = Stirred::default();
    let mut found = Found::new(call, out);
    let mut fastest = f64::from(f32::from_bits(clock.speed_bits));
    for i in 0..was.len() {
        let (p, q) = (&was[i], &now[i]);
        let bytes = |p: &Particle, d: &Deformation| [bytemuck::bytes_of(p), bytemuck::bytes_of(d)].concat();
        let meant = meant[i];
        if !meant || sorted.keys[i] == NOWHERE || p.tag & (PINNED | ASLEEP) != 0 {
            idle &= bytes(p, &def_was[i]) == bytes(q, &def_now[i]);
            let held = meant && sorted.keys[i] != NOWHERE;
            found.expect(i, if held { Some(q) } else { None });
            continue;
        }
        let mut moved = Motion::default();
        for r in spline::reach(&grid, &p.x) {
            moved.add(&r, nodes.velocity(r.node), nodes.mass(r.node));
        }
        let affine_want = moved.moment * (4.0 / (dx * dx));
        let mut l = if true_gradient { moved.gradient } else { affine_want };
        if dt * l.norm() > MAX_STRETCH {
            l *= MAX_STRETCH / (dt * l.norm());
            strained += 1;
        }
        stirred.add(p.tag, moved.velocity.norm(), moved.size, f64::from(clock.stir));
        let body = &bodies[(p.tag & 0xff) as usize];
        let liquid = body.material == LIQUID;
        // Of a liquid F is J alone, which grows with the divergence.
        let old = if liquid { Mat3::identity() * f64::from(def_was[i].f0[0]) } else { gradient(&def_was[i]) };
        let mut doubtful = false;
        let mut next = if liquid { old * (1.0 + dt * l.trace()) } else { old + dt * l * old };
        if liquid {
            // Where the grid says that it is denser, J goes there by a tenth.
            let packed = f64::from(p.m) / f64::from(def_was[i].f0[3]) * dx.powi(3) / moved.mass;
            doubtful = (packed / f64::from(PACKED) - next[0].min(1.0)).abs() < 1e-4 * packed;
            if packed > f64::from(PACKED) * next[0].min(1.0) && packed < next[0] {
                next += Mat3::identity() * (0.1 * (packed - next[0]));
            }
        }
        if !(next.iter().all(|c| c.is_finite()) && next.norm() < 1e15) {
            // No stress can be made of it: the particle is taken out.
            lost += 1;
            idle &= q.tag == p.tag | QUARANTINED;
            found.expect(i, Some(q));
            continue;
        }
        let volume_of = |f: &Mat3| if liquid { f[0] } else { f.determinant() };
        // Only what would be compressed further is refused.
        if volume_of(&next) < MIN_VOLUME && volume_of(&next) <= volume_of(&old) {
            next = old;
            squeezed += 1;
        }
        let volume = f64::from(def_was[i].f0[3]);
        let answer = law::respond(body, &next, memory(&def_was[i]), &l);
        let want = volume * answer.tau;
        let stiffness = volume * law::stiffness(body, &next, &answer);
        found.expect(i, Some(q));
        // Where its cell is outside the grid it is taken out.
        let gone = found.locates && found.now[i] == NOWHERE;
        lost += u32::from(gone);
        left += u32::from(gone);
        if doubtful {
            continue; // rounding decides which way it goes
        }
        if !gone {
            fastest = fastest.max(moved.velocity.norm() + f64::from(body.wave) * answer.wave);
        }
        x.add(vec3(&q.x).as_slice(), (vec3(&p.x) + dt * moved.velocity).as_slice(), vec3(&p.x).norm());
        v.add(vec3(&q.v).as_slice(), moved.velocity.as_slice(), moved.size);
        c.add(affine(q).as_slice(), affine_want.as_slice(), 4.0 / dx * moved.size);
        let size = old.norm() * (1.0 + dt * 4.0 / dx * moved.size);
        if form == Form::Liquid {
            // Only J is written.
            f.add([f64::from(def_now[i].f0[0])], [answer.f[0]], size);
            idle &= (def_now[i].f1, def_now[i].f2) == (def_was[i].f1, def_was[i].f2);
        } else {
            f.add(gradient(&def_now[i]).as_slice(), answer.f.as_slice(), size);
            kept.add([memory(&def_now[i])], [answer.memory], 1.0 + answer.memory.abs() + size);
        }
        tau.add(stress(q).as_slice(), want.as_slice(), stiffness);
        let tag = if gone { p.tag | QUARANTINED } else { p.tag };
        idle &= (q.tag, q.m, def_now[i].f0[3]) == (tag, p.m, def_was[i].f0[3]);
    }
    let after: Clock = out.one("clock");
    let mut compared = found.compare(out);
    compared.extend([
        x.done("x"),
        v.done("v"),
        c.done("C"),
        f.done("F"),
        kept.done("memory"),
        tau.done("V0 τ"),
        Compared::near("fastest", vec![f64::from(f32::from_bits(after.speed_bits))], vec![fastest], fastest),
        Compared::equal(
            "clamped strain and volume, quarantined, left the grid",
            &[after.clamped_strain, after.clamped_volume, after.quarantined, after.left],
            &[clock.clamped_strain + strained, squeezed, clock.quarantined + lost, clock.left + left],
        ),
        Compared::fact("pinned, lost, sleeping and unchanging values stay", idle),
        Compared::fact("motion beside what sleeps is counted", stirred.fits(after.stirred - clock.stirred)),
    ]);
    compared
}

/// Particles beside what sleeps that move; where rounding decides, they may count or not.
#[derive(Default)]
struct Stirred {
    sure: u32,
    doubtful: u32,
}

impl Stirred {
    fn add(&mut self, tag: u32, speed: f64, size: f64, stir: f64) {
        if tag & WATCHED != 0 {
            let close = (speed - stir).abs() < 1e-5 * size;
            self.doubtful += u32::from(close);
            self.sure += u32::from(speed > stir && !close);
        }
    }

    fn fits(&self, counted: u32) -> bool {
        (self.sure..=self.sure + self.doubtful).contains(&counted)
    }
}

/// The cells that particles came to, and the blocks they claimed.
struct Found {
    grid: Grid,
    locates: bool,
    was: Vec<u32>,
    now: Vec<u32>,
    right: bool,
    touched: BTreeSet<u32>,
}

impl Found {
    fn new(call: &Call, out: &Buffers) -> Self {
        Self {
            grid: call.buffers.one("grid"),
            locates: call.constants == call.constants.clone().with("LOCATES", 1.0),
            was: call.buffers.get("keys"),
            now: out.get("keys"),
            right: true,
            touched: BTreeSet::new(),
        }
    }

    /// Takes in the key of particle `i`, which is now `q`, or was left alone.
    fn expect(&mut self, i: usize, q: Option<&Particle>) {
        let got = self.now[i];
        let Some(q) = q.filter(|_| self.locates) else {
            self.right &= got == self.was[i];
            return;
        };
        let at = |shift: f32| Particle { x: q.x.map(|c| c + shift * self.grid.dx), tag: q.tag & !QUARANTINED, ..*q };
        // On the border of two cells rounding decides.
        let clear = key(&self.grid, &at(1e-4)) == key(&self.grid, &at(-1e-4));
        let lost = q.tag & QUARANTINED != 0 && got == NOWHERE;
        self.right &= got == key(&self.grid, &at(0.0)) || !clear || lost;
        self.right &= (q.tag & QUARANTINED != 0) == (got == NOWHERE);
        if got != NOWHERE {
            self.touched.insert(got / 64);
        }
    }

    fn compare(&self, out: &Buffers) -> Vec<Compared> {
        let (list, table): (Vec<u32>, Vec<u32>) = (out.get("list"), out.get("table"));
        let blocks = out.one::<Live>("live").blocks as usize;
        let listed: BTreeSet<u32> = list.iter().take(blocks).copied().collect();
        let entries = (0..table.len() as u32).map(|b| list.iter().position(|l| *l == b).map_or(0, |at| at as u32 + 1));
        vec![
            Compared::fact("each particle's next cell", self.right),
            Compared::fact("its block is claimed once", listed == self.touched && blocks == listed.len()),
            Compared::equal("table", &table, &entries.collect::<Vec<_>>()),
        ]
    }
}

/// Sums over the nodes in reach.
#[derive(Default)]
struct Motion {
    velocity: Vec3,
    /// Σ w v (x_i − x_p)ᵀ.
    moment: Mat3,
    /// Σ v ∇wᵀ.
    gradient: Mat3,
    /// Largest speed in reach.
    size: f64,
    /// Σ w m.
    mass: f64,
}

impl Motion {
    fn add(&mut self, r: &spline::Reach, v: Vec3, mass: f64) {
        self.mass += r.weight * mass;
        self.velocity += r.weight * v;
        self.moment += r.weight * v * r.offset.transpose();
        self.gradient += v * r.gradient.transpose();
        self.size = self.size.max(v.norm());
    }
}

struct Nodes {
    grid: Grid,
    table: Vec<u32>,
    nodes: Vec<[f32; 4]>,
}

impl Nodes {
    fn velocity(&self, node: [i64; 3]) -> Vec3 {
        vec3(&self.node(node))
    }

    fn mass(&self, node: [i64; 3]) -> f64 {
        self.node(node)[3].into()
    }

    fn node(&self, node: [i64; 3]) -> [f32; 4] {
        let n = node.map(|c| u32::try_from(c).expect("inside the grid"));
        let slot = self.table[crate::proof::lattice::index(&self.grid, n.map(|c| c / 4)) as usize] - 1;
        self.nodes[(slot * 64 + n[2] % 4 * 16 + n[1] % 4 * 4 + n[0] % 4) as usize]
    }
}
