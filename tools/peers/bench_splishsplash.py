"""pySPlisHSPlasH: the dam of `bench_genesis.py --scene sph` breaks: same lattice, tank and particle size, y up.

  python bench_splishsplash.py --method DFSPH --dt 4e-4
  python bench_splishsplash.py --method DFSPH --cfl            # its native adaptive time step
"""
import argparse
import json
import os
import tempfile
import time

ap = argparse.ArgumentParser()
ap.add_argument("--method", default="DFSPH", choices=["WCSPH", "DFSPH"])
ap.add_argument("--n", type=int, default=50000)
ap.add_argument("--dt", type=float, default=4e-4)
ap.add_argument("--cfl", action="store_true")
ap.add_argument("--until", type=float, default=0.1, help="simulated seconds")
ap.add_argument("--threads", type=int, default=2)
args = ap.parse_args()
os.environ["OMP_NUM_THREADS"] = str(args.threads)

import pysplishsplash as sph  # noqa: E402

from common import emit, median, peak_rss_mb  # noqa: E402

PS = 1.3e-2
side = round(args.n ** (1 / 3))
s = side * PS
work = tempfile.mkdtemp()
V = [(x, y, z) for x in (-.5, .5) for y in (-.5, .5) for z in (-.5, .5)]
Fc = [(1, 2, 4), (1, 4, 3), (5, 7, 8), (5, 8, 6), (1, 5, 6), (1, 6, 2), (3, 4, 8), (3, 8, 7), (1, 3, 7), (1, 7, 5), (2, 6, 8), (2, 8, 4)]
with open(os.path.join(work, "box.obj"), "w") as f:
    f.writelines("v %g %g %g\n" % v for v in V)
    f.writelines("f %d %d %d\n" % t for t in Fc)
L, H, W = 3 * s, 2 * s, s + PS
scene = {
    "Configuration": {
        "particleRadius": PS / 2, "timeStepSize": args.dt, "simulationMethod": {"WCSPH": 0, "DFSPH": 4}[args.method],
        "cflMethod": 1 if args.cfl else 0, "cflFactor": 0.5, "cflMaxTimeStepSize": 0.005, "cflMinTimeStepSize": 1e-5,
        "gravitation": [0, -9.81, 0], "boundaryHandlingMethod": 2, "stiffness": 50000, "exponent": 7,
        "maxIterations": 100, "maxError": 0.05, "maxIterationsV": 100, "maxErrorV": 0.1, "enableDivergenceSolver": True,
        "pause": False, "stopAt": args.until, "enableVTKExport": False, "enablePartioExport": False},
    "Materials": [{"id": "Fluid", "density0": 1000, "viscosity": 0.005, "viscosityMethod": 1}],
    "RigidBodies": [{"id": 1, "geometryFile": "box.obj", "translation": [L / 2, H / 2, W / 2], "rotationAxis": [1, 0, 0],
                     "rotationAngle": 0, "scale": [L, H, W], "color": [0, 0, 0, 0], "isDynamic": False, "isWall": True,
                     "mapInvert": True, "mapThickness": 0.0, "mapResolution": [24, 24, 24]}],
    "FluidBlocks": [{"denseMode": 0, "start": [PS / 2, PS / 2, PS / 2],
                     "end": [PS / 2 + s + PS] * 3, "translation": [0, 0, 0], "scale": [1, 1, 1]}]}
path = os.path.join(work, "dam.json")
json.dump(scene, open(path, "w"))

base = sph.Exec.SimulatorBase()
t0 = time.perf_counter()
base.init(useGui=False, sceneFile=path, outputDir=os.path.join(work, "out"), useCache=False,
          initialPause=False, stopAt=args.until)
stamps, sim_t = [], []


def cb():
    stamps.append(time.perf_counter())
    sim_t.append(sph.TimeManager.getCurrent().getTime())


base.setTimeStepCB(cb)
base.initSimulation()
base.setValueFloat(base.STOP_AT, args.until)
init_s = time.perf_counter() - t0
sim = sph.Simulation.getCurrent()
n = sim.getFluidModel(0).numActiveParticles()
t0 = time.perf_counter()
base.runSimulation()
wall = time.perf_counter() - t0
d = [b - a for a, b in zip(stamps, stamps[1:])]
steady = d[len(d) // 3:]
m = median(steady)
x = [list(sim.getFluidModel(0).getPosition(i)) for i in range(0, n, 7)]
emit(peer="pysplishsplash", scene="sph", variant=args.method + ("/cfl" if args.cfl else "/fixed"), particles=int(n),
     threads=args.threads, substep_dt=(sim_t[-1] - sim_t[0]) / max(1, len(sim_t) - 1), timed_steps=len(steady),
     substep_ms=1e3 * m, ns_per_particle_substep=1e9 * m / n, wall_per_sim_s=wall / sim_t[-1], sim_s=sim_t[-1],
     init_s=init_s, peak_rss_mb=peak_rss_mb(), y_min=min(p[1] for p in x), y_max=max(p[1] for p in x),
     x_max=max(p[0] for p in x))
