"""Trains the decoder further while the encoder stays, so that what the flow network has learned stays true.

    python fit_decoder.py --work DIR --minutes M --seed S

Starts from the averaged weights of DIR/vae.pt and replaces the decoder there. M is counted as in fit_vae.py, losses go
to DIR/decoder.csv. It may run at any time after fit_vae.py, and again.
"""

import argparse
import math
import pathlib

import numpy as np
import torch

import store
from data import Clips, to_tensor
from fit_vae import THREADS, batch, psnr, spent

LEARNING_RATE = 1e-3
NOISE = 0.05  # deviation added to the normalised latents: those of a flow are never exact
LONG_CLIPS = 0.5  # the stage of fit_vae.batch to draw clips from: 17 frames


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--work", type=pathlib.Path, required=True)
    parser.add_argument("--minutes", type=float, required=True)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    torch.set_num_threads(THREADS)
    state = store.load(options.work / "vae.pt")
    clips = Clips(options.work / "clips")
    tests = to_tensor(np.array(Clips(options.work / "validation").files[0][:8]))
    vae, _ = store.load_vae(options.work)
    vae = vae.to(memory_format=torch.channels_last_3d)
    decoder = vae.decoder
    before = state.get("decoder_steps", 0)
    rng = np.random.default_rng([options.seed, 1, before])
    torch.manual_seed(options.seed + before)
    average = store.Average(decoder, 0.99)
    optimiser = torch.optim.AdamW(decoder.parameters(), LEARNING_RATE, betas=(0.9, 0.98), weight_decay=1e-3)

    log = open(options.work / "decoder.csv", "a", buffering=1)
    print(f"before: held-out {psnr(vae, tests):.2f} dB", flush=True)
    step, begun = 0, spent()
    while (progress := (spent() - begun) / (options.minutes * 60)) < 1:
        rate = LEARNING_RATE * min(1, (step + 1) / 50) * 0.5 * (1 + math.cos(math.pi * progress))
        for group in optimiser.param_groups:
            group["lr"] = rate
        video = batch(clips, rng, LONG_CLIPS)
        with torch.autocast("cpu", torch.bfloat16):
            with torch.no_grad():
                latent = vae.encoder(video)[0]
                latent = latent + NOISE * vae.latent_std * torch.randn_like(latent)
            error = decoder(latent) - video
        plain = error.abs().mean()
        across, down, on = (error.diff(dim=axis).abs().mean() for axis in (4, 3, 2))
        # Mean square as well: it is the frames with fast motion that are far off.
        loss = plain + 0.5 * (across + down) + 0.25 * on + 2 * error.square().mean()
        optimiser.zero_grad()
        loss.backward()
        torch.nn.utils.clip_grad_norm_(decoder.parameters(), 1.0)
        optimiser.step()
        step += 1
        average.update(decoder, step)
        if step % 10 == 0:
            log.write(f"{before + step},{spent() - begun:.0f},{rate:.2e},{loss.item():.5f},{plain.item():.5f}\n")
    decoder.load_state_dict(average.module.state_dict())
    state["average"] = vae.state_dict()
    store.save(options.work / "vae.pt", **state | {"decoder_steps": before + step})
    print(f"done: {step} steps of the decoder, held-out {psnr(vae, tests):.2f} dB")


if __name__ == "__main__":
    main()
