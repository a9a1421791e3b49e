"""Trains the velocity network on cached latents: squared error of eps - x0.

    python fit_flow.py --work DIR --minutes M --seed S

Goes on from DIR/flow.pt if it is there; losses go to DIR/flow.csv. The weights that count are a moving average.
"""

import argparse
import pathlib
import time

import numpy as np
import torch

import store
from flow import SHIFT, condition, shifted
from unet import Velocity

THREADS = 2
LEARNING_RATE = 1e-3
BATCH = 8
DROPPED = 0.1  # share of clips whose image is hidden, so that the network also knows videos without one


class Latents:
    """All cached latents, f16 [N, 16, 10, 8, 8] each file."""

    def __init__(self, folder):
        self.folder, self.files, self.names = folder, [], set()
        self.refresh()

    def refresh(self):
        for path in sorted(self.folder.glob("latents-*.npy")):
            if path.name not in self.names and ".part" not in path.name:
                self.names.add(path.name)
                self.files.append(np.load(path))

    def batch(self, rng, count):
        out = []
        for _ in range(count):
            file = self.files[rng.integers(len(self.files))]
            out.append(file[rng.integers(len(file))])
        return torch.from_numpy(np.stack(out)).float()

    def spread(self):
        """Root mean square [1, 16, 1, 1, 1] of a latent's difference from that of the image."""
        some = torch.from_numpy(np.concatenate(self.files[:4])).float()
        return (some[:, :, 1:] - some[:, :, :1]).square().mean((0, 2, 3, 4), keepdim=True).sqrt().clamp(min=0.05)


def loss_of(velocity, x0, sigma, eps, kept):
    """Squared error per clip [B]; `kept` [B] is 1 where the network sees the image."""
    s = sigma[:, None, None, None, None]
    z = (1 - s) * x0 + s * eps
    prediction = velocity(condition(z, x0[:, :, :1], kept), sigma)
    return (prediction - (eps - x0)).square().mean((1, 2, 3, 4))


def validation(velocity, latents):
    """The loss at fixed noise levels over fixed clips, and the same at the level of Algorithm 1."""
    generator = torch.Generator().manual_seed(5)
    x0 = torch.from_numpy(latents).float()
    eps = torch.randn(x0.shape, generator=generator)
    kept = torch.ones(len(x0))
    sigma = shifted((torch.arange(len(x0)) + 0.5) / len(x0))
    with torch.no_grad(), torch.autocast("cpu", torch.bfloat16):
        mixed = loss_of(velocity, x0, sigma, eps, kept).mean()
        fixed = loss_of(velocity, x0, torch.full_like(sigma, 0.902), eps, kept).mean()
    return float(mixed), float(fixed)


def spent():
    """Seconds of THREADS busy cores: other work on the machine must not use up the budget."""
    return time.process_time() / THREADS


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--work", type=pathlib.Path, required=True)
    parser.add_argument("--minutes", type=float, required=True)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--compile", action="store_true", help="a quarter faster; needs a C++ compiler")
    options = parser.parse_args()
    torch.set_num_threads(THREADS)
    torch.manual_seed(options.seed)
    latents = Latents(options.work / "latents")
    tests = np.load(options.work / "validation-latents.npy")[:32]
    velocity = Velocity().to(memory_format=torch.channels_last_3d)
    velocity.spread.copy_(latents.spread())
    average = store.Average(velocity, 0.998)
    optimiser = torch.optim.AdamW(velocity.parameters(), LEARNING_RATE, betas=(0.9, 0.98), weight_decay=1e-2)
    step, used = 0, 0.0
    state = store.load(options.work / "flow.pt")
    if state:
        velocity.load_state_dict(state["weights"])
        average.module.load_state_dict(state["average"])
        optimiser.load_state_dict(state["optimiser"])
        step, used = state["step"], state["seconds"]
    rng = np.random.default_rng([options.seed, step])
    torch.manual_seed(options.seed + step)

    def keep():
        store.save(
            options.work / "flow.pt", weights=velocity.state_dict(), average=average.module.state_dict(),
            optimiser=optimiser.state_dict(), step=step, seconds=used,
        )  # fmt: skip

    fast = torch.compile(velocity) if options.compile else velocity
    log = open(options.work / "flow.csv", "a", buffering=1)
    kept, last, mean = time.time(), spent(), None
    while used < options.minutes * 60:
        progress = used / (options.minutes * 60)
        # Constant, then straight down: the last third does most of the settling.
        rate = LEARNING_RATE * min(1, (step + 1) / 200) * min(1, 0.02 + 0.98 * (1 - progress) / 0.4)
        for group in optimiser.param_groups:
            group["lr"] = rate
        x0 = latents.batch(rng, BATCH)
        # One noise level from each of BATCH equal shares: less noise in the gradient for nothing.
        sigma = shifted((torch.randperm(BATCH) + torch.rand(BATCH)) / BATCH)
        shown = (torch.rand(BATCH) >= DROPPED).float()
        with torch.autocast("cpu", torch.bfloat16):
            loss = loss_of(fast, x0, sigma, torch.randn_like(x0), shown).mean()
        optimiser.zero_grad()
        loss.backward()
        torch.nn.utils.clip_grad_norm_(velocity.parameters(), 1.0)
        optimiser.step()
        step += 1
        average.update(velocity, step)
        mean = loss.item() if mean is None else 0.98 * mean + 0.02 * loss.item()
        used, last = used + (spent() - last), spent()
        if step % 20 == 0:
            log.write(f"{step},{used:.0f},{rate:.2e},{mean:.5f}\n")
        if time.time() - kept > 90:
            latents.refresh()
            keep()
            mixed, fixed = validation(average.module, tests)
            print(
                f"step {step}, {used / 60:.1f} min, loss {mean:.4f}, held-out {mixed:.4f}, at sigma 0.902 {fixed:.4f}",
                flush=True,
            )
            kept, last = time.time(), spent()
    keep()
    print(f"done: step {step}, {len(latents.files)} files, shift {SHIFT}, held-out {validation(average.module, tests)}")


if __name__ == "__main__":
    main()
