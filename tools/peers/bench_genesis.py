"""Genesis (genesis-world), CPU backend: a cube of MPM particles drops on a plane, or an SPH dam breaks in a tank.

  python bench_genesis.py --n 50000 --threads 2 --material sand
  python bench_genesis.py --scene sph --pressure DFSPH --dt 4e-3

Genesis pins its CPU backend to ONE thread unless QD_NUM_THREADS is set; --threads sets it.
"""
import argparse
import os
import time

ap = argparse.ArgumentParser()
ap.add_argument("--n", type=int, default=50000)
ap.add_argument("--scene", default="mpm", choices=["mpm", "sph"])
ap.add_argument("--material", default="corotated",
                choices=["corotated", "neohookean", "liquid", "sand", "snow", "plastic"])
ap.add_argument("--pressure", default="WCSPH", choices=["WCSPH", "DFSPH"])
ap.add_argument("--spacing", default="eight", choices=["eight", "default", "paper"],
                help="eight: dx / 2, 8 particles per cell; default: Genesis' own 0.64 dx; paper: 1.3e-2 m")
ap.add_argument("--threads", type=int, default=2)
ap.add_argument("--dt", type=float, default=1e-3, help="a step [s]")
ap.add_argument("--substeps", type=int, default=10, help="substeps in a step; 1e-4 s each is below dx / c = 1.46e-4 s")
ap.add_argument("--grid-density", type=int, default=128)
ap.add_argument("--warm", type=int, default=10, help="steps before timing")
ap.add_argument("--steps", type=int, default=10, help="timed steps")
ap.add_argument("--budget", type=float, default=60.0, help="stop timing after this many seconds")
args = ap.parse_args()
os.environ["QD_NUM_THREADS"] = str(args.threads)

import numpy as np  # noqa: E402
import torch  # noqa: E402

torch.set_num_threads(args.threads)
import genesis as gs  # noqa: E402
import quadrants as qd  # noqa: E402

from common import emit, median, peak_rss_mb  # noqa: E402

gs.init(backend=gs.cpu, precision="32", logging_level="warning")
SIZE = 1.3e-2   # of an SPH particle, the paper's
edge = max(1, round(args.n ** (1 / 3)))
sim = gs.options.SimOptions(dt=args.dt, substeps=args.substeps, gravity=(0, 0, -9.81))
particle_size = {"eight": 0.5 / args.grid_density, "default": None, "paper": 1.3e-2}[args.spacing]
opts = gs.options.MPMOptions(grid_density=args.grid_density, particle_size=particle_size,
                             lower_bound=(-0.5, -0.5, -0.03), upper_bound=(0.5, 0.5, 0.97))
M = gs.materials.MPM
# Fixed-corotated is what Genesis takes when no model is named; the others have its own parameters.
materials = {
    "corotated": lambda: M.Elastic(E=8e4, nu=0.32, rho=40.0, sampler="regular"),
    "neohookean": lambda: M.Elastic(E=8e4, nu=0.32, rho=40.0, sampler="regular", model="neohooken"),
    "liquid": lambda: M.Liquid(sampler="regular"),
    "sand": lambda: M.Sand(sampler="regular"),
    "snow": lambda: M.Snow(sampler="regular"),
    "plastic": lambda: M.ElastoPlastic(sampler="regular"),
}
if args.scene == "mpm":
    side = edge * opts.particle_size
    scene = gs.Scene(mpm_options=opts, show_viewer=False, sim_options=sim)
    scene.add_entity(gs.morphs.Plane())
    cube = scene.add_entity(material=materials[args.material](),
                            morph=gs.morphs.Box(pos=(0, 0, 0.002 + side / 2), size=(side,) * 3))
else:
    s = edge * SIZE
    tank = gs.options.SPHOptions(particle_size=SIZE, pressure_solver=args.pressure,
                                 lower_bound=(0, 0, 0), upper_bound=(3 * s, s + SIZE, 2 * s))
    scene = gs.Scene(sph_options=tank, show_viewer=False, sim_options=sim)
    cube = scene.add_entity(material=gs.materials.SPH.Liquid(mu=5e-3, sampler="regular"),
                            morph=gs.morphs.Box(pos=(s / 2 + SIZE / 2,) * 3, size=(s,) * 3))
t0 = time.perf_counter()
scene.build()
build_s = time.perf_counter() - t0
n = cube.n_particles


def positions():
    return np.asarray(cube.get_particles_pos().cpu()).reshape(-1, 3)


start = positions().mean(0)
t0 = time.perf_counter()
scene.step()
qd.sync()
first_s = time.perf_counter() - t0
for _ in range(args.warm):
    scene.step()
qd.sync()
ts, begun = [], time.perf_counter()
for _ in range(args.steps):
    a = time.perf_counter()
    scene.step()
    qd.sync()
    ts.append(time.perf_counter() - a)
    if time.perf_counter() - begun > args.budget:
        break
x = positions()
sub = median(ts) / args.substeps
emit(peer="genesis", version=gs.__version__, scene=args.scene,
     variant=f"{args.material}/{args.spacing}" if args.scene == "mpm" else args.pressure, particles=int(n),
     threads=args.threads, substep_dt=args.dt / args.substeps,
     substep_ms=1e3 * sub, substep_ms_min=1e3 * min(ts) / args.substeps, substep_ms_max=1e3 * max(ts) / args.substeps,
     ns_per_particle_substep=1e9 * sub / n, wall_s_per_simulated_s=median(ts) / args.dt, timed_steps=len(ts),
     build_s=build_s, first_step_s=first_s, peak_rss_mb=peak_rss_mb(), finite=bool(np.isfinite(x).all()),
     simulated_s=args.dt * (1 + args.warm + len(ts)), fall_m=float(start[2] - x.mean(0)[2]),
     z_min=float(x[:, 2].min()), z_max=float(x[:, 2].max()))
