"""What each model is given, written straight from its sources (assets/models/README.md), without a look at the manifests.

Each function takes a sample (dict) and a noise level and returns the arguments of Network.reference, before the
embeddings: so a manifest that says something else shows.
"""
import math

import numpy as np


def rounded(array, dtype):
    """The nearest value that `dtype` holds (ties to even), as f64."""
    array = np.asarray(array, dtype=np.float64)
    if dtype == "f16":
        return array.astype(np.float16).astype(np.float64)
    if dtype == "bf16":
        bits = np.atleast_1d(array.astype("<f4")).view("<u4").astype(np.uint64)
        bits = ((bits + 0x7FFF + ((bits >> 16) & 1)) >> 16 << 16).astype("<u4")
        return bits.view("<f4").astype(np.float64).reshape(array.shape)
    return array.astype(np.float32).astype(np.float64)


def framepack(sample, sigma, backward, dtype):
    """diffusers_helper/k_diffusion/wrapper.py, demo_gradio.py (backward) and demo_gradio_f1.py (forward)."""
    z, image, history, padding = sample["z"], sample["image"], sample["history"], sample["padding"]
    window = z.shape[1]
    empty = np.zeros((z.shape[0], 19, *z.shape[2:]))
    if backward:
        parts = np.split(np.arange(1 + padding + window + 19), np.cumsum([1, padding, window, 1, 2]))
        start, _, here, i1, i2, i4 = parts
        c1, c2, c4 = np.split(np.concatenate([history, empty], axis=1)[:, :19], [1, 3], axis=1)
    else:
        start, i4, i2, i1, here = np.split(np.arange(20 + window), np.cumsum([1, 16, 2, 1]))
        c4, c2, c1 = np.split(np.concatenate([empty, image, history], axis=1)[:, -19:], [16, 18], axis=1)
    groups = [
        (np.concatenate([image, c1], axis=1), np.concatenate([start, i1])),
        (c2, i2),
        (c4, i4),
    ]
    return dict(
        x=rounded(z, dtype),
        timestep=rounded(sigma * 1000.0, dtype),
        guidance=float(rounded(sample["guidance"] * 1000.0, dtype)),
        groups=[(rounded(c, dtype), here[:, None] - i[None, :].astype(float)) for c, i in groups],
    )


def wan_i2v(sample, sigma):
    """pipeline_wan_i2v.py: four mask channels, 1 at the photograph; a grey clip; timesteps cut to integers."""
    z = sample["z"]
    mask = np.zeros((4, *z.shape[1:]))
    mask[:, 0] = 1.0
    grey = np.full((3, 4 * (z.shape[1] - 1), *sample["image_frame"].shape[2:]), 0.5)
    clip = sample["encode"](np.concatenate([sample["image_frame"], grey], axis=1))
    return dict(x=np.concatenate([z, mask, rounded(clip, "f32")]), timestep=float(int(sigma * 1000.0)))


def clamped(sample, sigma, rope=None):
    """textimage2video.py, pipeline_ltx_image2video.py: latent 0 is the photograph, its tokens at noise 0."""
    timestep = np.full(sample["z"].shape[1:], rounded(sigma * 1000.0, "f32"))
    timestep[0] = 0.0
    return dict(x=sample["z"], timestep=timestep, rope=rope and rounded(rope, "f32"))


def cogvideox_levels(steps=1000):
    """scheduling_ddim_cogvideox.py with the settings of 5b: a and b of x_t = a x0 + b eps at each timestep."""
    betas = np.linspace(0.00085**0.5, 0.012**0.5, steps) ** 2
    cumulative = np.cumprod(1.0 - betas)  # snr_shift_scale 1 leaves it as it is
    root = np.sqrt(cumulative)
    root = (root - root[-1]) * (root[0] / (root[0] - root[-1]))
    return root, np.sqrt(1.0 - root**2)


