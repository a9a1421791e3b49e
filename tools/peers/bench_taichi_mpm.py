"""The same algorithm written plainly in Taichi: MLS-MPM, quadratic B-splines, APIC, fixed-corotated by SVD or
neo-Hookean, dense grid, one atomic addition per node component, f32. An elastic cube falls at first 1 m/s.

  python bench_taichi_mpm.py --arch cpu    --grid 128 --n 50000 --threads 2
  python bench_taichi_mpm.py --arch vulkan --grid 128 --n 50000
"""
import argparse
import time

import numpy as np
import taichi as ti

from common import emit, median, peak_rss_mb

ap = argparse.ArgumentParser()
ap.add_argument("--arch", default="cpu", choices=["cpu", "vulkan"])
ap.add_argument("--grid", type=int, default=128)
ap.add_argument("--n", type=int, default=50000)
ap.add_argument("--threads", type=int, default=2)
ap.add_argument("--model", default="corotated", choices=["neohookean", "corotated"])
ap.add_argument("--order", default="lattice", choices=["lattice", "shuffled"])
ap.add_argument("--density", type=float, default=40.0)
ap.add_argument("--dt", type=float, default=1e-4, help="substep [s]; 0: 0.3 dx / c")
ap.add_argument("--steps", type=int, default=60)
ap.add_argument("--warm", type=int, default=100)
args = ap.parse_args()

kw = dict(offline_cache=False, default_fp=ti.f32, log_level=ti.WARN)
if args.arch == "cpu":
    kw["cpu_max_num_threads"] = args.threads
t0 = time.perf_counter()
ti.init(arch=getattr(ti, args.arch), **kw)
init_s = time.perf_counter() - t0

G, n = args.grid, args.n
dx, inv_dx = 1.0 / G, float(G)
E, nu, rho = 8e4, 0.32, args.density
mu, lam = E / (2 * (1 + nu)), E * nu / ((1 + nu) * (1 - 2 * nu))
c = ((lam + 2 * mu) / rho) ** 0.5
dt = args.dt if args.dt else 0.3 * dx / c
h = 0.5 * dx                                  # 8 particles per cell
vol, mass = h ** 3, rho * h ** 3
side = int(np.ceil(n ** (1 / 3)))
lat = np.stack(np.meshgrid(*[np.arange(side)] * 3, indexing="ij"), -1).reshape(-1, 3)[:n]
p0 = ((lat + 0.5) * h + np.array([0.5 - side * h / 2, 0.5 - side * h / 2, 4 * dx])).astype(np.float32)
if args.order == "shuffled":
    p0 = p0[np.random.default_rng(0).permutation(n)]

x = ti.Vector.field(3, ti.f32, n)
v = ti.Vector.field(3, ti.f32, n)
C = ti.Matrix.field(3, 3, ti.f32, n)
F = ti.Matrix.field(3, 3, ti.f32, n)
gv = ti.Vector.field(3, ti.f32, (G, G, G))
gm = ti.field(ti.f32, (G, G, G))


@ti.kernel
def init():
    for p in x:
        F[p] = ti.Matrix.identity(ti.f32, 3)


@ti.kernel
def clear():
    for I in ti.grouped(gm):
        gv[I] = ti.Vector.zero(ti.f32, 3)
        gm[I] = 0.0


@ti.kernel
def p2g():
    for p in x:
        Fp = (ti.Matrix.identity(ti.f32, 3) + dt * C[p]) @ F[p]
        F[p] = Fp
        J = Fp.determinant()
        tau = ti.Matrix.zero(ti.f32, 3, 3)    # Kirchhoff stress P F^T
        if ti.static(args.model == "neohookean"):
            tau = mu * (Fp @ Fp.transpose()) + ti.Matrix.identity(ti.f32, 3) * (lam * ti.log(ti.max(J, 1e-6)) - mu)
        else:
            U, S, V = ti.svd(Fp)
            R = U @ V.transpose()
            tau = 2 * mu * (Fp - R) @ Fp.transpose() + ti.Matrix.identity(ti.f32, 3) * lam * J * (J - 1)
        A = (-dt * vol * 4 * inv_dx * inv_dx) * tau + mass * C[p]
        base = (x[p] * inv_dx - 0.5).cast(int)
        fx = x[p] * inv_dx - base.cast(float)
        w = [0.5 * (1.5 - fx) ** 2, 0.75 - (fx - 1) ** 2, 0.5 * (fx - 0.5) ** 2]
        mv = mass * v[p]
        for i, j, k in ti.static(ti.ndrange(3, 3, 3)):
            d = (ti.Vector([i, j, k]).cast(float) - fx) * dx
            wt = w[i][0] * w[j][1] * w[k][2]
            I = base + ti.Vector([i, j, k])
            gv[I] += wt * (mv + A @ d)
            gm[I] += wt * mass


