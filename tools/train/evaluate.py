"""Algorithm 1 over held-out clips with the exported files, measured against the truth.

    python evaluate.py --models DIR --held-out DIR --seeds 3 [--pictures DIR] [--json FILE]

Rows of the tables: `raw` the point render; `ceiling` the truth through the autoencoder, the best any latent can give;
`N = 0` inversion and generation only; `N = 10` with ten iterations; `N = 10, -v` with the wrong sign of v. Frame 0 is
given and not counted. The mask is where the render moves or is unknown, grown by 3 pixels. `tracking` is described in
metrics.py; its floor, what block matching gives on the truth itself, is the row `truth`.
"""

import argparse
import json
import pathlib

import numpy as np
import onnxruntime
import torch

import metrics
from data import to_frames, to_tensor
from flow import GAMMA, INVERTED, STEPS, algorithm_1, pool_covered, pool_touched
from pictures import write_sheet

GROWN = 3  # pixels


class Models:
    """The three files behind functions of tensors."""

    def __init__(self, folder):
        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads = 2
        options.add_session_config_entry("session.intra_op.allow_spinning", "0")
        open_file = lambda name: onnxruntime.InferenceSession(str(folder / name), options)  # noqa: E731
        self.encoder, self.decoder, self.velocity = map(open_file, ("encode.onnx", "decode.onnx", "velocity.onnx"))

    def encode(self, frames):
        return torch.from_numpy(self.encoder.run(None, {"video": to_tensor(frames[None]).contiguous().numpy()})[0])

    def decode(self, latent):
        return to_frames(torch.from_numpy(self.decoder.run(None, {"latent": latent.numpy()})[0])[0])

    def predict(self, x, sigma):
        return torch.from_numpy(self.velocity.run(None, {"x": x.numpy(), "sigma": sigma.numpy()})[0])


def read_clip(folder):
    clip = {name: np.load(folder / f"{name}.npy") for name in ("truth", "raw", "mask", "background", "tracks")}
    return clip | json.loads((folder / "clip.json").read_text())


def measures(video, clip, where):
    """Every figure of one video; frame 0 is left out."""
    truth, later = clip["truth"], slice(1, None)
    return {
        "psnr": metrics.psnr(video[later], truth[later]),
        "psnr_mask": metrics.psnr(video[later], truth[later], where[later]),
        "ssim_mask": metrics.ssim(video[later], truth[later], where[later]),
        "tracking": metrics.tracking_error(video, clip["tracks"]),
    }


def run_clip(models, clip, seeds, gamma, grow, inverted, iterations=10):
    """Row name -> (list of figures by seed, a video), for one clip."""
    act, truth, covered = clip["act"], clip["truth"], clip["mask"] > 0
    where = metrics.grown(covered if act == "animate" else ~covered, GROWN)
    z, image = models.encode(clip["raw"]), models.encode(truth[:1])
    background = models.encode(np.repeat(clip["background"][None], len(truth), 0))
    mask = torch.from_numpy(covered)
    mask = pool_touched(mask, grow) if act == "animate" else pool_covered(mask)
    rows = {"truth": [truth], "raw": [clip["raw"]], "ceiling": [models.decode(models.encode(truth))]}
    ways = {"N = 0": (0, False), f"N = {iterations}": (iterations, False), f"N = {iterations}, -v": (iterations, True)}
    for name, (count, flip) in ways.items():
        rows[name] = [
            models.decode(
                algorithm_1(models.predict, z, image, background, mask, act, count, seed, gamma, flip, inverted)
            )
            for seed in range(seeds)
        ]
    return {name: ([measures(video, clip, where) for video in videos], videos[0]) for name, videos in rows.items()}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--models", type=pathlib.Path, required=True)
    parser.add_argument("--held-out", type=pathlib.Path, required=True)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--gamma", type=float, default=GAMMA)
    parser.add_argument("--inverted", type=int, default=INVERTED, help=f"of {STEPS} steps, up to tau")
    parser.add_argument("--grow", type=int, default=1, help="latents of 8 pixels around what moves that are drawn anew")
    parser.add_argument("--pictures", type=pathlib.Path)
    parser.add_argument("--json", type=pathlib.Path)
    options = parser.parse_args()
    models = Models(options.models)
    results = {"animate": [], "reconstruct": []}
    for folder in sorted(path for path in options.held_out.iterdir() if path.is_dir()):
        clip = read_clip(folder)
        rows = run_clip(models, clip, options.seeds, options.gamma, options.grow, options.inverted)
        results[clip["act"]].append({"clip": folder.name} | {name: figures for name, (figures, _) in rows.items()})
        if options.pictures:
            options.pictures.mkdir(parents=True, exist_ok=True)
            write_sheet(options.pictures / f"{folder.name}.png", [video for _, video in rows.values()])

    for act, clips in results.items():
        settings = f"{options.inverted} of {STEPS} steps, gamma {options.gamma}"
        print(f"\n{act}: {len(clips)} clips, {options.seeds} seeds, {settings}")
        print(f"{'':12} PSNR dB  in mask  SSIM in mask  tracking px  better than N = 0 (in mask, clips)")
        for name in [key for key in clips[0] if key != "clip"] if clips else []:
            mean = {
                key: np.nanmean([np.mean([seed[key] for seed in clip[name]]) for clip in clips])
                for key in ("psnr", "psnr_mask", "ssim_mask", "tracking")
            }
            score = lambda clip, row: np.mean([seed["psnr_mask"] for seed in clip[row]])  # noqa: E731
            wins = sum(score(clip, name) > score(clip, "N = 0") for clip in clips)
            print(
                f"{name:12} {mean['psnr']:7.2f}  {mean['psnr_mask']:7.2f}  {mean['ssim_mask']:12.3f}  "
                f"{mean['tracking']:11.2f}  {wins}/{len(clips)}"
            )
    if options.json:
        options.json.write_text(json.dumps(results, indent=1) + "\n")


if __name__ == "__main__":
    main()
