"""Trains the autoencoder on clips: L1 of colours and of their differences, and a small Kullback-Leibler term.

    python fit_vae.py --work DIR --minutes M --seed S

Goes on from DIR/vae.pt if it is there. M counts time in which two cores are busy; the learning rate follows the share
that is used. Losses go to DIR/vae.csv. At the end the statistics of the latents are measured and kept with the weights.
"""

import argparse
import math
import pathlib
import time

import numpy as np
import torch

import store
from data import Clips, spoil, to_tensor, vary
from layers import to_patches
from vae import PATCH_CHANNELS, Vae

THREADS = 2
LEARNING_RATE = 1e-3
KL_WEIGHT = 3e-4


def batch(clips, rng, progress):
    """f32 [B, 3, T, 64, 64]; short clips at first, as they are cheap, whole ones at the end."""
    count, frames = (4, 9) if progress < 0.4 else (4, 17) if progress < 0.9 else (2, 37)
    out = []
    for _ in range(count):
        start = rng.integers(0, 37 - frames + 1)
        clip = np.array(vary(clips.random(rng)[start : start + frames], rng))
        if rng.random() < 0.15:
            spoil(clip, rng)
        out.append(clip)
    return to_tensor(np.stack(out)).contiguous(memory_format=torch.channels_last_3d)


def loss_of(vae, video):
    """The loss and the mean absolute error."""
    mean, log_variance = vae.encoder(video)
    latent = mean + (0.5 * log_variance).exp() * torch.randn_like(mean)
    error = vae.decoder(latent) - video
    across, down = error.diff(dim=4).abs().mean(), error.diff(dim=3).abs().mean()
    kl = 0.5 * (mean.square() + log_variance.exp() - 1 - log_variance).mean()
    plain = error.abs().mean()
    return plain + 0.5 * (across + down) + KL_WEIGHT * kl, plain, kl


def some_patches(clips, rng, count):
    """f32 [N, 768] of `count` clips, for the principal components."""
    patches = torch.cat([to_patches(to_tensor(vary(clips.random(rng), rng)[None])) for _ in range(count)])
    return patches.transpose(0, 1).reshape(PATCH_CHANNELS, -1).T


@torch.no_grad()
def psnr(vae, video):
    """dB over all pixels of each clip, mean over clips."""
    out = [vae.decode(vae.encode(clip[None])) for clip in video]
    square = torch.stack([(a - b).square().mean() / 4 for a, b in zip(out, video)])
    return float((-10 * square.log10()).mean())


@torch.no_grad()
def measure_latents(vae, clips, rng, count):
    """Sets the mean and deviation of every latent channel, over whole clips."""
    vae.latent_mean.zero_()
    vae.latent_std.fill_(1)
    latents = torch.cat([vae.encode(to_tensor(vary(clips.random(rng), rng)[None])) for _ in range(count)])
    vae.latent_mean.copy_(latents.mean((0, 2, 3, 4), keepdim=True))
    vae.latent_std.copy_(latents.std((0, 2, 3, 4), keepdim=True))


def spent():
    """Seconds of THREADS busy cores: other work on the machine must not use up the budget."""
    return time.process_time() / THREADS


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--work", type=pathlib.Path, required=True)
    parser.add_argument("--minutes", type=float, required=True)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    torch.set_num_threads(THREADS)
    torch.manual_seed(options.seed)
    rng = np.random.default_rng(options.seed)

    clips = Clips(options.work / "clips")
    tests = Clips(options.work / "validation").files[0][:8]
    tests = to_tensor(np.array(tests))
    vae = Vae()
    vae.start_from(some_patches(clips, rng, 128))
    vae = vae.to(memory_format=torch.channels_last_3d)
    average = store.Average(vae, 0.998)
    optimiser = torch.optim.AdamW(vae.parameters(), LEARNING_RATE, betas=(0.9, 0.98), weight_decay=1e-3)
    step, used = 0, 0.0
    state = store.load(options.work / "vae.pt")
    if state:
        vae.load_state_dict(state["weights"])
        average.module.load_state_dict(state["average"])
        optimiser.load_state_dict(state["optimiser"])
        step, used = state["step"], state["seconds"]
        rng = np.random.default_rng([options.seed, step])
        if used >= options.minutes * 60:
            print(f"the budget is used: step {step}")
            return

    def keep():
        store.save(
            options.work / "vae.pt", weights=vae.state_dict(), average=average.module.state_dict(),
            optimiser=optimiser.state_dict(), step=step, seconds=used,
        )  # fmt: skip

    log = open(options.work / "vae.csv", "a", buffering=1)
    kept, last = time.time(), spent()
    while used < options.minutes * 60:
        progress = used / (options.minutes * 60)
        rate = LEARNING_RATE * min(1, (step + 1) / 100) * (0.02 + 0.98 * 0.5 * (1 + math.cos(math.pi * progress)))
        for group in optimiser.param_groups:
            group["lr"] = rate
        video = batch(clips, rng, progress)
        with torch.autocast("cpu", torch.bfloat16):
            loss, plain, kl = loss_of(vae, video)
        optimiser.zero_grad()
        loss.backward()
        torch.nn.utils.clip_grad_norm_(vae.parameters(), 1.0)
        optimiser.step()
        step += 1
        average.update(vae, step)
        used, last = used + (spent() - last), spent()
        if step % 10 == 0:
            log.write(f"{step},{used:.0f},{rate:.2e},{loss.item():.5f},{plain.item():.5f},{kl.item():.3f}\n")
        if time.time() - kept > 60:
            clips.refresh()
            keep()
            print(
                f"step {step}, {used / 60:.1f} min, loss {loss.item():.4f}, "
                f"held-out {psnr(average.module, tests):.2f} dB",
                flush=True,
            )
            kept, last = time.time(), spent()
    measure_latents(average.module, clips, np.random.default_rng(options.seed), 128)
    keep()
    print(f"done: step {step}, {len(clips.files)} files, held-out {psnr(average.module, tests):.2f} dB")


if __name__ == "__main__":
    main()
