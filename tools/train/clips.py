"""Clips of random scenes: what a camera would film, and what the engine's point renderer would draw of it.

    python clips.py --held-out DIR --count N --seed S      folders for tests, both acts in turn
    python clips.py --training DIR --count N --seed S      one .npy of uint8 [N, 37, 64, 64, 3], truth only

A clip is its seed: the same number gives the same clip.
"""

import argparse
import json
import pathlib

import numpy as np

import render
from render import FIRST_BODY, SIZE
from scene import FRAMES, random_scene

POINTS = 16
ACTS = ("animate", "reconstruct")


def moved_points(scene, truth, rng):
    """The engine's view of an `animate` clip: raw frames, masks, and the background without what moves.

    Each moving body keeps the colours the photograph (frame 0) shows of it: a point of its surface has the colour of
    the pixel it lies behind in frame 0, light and shadow included. Nothing is antialiased and pixels are missing.
    """
    frames = np.arange(FRAMES)
    still = [number for number in range(len(scene.bodies)) if number not in scene.moving]
    background = render.video(scene, [0], still)[0]
    hits = render.cast(scene, frames, SIZE, range(len(scene.bodies)))
    surface, point = hits.surface.reshape(FRAMES, SIZE, SIZE), hits.point.reshape(FRAMES, SIZE, SIZE, 3)
    raw, mask = np.repeat(background[None], FRAMES, 0), np.zeros((FRAMES, SIZE, SIZE), np.uint8)
    for number in scene.moving:
        seen = surface == FIRST_BODY + number
        shown = surface[0] == FIRST_BODY + number
        plain = truth[0][shown].mean(0) if shown.any() else np.full(3, 128)
        for frame in frames:
            y, x = np.nonzero(seen[frame])
            local = (point[frame, y, x] - scene.centres[number, frame]) @ scene.turns[number, frame]
            at, _ = render.project(scene, 0, local @ scene.turns[number, 0].T + scene.centres[number, 0])
            column, row = np.clip(at.astype(int), 0, SIZE - 1).T
            known = shown[row, column]
            colours = np.where(known[:, None], truth[0][row, column], plain).astype(np.uint8)
            inner = np.pad(seen[frame], 1)
            edge = ~(inner[:-2, 1:-1] & inner[2:, 1:-1] & inner[1:-1, :-2] & inner[1:-1, 2:])[y, x]
            drawn = rng.random(len(y)) > np.where(edge, 0.2, 0.02) * (frame > 0)
            raw[frame, y[drawn], x[drawn]] = colours[drawn]
            mask[frame, y[drawn], x[drawn]] = 1
    return raw, mask, background


def warped_points(scene, truth):
    """The engine's view of a `reconstruct` clip: the pixels of frame 0, at their depth, seen from each camera.

    Four points a pixel, as a mesh would have no gaps where the camera comes nearer; single missing pixels are filled.
    """
    fine = 2 * SIZE
    hits = render.cast(scene, np.arange(1), fine, range(len(scene.bodies)))
    colours = truth[0].repeat(2, 0).repeat(2, 1).reshape(-1, 3)
    raw, mask = np.zeros_like(truth), np.zeros(truth.shape[:3], np.uint8)
    for frame in range(FRAMES):
        at, depth = render.project(scene, frame, hits.point[0])
        inside = (at >= 0).all(1) & (at < SIZE).all(1)
        column, row = at[inside].astype(int).T
        far_first = np.argsort(-depth[inside], kind="stable")
        raw[frame, row[far_first], column[far_first]] = colours[inside][far_first]
        mask[frame, row, column] = 1
        around = np.pad(mask[frame], 1)
        shifts = [
            (slice(0, -2), slice(1, -1)),
            (slice(2, None), slice(1, -1)),
            (slice(1, -1), slice(0, -2)),
            (slice(1, -1), slice(2, None)),
        ]
        count = sum(around[s].astype(int) for s in shifts)
        lone = (mask[frame] == 0) & (count >= 3)
        sums = sum(np.pad(raw[frame], ((1, 1), (1, 1), (0, 0)))[s].astype(int) for s in shifts)
        raw[frame][lone] = (sums[lone] / count[lone][:, None]).astype(np.uint8)
        mask[frame][lone] = 1
    return raw, mask


