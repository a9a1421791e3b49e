"""Checkpoints: written whole or not at all, read where there are some."""

import copy
import os

import torch

from unet import Velocity
from vae import Vae


def save(path, **content):
    """Writes `content` to `path` by way of a neighbour, so that an interrupted run leaves the last good file."""
    part = path.with_suffix(".part")
    torch.save(content, part)
    os.replace(part, path)


def load(path):
    """What `save` wrote, or None."""
    return torch.load(path, map_location="cpu", weights_only=True) if path.exists() else None


def load_vae(work):
    """The autoencoder of `work` with averaged weights, and a word on its training."""
    torch.manual_seed(0)
    vae, state = Vae(), load(work / "vae.pt")
    if state is None:
        return vae.eval(), "untrained"
    vae.load_state_dict(state["average"])
    return vae.eval(), f"{state['step']} steps, {state.get('decoder_steps', 0)} more of the decoder"


def load_velocity(work):
    """The velocity network of `work` with averaged weights, and a word on its training."""
    torch.manual_seed(1)
    velocity, state = Velocity(), load(work / "flow.pt")
    if state is None:
        return velocity.eval(), "untrained"
    velocity.load_state_dict(state["average"])
    return velocity.eval(), f"{state['step']} steps"


class Average:
    """A moving average of a module's weights; `rate` is reached slowly, so that the first steps are forgotten."""

    def __init__(self, module, rate):
        self.module, self.rate = copy.deepcopy(module).eval(), rate
        for values in self.module.parameters():
            values.requires_grad_(False)

    @torch.no_grad()
    def update(self, module, step):
        rate = min(self.rate, (1 + step) / (10 + step))
        ours, theirs = list(self.module.parameters()), [p.detach() for p in module.parameters()]
        torch._foreach_lerp_(ours, theirs, 1 - rate)
