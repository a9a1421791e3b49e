"""Turns training clips into latents once, so that the flow network never waits for the encoder.

    python encode_clips.py --work DIR --variants 4

DIR/latents/latents-*.npy: f16 [N, 16, 10, 8, 8], one for each variant of each clip: mirrored, primary colours
exchanged, and, where only the camera moves, run backwards by chance. DIR/validation becomes
DIR/validation-latents.npy, unvaried. Files that exist are kept.
"""

import argparse
import pathlib

import numpy as np
import torch

import store
from data import to_tensor, vary


def encode(vae, clips):
    """f16 [N, 16, 10, 8, 8] of clips uint8 [N, 37, 64, 64, 3]."""
    with torch.no_grad(), torch.autocast("cpu", torch.bfloat16):
        video = to_tensor(np.stack(clips)).contiguous(memory_format=torch.channels_last_3d)
        return vae.encode(video).half().numpy()


def write(path, array):
    """Whole or not at all."""
    part = path.with_suffix(".part.npy")
    np.save(part, array)
    part.rename(path)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--work", type=pathlib.Path, required=True)
    parser.add_argument("--variants", type=int, default=4)
    options = parser.parse_args()
    torch.set_num_threads(2)
    vae, _ = store.load_vae(options.work)
    vae = vae.to(memory_format=torch.channels_last_3d)
    tests = options.work / "validation-latents.npy"
    if not tests.exists():
        clips = np.load(next(iter((options.work / "validation").glob("clips-*.npy"))))
        write(tests, np.concatenate([encode(vae, [clip]) for clip in clips]))
    out = options.work / "latents"
    out.mkdir(exist_ok=True)
    for path in sorted(options.work.glob("clips/clips-*.npy"), key=lambda p: p.stat().st_mtime):
        target = out / path.name.replace("clips", "latents")
        if ".part" in path.name or target.exists():
            continue
        clips, first_seed = np.load(path), int(path.stem.split("-")[1])
        rng, latents = np.random.default_rng(first_seed), []
        for number, clip in enumerate(clips):
            turns = (first_seed + number) % 2 == 1
            some = [vary(clip[::-1] if turns and rng.random() < 0.5 else clip, rng) for _ in range(options.variants)]
            latents.append(encode(vae, some))
        write(target, np.concatenate(latents))
        print(f"{target.name}: {len(clips)} clips", flush=True)


if __name__ == "__main__":
    main()
