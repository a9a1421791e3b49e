"""The velocity network: a (2+1)D U-Net over latents that predicts eps - x0 from z = (1 - sigma) x0 + sigma eps."""

import math

import torch
from torch import nn
from torch.nn import functional as F

from layers import Norm, channels_to_space, space_conv, zeroed
from vae import LATENT_CHANNELS

SIGMA_WIDTH = 96
FRAME_WAVES = (4.0, 8.0, 16.0, 32.0, 64.0)  # periods, in latents, of the code that tells a latent its place in time


class Block(nn.Module):
    """x + a convolution in space and one over time, scaled and shifted by the noise level."""

    def __init__(self, inputs, channels):
        super().__init__()
        self.skip = nn.Conv3d(inputs, channels, 1) if inputs != channels else nn.Identity()
        self.norm1, self.space = Norm(inputs), space_conv(inputs, channels)
        self.level = zeroed(nn.Linear(SIGMA_WIDTH, 2 * channels))
        self.norm2 = Norm(channels)
        self.time = zeroed(nn.Conv3d(channels, channels, (3, 1, 1), padding=(1, 0, 0)))

    def forward(self, x, level):
        h = self.space(F.silu(self.norm1(x)))
        scale, shift = self.level(level)[:, :, None, None, None].chunk(2, 1)
        h = self.norm2(h) * (1 + scale) + shift
        return self.skip(x) + self.time(F.silu(h))


class Attention(nn.Module):
    """x + attention over all positions of the clip, in space and time."""

    def __init__(self, channels, heads=4):
        super().__init__()
        self.heads = heads
        self.norm = Norm(channels)
        self.qkv, self.out = nn.Linear(channels, 3 * channels), zeroed(nn.Linear(channels, channels))

    def forward(self, x):
        b, c, t, height, width = x.shape
        tokens = self.norm(x).permute(0, 3, 4, 2, 1)  # [B, H, W, T, C]
        count = height * width * t
        q, k, v = self.qkv(tokens.reshape(b, count, c)).chunk(3, -1)
        q, k, v = (y.reshape(b, count, self.heads, c // self.heads).transpose(1, 2) for y in (q, k, v))
        if torch.onnx.is_in_onnx_export():  # the same, in operators that every runtime has
            weights = (q @ k.transpose(2, 3) * (c // self.heads) ** -0.5).softmax(-1)
            y = weights @ v
        else:
            y = F.scaled_dot_product_attention(q, k, v)
        y = self.out(y.transpose(1, 2).reshape(b, count, c))
        return x + y.reshape(b, height, width, t, c).permute(0, 4, 3, 1, 2)


class Velocity(nn.Module):
    """x [B, 33, T, h, w] = (z 16, mask 1, image latent 16), sigma [B] -> eps - x0 [B, 16, T, h, w]

    The answer is the best one for Gaussian data around the image (held for the whole clip), exact in closed form, plus
    what the network adds. So it starts as a still picture's denoiser and learns only what moves.
    """

    def __init__(self, full=96, half=160):
        super().__init__()
        # Deviation of a clip's latents from its image, held still; measured on the data before training.
        self.register_buffer("spread", torch.ones(1, LATENT_CHANNELS, 1, 1, 1))
        self.level = nn.Sequential(
            nn.Linear(32, SIGMA_WIDTH), nn.SiLU(), nn.Linear(SIGMA_WIDTH, SIGMA_WIDTH), nn.SiLU()
        )
        self.stem = space_conv(2 * LATENT_CHANNELS + 2, full)
        self.frame = zeroed(nn.Linear(2 * len(FRAME_WAVES), full))
        self.down = nn.ModuleList([Block(full, full) for _ in range(3)])
        self.shrink = space_conv(full, half, stride=2)
        self.middle = nn.ModuleList([Block(half, half) for _ in range(3)])
        self.attend = nn.ModuleList([Attention(half) for _ in range(2)])
        self.grow = nn.Conv3d(half, 4 * full, 1)
        self.up = nn.ModuleList([Block(2 * full, full), Block(full, full), Block(full, full)])
        self.norm = Norm(full)
        self.head = zeroed(space_conv(full, LATENT_CHANNELS))

    def forward(self, x, sigma):
        z, mask, image = x.split([LATENT_CHANNELS, 1, LATENT_CHANNELS], 1)
        given = mask[:, :, :1]  # 1 where the image is known, 0 where the condition was dropped
        image = image[:, :, :1]
        s = sigma[:, None, None, None, None]

        spread = given * self.spread + (1 - given)
        total = ((1 - s) * spread) ** 2 + s**2
        gaussian = (s - (1 - s) * spread**2) / total * (z - (1 - s) * image) - image
        scale = spread * torch.rsqrt(total)

        turns = sigma[:, None] * torch.exp(torch.linspace(0, 5, 16, device=x.device)) * math.pi / 2
        level = self.level(torch.cat([turns.cos(), turns.sin()], 1))
        # Standardised to about unit deviation, whatever the noise level.
        parts = [(z - (1 - s) * image) * torch.rsqrt(total), mask, image.expand_as(z), given.expand_as(mask)]
        h = self.stem(torch.cat(parts, 1)) + self.frames(z)
        for block in self.down:
            h = block(h, level)
        kept = h
        h = self.shrink(h)
        for block, attend in zip(self.middle, [*self.attend, None]):
            h = block(h, level)
            h = attend(h) if attend is not None else h
        grown = channels_to_space(self.grow(h))[:, :, :, : z.shape[3], : z.shape[4]]  # sides may be odd
        h = torch.cat([grown, kept], 1)
        for block in self.up:
            h = block(h, level)
        return gaussian + scale * self.head(F.silu(self.norm(h))).float()

    def frames(self, z):
        """[1, C, T, 1, 1]: where in time each latent is."""
        index = torch.cumsum(torch.ones_like(z[0, 0, :, 0, 0]), 0) - 1
        turns = index[:, None] * (2 * math.pi / torch.tensor(FRAME_WAVES, device=z.device))
        code = self.frame(torch.cat([turns.cos(), turns.sin()], 1))
        return code.t()[None, :, :, None, None]