def cogvideox(sample, sigma):
    """pipeline_cogvideox_image2video.py: x_t = z / n, the photograph beside it and zeros after it."""
    a, b = cogvideox_levels()
    z = sample["z"]
    image = np.zeros(z.shape)
    image[:, :1] = sample["image"]
    x = np.concatenate([z / np.hypot(1.0 - sigma, sigma), image])
    return dict(x=rounded(x, "f16"), timestep=float(np.argmin(np.abs(b / (a + b) - sigma))))


def towards_data(prediction, z, sigma, vp):
    """v = x0 - eps from what the network answers."""
    if not vp:
        return -prediction
    n = np.hypot(1.0 - sigma, sigma)
    a, b = (1.0 - sigma) / n, sigma / n
    x0, eps = a * (z / n) - b * prediction, b * (z / n) + a * prediction
    return x0 - eps


def shifted(shift, steps, terminal=None):
    """Noise levels from the clean end, [steps+1]; `terminal` as FlowMatchEulerDiscreteScheduler stretches."""
    t = np.arange(1, steps + 1) / steps
    t = shift * t / (1.0 + (shift - 1.0) * t)
    if terminal:
        t = 1.0 - (1.0 - t) / ((1.0 - t[0]) / (1.0 - terminal))
    return np.concatenate([[0.0], t])


def framepack_schedule(t, h, w):
    """k_diffusion_hunyuan.py: calculate_flux_mu, get_flux_sigmas_from_mu."""
    mu = 0.5 + (1.15 - 0.5) / (4096 - 256) * (t * h * w // 4 - 256)
    return shifted(math.exp(min(mu, math.log(7.0))), 25)


def ltx_schedule(t, h, w):
    """pipeline_ltx_image2video.py calculate_shift with the scheduler's 0.95, 2.05, 1024, 4096."""
    return shifted(math.exp(0.95 + (2.05 - 0.95) / (4096 - 1024) * (t * h * w - 1024)), 50, terminal=0.1)


def cogvideox_schedule(t, h, w, steps=50):
    a, b = cogvideox_levels()
    timesteps = np.round(np.arange(1000, 0, -1000 / steps)).astype(int) - 1
    return np.concatenate([[0.0], (b / (a + b))[timesteps[::-1]]])


# grid: latents T, h, w of the sample; clip: frames of the encode test; levels: how many noise levels; size, frames:
# replace those of the manifest.
MODELS = {
    "framepack": dict(
        grid=(9, 2, 4), clip=5, tolerance=2e-5, schedule=framepack_schedule, steps=25,
        inputs=lambda s, sigma: framepack(s, sigma, True, "f32"), history=5, padding=18, dtype="f32",
    ),
    "framepack-f1": dict(
        grid=(9, 2, 4), clip=5, tolerance=2e-5, schedule=framepack_schedule, steps=25,
        inputs=lambda s, sigma: framepack(s, sigma, False, "bf16"), history=5, padding=0, dtype="bf16",
    ),
    "wan2.1-i2v-14b": dict(
        grid=(3, 2, 4), clip=5, tolerance=2e-5, schedule=lambda *_: shifted(3.0, 40), steps=40,
        inputs=wan_i2v, dtype="f32",
    ),
    "wan2.2-ti2v-5b": dict(
        grid=(2, 2, 4), clip=5, tolerance=2e-5, schedule=lambda *_: shifted(5.0, 50), steps=50,
        inputs=clamped, dtype="f32",
    ),
    "ltx-video-2b": dict(
        grid=(2, 2, 3), clip=9, tolerance=2e-5, schedule=ltx_schedule, steps=50,
        inputs=lambda s, sigma: clamped(s, sigma, (8 / 25, 32.0, 32.0)), dtype="f32", levels=1,
    ),
    "cogvideox-5b-i2v": dict(
        grid=(3, 2, 4), clip=5, tolerance=2e-3, schedule=cogvideox_schedule, steps=50,
        inputs=cogvideox, dtype="f16", vp=True, size=(2, 4), frames=9,
    ),
}
