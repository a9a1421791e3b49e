"""Point rendering baselines on the CPU, one frame = project + depth-tested splat of N coloured points.

  python bench_points.py --n 1000000 --size 1280x720
Methods: numpy (sort by depth, last write wins), numpy with square 3 px footprints, torch scatter_reduce amin on a
packed depth/index key.
"""
import argparse
import os
import time

ap = argparse.ArgumentParser()
ap.add_argument("--n", type=int, default=1000000)
ap.add_argument("--size", default="1280x720")
ap.add_argument("--threads", type=int, default=2)
ap.add_argument("--frames", type=int, default=15)
ap.add_argument("--methods", default="numpy1,numpy3,torch1,torch3")
args = ap.parse_args()
os.environ["OMP_NUM_THREADS"] = str(args.threads)

import numpy as np  # noqa: E402

from common import emit, median, peak_rss_mb  # noqa: E402

W, H = map(int, args.size.split("x"))
rng = np.random.default_rng(0)
P = (rng.random((args.n, 3), np.float32) - 0.5)
COL = (rng.random((args.n, 3)) * 255).astype(np.uint8)
f = 0.9 * H


def view(k):
    a = 0.05 * k
    c, s = np.float32(np.cos(a)), np.float32(np.sin(a))
    return np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]], np.float32), np.array([0, 0, 2.0], np.float32)


def project(k):
    R, t = view(k)
    q = P @ R.T + t
    iz = 1.0 / q[:, 2]
    return (q[:, 0] * iz * f + W / 2).astype(np.int32), (q[:, 1] * iz * f + H / 2).astype(np.int32), q[:, 2]


def np_splat(k, foot):
    u, v, z = project(k)
    r = foot // 2
    o = np.argsort(-z)                      # far to near: the last write wins
    u, v, c = u[o], v[o], COL[o]
    img = np.zeros((H, W, 3), np.uint8)
    if foot == 1:
        m = (u >= 0) & (u < W) & (v >= 0) & (v < H)
        img[v[m], u[m]] = c[m]
        return img
    # exact footprints: expand all offsets, keep depth order
    du, dv = np.meshgrid(np.arange(-r, r + 1), np.arange(-r, r + 1))
    uu = (u[:, None] + du.ravel()[None]).ravel()
    vv = (v[:, None] + dv.ravel()[None]).ravel()
    cc = np.repeat(np.arange(len(u)), foot * foot)
    m = (uu >= 0) & (uu < W) & (vv >= 0) & (vv < H)
    img[vv[m], uu[m]] = c[cc[m]]
    return img


def run(name, fn, extra=None):
    a = time.perf_counter()
    img = fn(0)
    first = time.perf_counter() - a
    T = []
    for k in range(1, args.frames + 1):
        a = time.perf_counter()
        img = fn(k)
        T.append(time.perf_counter() - a)
        if sum(T) > 25:
            break
    img = np.asarray(img)
    cov = float((img.reshape(H, W, -1)[..., :3].sum(-1) > 0).mean())
    emit(peer="render", scene="points", variant=name, particles=args.n, size=args.size, threads=args.threads,
         frame_ms=1e3 * median(T), ns_per_point=1e9 * median(T) / args.n, first_frame_s=first, timed_steps=len(T),
         coverage=cov, peak_rss_mb=peak_rss_mb(), **(extra or {}))


M = args.methods.split(",")
if "numpy1" in M:
    run("numpy sort 1px", lambda k: np_splat(k, 1))
if "numpy3" in M:
    run("numpy sort 3px", lambda k: np_splat(k, 3))
if any(m.startswith("torch") for m in M):
    import torch
    torch.set_num_threads(args.threads)
    tP, tC = torch.from_numpy(P), torch.from_numpy(COL)

    def torch_splat(k, foot):
        R, t = view(k)
        q = tP @ torch.from_numpy(R).T + torch.from_numpy(t)
        z = q[:, 2]
        u = (q[:, 0] / z * f + W / 2).to(torch.int64)
        v = (q[:, 1] / z * f + H / 2).to(torch.int64)
        key = (z.view(torch.int32).to(torch.int64) << 32) | torch.arange(len(z))   # z > 0: bits sort like floats
        buf = torch.full((H * W,), torch.iinfo(torch.int64).max)
        r = foot // 2
        for dv in range(-r, r + 1):
            for du in range(-r, r + 1):
                uu, vv = u + du, v + dv
                m = (uu >= 0) & (uu < W) & (vv >= 0) & (vv < H)
                buf.scatter_reduce_(0, (vv * W + uu)[m], key[m], "amin")
        hit = buf != torch.iinfo(torch.int64).max
        img = torch.zeros((H * W, 3), dtype=torch.uint8)
        img[hit] = tC[buf[hit] & 0xFFFFFFFF]
        return img.view(H, W, 3).numpy()
    if "torch1" in M:
        run("torch z-buffer 1px", lambda k: torch_splat(k, 1))
    if "torch3" in M:
        run("torch z-buffer 3px", lambda k: torch_splat(k, 3))