def tracks(scene, act, rng):
    """float32 [K, F, 3]: x, y in pixels and whether seen, of points that frame 0 shows.

    They are on moving bodies; where nothing moves, on any body.
    """
    hits = render.cast(scene, np.arange(FRAMES), SIZE, range(len(scene.bodies)))
    surface, depths = hits.surface.reshape(FRAMES, SIZE, SIZE), hits.depth.reshape(FRAMES, SIZE, SIZE)
    wanted = [FIRST_BODY + n for n in (scene.moving if act == "animate" else range(len(scene.bodies)))]
    # Not on the rim, where a tracker would hold on to what lies behind.
    inner = np.isin(surface[0], wanted)
    for axis in (0, 1):
        for step in (-2, -1, 1, 2):
            inner &= np.roll(surface[0], step, axis) == surface[0]
    inner[[0, 1, -2, -1]] = inner[:, [0, 1, -2, -1]] = False
    places = np.argwhere(inner)
    if len(places) == 0:
        return np.zeros((0, FRAMES, 3), np.float32)
    places = places[rng.permutation(len(places))[:POINTS]]
    out = np.zeros((len(places), FRAMES, 3), np.float32)
    for track, (row, column) in enumerate(places):
        number = int(surface[0, row, column]) - FIRST_BODY
        local = (hits.point[0, row * SIZE + column] - scene.centres[number, 0]) @ scene.turns[number, 0]
        for frame in range(FRAMES):
            world = scene.turns[number, frame] @ local + scene.centres[number, frame]
            at, depth = render.project(scene, frame, world[None])
            out[track, frame, :2] = at[0]
            x, y = np.floor(at[0]).astype(int)
            if 0 <= x < SIZE and 0 <= y < SIZE:
                same = surface[frame, y, x] == FIRST_BODY + number
                out[track, frame, 2] = same and abs(depths[frame, y, x] - depth[0]) < 0.08
    return out


def write_held_out(folder, seed, act):
    """One clip as a folder of arrays, and its truth."""
    scene, rng = random_scene(seed, act), np.random.default_rng([seed, 1])
    truth = render.video(scene)
    if act == "animate":
        raw, mask, background = moved_points(scene, truth, rng)
    else:
        (raw, mask), background = warped_points(scene, truth), truth[0]
    arrays = {"truth": truth, "raw": raw, "mask": mask, "background": background, "tracks": tracks(scene, act, rng)}
    folder.mkdir(parents=True, exist_ok=True)
    for name, array in arrays.items():
        np.save(folder / f"{name}.npy", np.ascontiguousarray(array))
    (folder / "clip.json").write_text(json.dumps({"act": act, "seed": seed}) + "\n")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    goal = parser.add_mutually_exclusive_group(required=True)
    goal.add_argument("--held-out", type=pathlib.Path)
    goal.add_argument("--training", type=pathlib.Path)
    parser.add_argument("--count", type=int, required=True)
    parser.add_argument("--seed", type=int, required=True)
    options = parser.parse_args()
    seeds = range(options.seed, options.seed + options.count)
    if options.held_out:
        for number, seed in enumerate(seeds):
            write_held_out(options.held_out / f"{number:03}", seed, ACTS[number % 2])
        return
    options.training.mkdir(parents=True, exist_ok=True)
    path = options.training / f"clips-{options.seed}.npy"
    if path.exists():
        return
    clips = np.stack([render.video(random_scene(seed, ACTS[seed % 2])) for seed in seeds])
    np.save(path.with_suffix(".part.npy"), clips)
    path.with_suffix(".part.npy").rename(path)


if __name__ == "__main__":
    main()