@ti.kernel
def grid_op():
    for i, j, k in gm:
        m = gm[i, j, k]
        if m > 0:
            u = gv[i, j, k] / m
            u[2] -= dt * 9.81
            if i < 3 and u[0] < 0: u[0] = 0
            if i > G - 3 and u[0] > 0: u[0] = 0
            if j < 3 and u[1] < 0: u[1] = 0
            if j > G - 3 and u[1] > 0: u[1] = 0
            if k < 3 and u[2] < 0: u = ti.Vector.zero(ti.f32, 3)
            if k > G - 3 and u[2] > 0: u[2] = 0
            gv[i, j, k] = u


@ti.kernel
def g2p():
    for p in x:
        base = (x[p] * inv_dx - 0.5).cast(int)
        fx = x[p] * inv_dx - base.cast(float)
        w = [0.5 * (1.5 - fx) ** 2, 0.75 - (fx - 1) ** 2, 0.5 * (fx - 0.5) ** 2]
        nv = ti.Vector.zero(ti.f32, 3)
        nC = ti.Matrix.zero(ti.f32, 3, 3)
        for i, j, k in ti.static(ti.ndrange(3, 3, 3)):
            d = ti.Vector([i, j, k]).cast(float) - fx
            g = gv[base + ti.Vector([i, j, k])]
            wt = w[i][0] * w[j][1] * w[k][2]
            nv += wt * g
            nC += (4 * inv_dx * wt) * g.outer_product(d)
        v[p], C[p] = nv, nC
        x[p] += dt * nv


x.from_numpy(p0)
v.from_numpy(np.tile(np.float32([0, 0, -1.0]), (n, 1)))
init()
t0 = time.perf_counter()
for k in (clear, p2g, grid_op, g2p):
    k()
ti.sync()
compile_s = time.perf_counter() - t0
for _ in range(args.warm):
    clear(); p2g(); grid_op(); g2p()
ti.sync()
T = {k: [] for k in ("clear", "p2g", "grid", "g2p")}
for _ in range(args.steps):
    for name, k in (("clear", clear), ("p2g", p2g), ("grid", grid_op), ("g2p", g2p)):
        a = time.perf_counter(); k(); ti.sync(); T[name].append(time.perf_counter() - a)
tot = []
for _ in range(6):                            # as the user would run it: no sync between kernels
    a = time.perf_counter()
    for _ in range(10):
        clear(); p2g(); grid_op(); g2p()
    ti.sync(); tot.append((time.perf_counter() - a) / 10)
xs = x.to_numpy()
simulated_s = dt * (1 + args.warm + args.steps + 60)
m = {k: median(t) for k, t in T.items()}
emit(peer="taichi", version=".".join(map(str, ti.__version__)), scene="mpm", variant=f"{args.model}/{args.order}",
     arch=args.arch, threads=args.threads if args.arch == "cpu" else 0, grid=G, particles=n, substep_dt=dt,
     substep_ms=1e3 * median(tot), ns_per_particle_substep=1e9 * median(tot) / n, wall_s_per_simulated_s=median(tot) / dt,
     clear_ms=1e3 * m["clear"], p2g_ms=1e3 * m["p2g"], grid_ms=1e3 * m["grid"], g2p_ms=1e3 * m["g2p"],
     p2g_ns=1e9 * m["p2g"] / n, g2p_ns=1e9 * m["g2p"] / n, grid_ns_per_cell=1e9 * (m["clear"] + m["grid"]) / G ** 3,
     init_s=init_s, compile_s=compile_s, peak_rss_mb=peak_rss_mb(),
     finite=bool(np.isfinite(xs).all()), simulated_s=simulated_s, fall_m=float(p0[:, 2].mean() - xs[:, 2].mean()), z_min=float(xs[:, 2].min()), z_max=float(xs[:, 2].max()))
