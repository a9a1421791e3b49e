"""Noise levels, the condition, and Algorithm 1 of the paper (consistency-guided flow SDE).

Independent of the engine on purpose: its results are compared with these. sigma is the share of noise in
z = (1 - sigma) x0 + sigma eps. The network predicts eps - x0; the paper's v points to the data and is its negative.
"""

import torch
from torch.nn import functional as F

SHIFT = 2.3
STEPS = 25  # from clean to noise
INVERTED = 20  # of them, up to tau
GAMMA = 0.2


def shifted(t):
    """Noise level of the schedule's time t in [0, 1]."""
    return SHIFT * t / (1 + (SHIFT - 1) * t)


def condition(z, image, kept):
    """The network's input [B, 33, T, h, w]: z, a mask that marks latent 0, the image latent [B, 16, 1, h, w] there.

    Where kept [B] is 0, mask and image are zero.
    """
    after = (0, 0, 0, 0, 0, z.shape[2] - 1)
    kept = kept[:, None, None, None, None]
    mask = F.pad(torch.ones_like(z[:, :1, :1]) * kept, after)
    return torch.cat([z, mask, F.pad(image * kept, after)], 1)


def pool_covered(mask):
    """bool [T, H, W] frames to f32 [1, 1, 1 + k, h, w] latents: 1 where every pixel of all its frames is covered."""
    return 1 - pool_touched(~mask)


def pool_touched(mask, grow=0):
    """bool [T, H, W] frames to f32 [1, 1, 1 + k, h, w] latents: 1 where any pixel is covered, then grown by `grow`."""
    blocks = F.max_pool3d(mask[None, None].float(), (1, 8, 8))
    after = F.max_pool3d(blocks[:, :, 1:], (4, 1, 1)) if mask.shape[0] > 1 else blocks[:, :, 1:]
    pooled = torch.cat([blocks[:, :, :1], after], 2)
    return F.max_pool3d(pooled, (1, 2 * grow + 1, 2 * grow + 1), 1, (0, grow, grow))


@torch.no_grad()
def algorithm_1(predict, z, image, background, mask, act, iterations, seed, gamma=GAMMA, flip=False, inverted=INVERTED):
    """Latents of the final video.

    predict(x, sigma) is the velocity network. z: latents of the raw render [1, 16, T, h, w]. image: latent of the
    photograph [1, 16, 1, h, w]. background: latents of the still background, as z. mask: [1, 1, T, h, w], 1 where the
    render is known (`reconstruct`) or where it moves (`animate`). `flip` uses the wrong sign of v in the SDE, which a
    measure must notice. `inverted` of STEPS steps lead to tau. Solver: Euler both ways.
    """
    generator = torch.Generator().manual_seed(seed)
    kept = torch.ones(1)
    levels = [float(shifted(torch.tensor(i / STEPS))) for i in range(STEPS + 1)]
    tau = levels[inverted]

    def v(z, sigma):
        return -predict(condition(z, image, kept), torch.tensor([sigma]))

    up = z
    for i in range(inverted):
        up = up - (levels[i + 1] - levels[i]) * v(up, levels[i])
    base = z if act == "reconstruct" else background
    noisy = (1 - tau) * base + tau * torch.randn(z.shape, generator=generator)
    z = mask * up + (1 - mask) * noisy
    # Stage 1 redraws what is not covered, stage 2 what moves.
    free = 1 - mask if act == "reconstruct" else mask
    sign = -1 if flip else 1
    for _ in range(iterations):
        noise = torch.randn(z.shape, generator=generator)
        drawn = (1 - gamma / tau) * z + (1 - tau) / tau * gamma * sign * v(z, tau) + (2 * gamma) ** 0.5 * noise
        z = free * drawn + (1 - free) * z
    for i in range(inverted, 0, -1):
        z = z - (levels[i - 1] - levels[i]) * v(z, levels[i])
    return z
