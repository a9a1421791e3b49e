"""The causal video autoencoder: 8 x 8 pixels and 4 frames become one latent of 16 channels.

Latent 0 is frame 0, latent k is frames 4k - 3 ... 4k. Neither half looks into the future: latent k depends on frames
up to 4k, and those frames depend on latents up to k.

Both halves are a linear map of patches, which starts as the principal components of the data, plus what a network adds,
which starts as nothing. The linear part alone gives 29 dB on clips it has not seen; a network without it had reached
21 dB after 700 steps.
"""

import torch
from torch import nn
from torch.nn import functional as F

from layers import (
    CausalTimeConv,
    Norm,
    channels_to_space,
    channels_to_time,
    from_patches,
    space_conv,
    space_to_channels,
    to_patches,
    zeroed,
)

LATENT_CHANNELS = 16
PATCH_CHANNELS = 768
START_LOG_VARIANCE = -5.0


class Block(nn.Module):
    """x + a convolution in space, then one over time."""

    def __init__(self, channels):
        super().__init__()
        self.norm1, self.space = Norm(channels), space_conv(channels, channels)
        self.norm2, self.time = Norm(channels), CausalTimeConv(channels, channels)
        zeroed(self.time.conv)

    def forward(self, x):
        h = self.space(F.silu(self.norm1(x)))
        return x + self.time(F.silu(self.norm2(h)))


class SpaceBlock(nn.Module):
    """x + two convolutions in space, for the levels with many pixels."""

    def __init__(self, channels):
        super().__init__()
        self.norm1, self.conv1 = Norm(channels), space_conv(channels, channels)
        self.norm2, self.conv2 = Norm(channels), zeroed(space_conv(channels, channels))

    def forward(self, x):
        h = self.conv1(F.silu(self.norm1(x)))
        return x + self.conv2(F.silu(self.norm2(h)))


class Encoder(nn.Module):
    """video [B, 3, 1 + 4k, 8h, 8w] in [-1, 1] -> mean and log variance of the latent, each [B, 16, 1 + k, h, w]"""

    def __init__(self, widths=(32, 64, 96, 112)):
        super().__init__()
        a, b, c, d = widths
        self.stem = space_conv(12, a)
        self.body = nn.Sequential(
            SpaceBlock(a),
            space_conv(a, b, stride=2),
            Block(b),
            CausalTimeConv(b, c, stride=2),
            Block(c),
            space_conv(c, d, stride=2),
            CausalTimeConv(d, d, stride=2),
            Block(d),
            Block(d),
            Norm(d),
        )
        self.head = zeroed(nn.Conv3d(d, 2 * LATENT_CHANNELS, 1))
        self.linear = nn.Conv3d(PATCH_CHANNELS, LATENT_CHANNELS, 1)

    def forward(self, video):
        moments = self.head(F.silu(self.body(self.stem(space_to_channels(video)))))
        more, log_variance = moments.float().chunk(2, 1)
        mean = self.linear(to_patches(video)).float() + more
        return mean, (log_variance + START_LOG_VARIANCE).clamp(-12, 4)


class TimeUp(nn.Module):
    """1 + k positions in time become 1 + 2k."""

    def __init__(self, inputs, outputs):
        super().__init__()
        self.conv = CausalTimeConv(inputs, 2 * outputs)

    def forward(self, x):
        return channels_to_time(self.conv(x))


class SpaceUp(nn.Module):
    """H x W become 2H x 2W."""

    def __init__(self, inputs, outputs):
        super().__init__()
        self.conv = space_conv(inputs, 4 * outputs)

    def forward(self, x):
        return channels_to_space(self.conv(x))


class Decoder(nn.Module):
    """latent [B, 16, 1 + k, h, w] -> video [B, 3, 1 + 4k, 8h, 8w], not clamped"""

    def __init__(self, widths=(120, 80, 64, 32)):
        super().__init__()
        a, b, c, d = widths
        self.body = nn.Sequential(
            nn.Conv3d(LATENT_CHANNELS, a, 1),
            Block(a),
            Block(a),
            TimeUp(a, a // 2),
            SpaceUp(a // 2, b),
            Block(b),
            TimeUp(b, c),
            Block(c),
            SpaceUp(c, d),
            SpaceBlock(d),
            SpaceBlock(d),
            Norm(d),
        )
        self.head = zeroed(space_conv(d, 12))
        self.linear = nn.Conv3d(LATENT_CHANNELS, PATCH_CHANNELS, 1)

    def forward(self, latent):
        more = channels_to_space(self.head(F.silu(self.body(latent)))).float()
        return from_patches(self.linear(latent)).float() + more


class Vae(nn.Module):
    """Both halves and the statistics that make the latents a flow model sees zero in mean and one in deviation."""

    def __init__(self):
        super().__init__()
        self.encoder, self.decoder = Encoder(), Decoder()
        self.register_buffer("latent_mean", torch.zeros(1, LATENT_CHANNELS, 1, 1, 1))
        self.register_buffer("latent_std", torch.ones(1, LATENT_CHANNELS, 1, 1, 1))

    @torch.no_grad()
    def start_from(self, patches):
        """Sets both linear maps to the principal components, scaled to deviation one, of patches [N, 768]."""
        mean = patches.mean(0)
        values, vectors = torch.linalg.eigh(torch.cov((patches - mean).T))
        values, vectors = values.flip(0)[:LATENT_CHANNELS], vectors.flip(1)[:, :LATENT_CHANNELS]
        into, back = (vectors / values.sqrt()).T, vectors * values.sqrt()
        self.encoder.linear.weight.copy_(into[:, :, None, None, None])
        self.encoder.linear.bias.copy_(-into @ mean)
        self.decoder.linear.weight.copy_(back[:, :, None, None, None])
        self.decoder.linear.bias.copy_(mean)

    def encode(self, video):
        """The normalised mean of the posterior."""
        return (self.encoder(video)[0] - self.latent_mean) / self.latent_std

    def decode(self, latent):
        """Video in [-1, 1] from a normalised latent."""
        return self.decoder(latent * self.latent_std + self.latent_mean).clamp(-1, 1)
