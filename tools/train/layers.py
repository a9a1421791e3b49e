"""What both networks are made of. Every tensor is [batch, channels, T, H, W]; T is time, in frames or latents."""

import torch
from torch import nn


class Norm(nn.Module):
    """Divides every position by the root mean square of its channels.

    One position knows nothing of the others, so the network stays causal in time and runs at any size.
    """

    def __init__(self, channels):
        super().__init__()
        self.gain = nn.Parameter(torch.ones(1, channels, 1, 1, 1))

    def forward(self, x):
        return x * torch.rsqrt(x.square().mean(1, keepdim=True) + 1e-4) * self.gain.to(x.dtype)


def space_conv(inputs, outputs, size=3, stride=1):
    """A convolution within each frame."""
    pad = size // 2
    return nn.Conv3d(inputs, outputs, (1, size, size), (1, stride, stride), (0, pad, pad))


def zeroed(layer):
    """A layer that adds nothing at the start of training."""
    nn.init.zeros_(layer.weight)
    nn.init.zeros_(layer.bias)
    return layer


class CausalTimeConv(nn.Module):
    """A convolution over time that sees the present and two frames before it; before frame 0 stands frame 0.

    With stride 2, 1 + 2k frames become 1 + k and output j sees inputs up to 2j.
    """

    def __init__(self, inputs, outputs, stride=1):
        super().__init__()
        self.conv = nn.Conv3d(inputs, outputs, (3, 1, 1), (stride, 1, 1))

    def forward(self, x):
        first = x[:, :, :1]
        return self.conv(torch.cat([first, first, x], 2))


def space_to_channels(x):
    """[B, C, T, 2H, 2W] -> [B, 4C, T, H, W]"""
    b, c, t, h, w = x.shape
    x = x.reshape(b, c, t, h // 2, 2, w // 2, 2)
    return x.permute(0, 1, 4, 6, 2, 3, 5).reshape(b, c * 4, t, h // 2, w // 2)


def channels_to_space(x):
    """[B, 4C, T, H, W] -> [B, C, T, 2H, 2W]"""
    b, c, t, h, w = x.shape
    x = x.reshape(b, c // 4, 2, 2, t, h, w)
    return x.permute(0, 1, 4, 5, 2, 6, 3).reshape(b, c // 4, t, h * 2, w * 2)


def channels_to_time(x):
    """[B, 2C, T, H, W] -> [B, C, 2T - 1, H, W]: position j gives frames 2j - 1 and 2j, position 0 only frame 0."""
    b, c, t, h, w = x.shape
    x = x.reshape(b, c // 2, 2, t, h, w).permute(0, 1, 3, 2, 4, 5)
    return x.reshape(b, c // 2, t * 2, h, w)[:, :, 1:]


def to_patches(video):
    """[B, 3, 1 + 4k, 8h, 8w] -> [B, 768, 1 + k, h, w]: 4 frames of 8 x 8 pixels each; frame 0 stands four times."""
    first = video[:, :, :1]
    video = torch.cat([first, first, first, video], 2)
    b, c, t, h, w = video.shape
    video = video.reshape(b, c, t // 4, 4, h // 8, 8, w // 8, 8)
    return video.permute(0, 1, 3, 5, 7, 2, 4, 6).reshape(b, c * 256, t // 4, h // 8, w // 8)


def from_patches(patches):
    """[B, 768, 1 + k, h, w] -> [B, 3, 1 + 4k, 8h, 8w]"""
    b, c, t, h, w = patches.shape
    video = patches.reshape(b, c // 256, 4, 8, 8, t, h, w).permute(0, 1, 5, 2, 6, 3, 7, 4)
    return video.reshape(b, c // 256, t * 4, h * 8, w * 8)[:, :, 3:]
