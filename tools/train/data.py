"""Training clips from the disk, and what is done to them so that they count for more."""

import numpy as np
import torch


class Clips:
    """All `clips-*.npy` of a folder, uint8 [N, 37, 64, 64, 3] each; new files are noticed by `refresh`."""

    def __init__(self, folder):
        self.folder, self.files, self.names = folder, [], set()
        self.refresh()

    def refresh(self):
        for path in sorted(self.folder.glob("clips-*.npy")):
            if path.name not in self.names and ".part" not in path.name:
                self.names.add(path.name)
                self.files.append(np.load(path, mmap_mode="r"))
        return sum(len(file) for file in self.files)

    def random(self, rng):
        file = self.files[rng.integers(len(self.files))]
        return file[rng.integers(len(file))]


def vary(clip, rng):
    """A mirrored clip with its primary colours exchanged, each by chance."""
    if rng.random() < 0.5:
        clip = clip[:, :, ::-1]
    return clip[..., rng.permutation(3)]


def spoil(clip, rng):
    """What renders look like: black holes, a border that is missing, single wrong pixels. Changes `clip`."""
    frames, height, width, _ = clip.shape
    ways = rng.integers(3)
    if ways == 0:  # unseen parts of an orbit: they grow with time
        edge = rng.integers(2, width // 2)
        for frame in range(frames):
            at = edge * (frame + 1) // frames
            clip[frame, :, :at] = 0
    if ways == 1:
        y, x, h, w = rng.integers(0, 48), rng.integers(0, 48), rng.integers(2, 16), rng.integers(2, 16)
        clip[:, y : y + h, x : x + w] = 0
    if ways == 2 or rng.random() < 0.3:
        y, x, side = rng.integers(0, 44), rng.integers(0, 44), rng.integers(8, 20)
        part = clip[:, y : y + side, x : x + side]
        part[rng.random(part.shape[:3]) < rng.uniform(0.02, 0.2)] = rng.integers(0, 256, 3)


def to_tensor(clips):
    """uint8 [B, T, H, W, 3] to f32 [B, 3, T, H, W] in [-1, 1]."""
    tensor = torch.from_numpy(np.ascontiguousarray(clips)).float() / 127.5 - 1
    return tensor.permute(0, 4, 1, 2, 3)


def to_frames(video):
    """f32 [3, T, H, W] in [-1, 1] to uint8 [T, H, W, 3]."""
    return ((video.clamp(-1, 1) + 1) * 127.5 + 0.5).to(torch.uint8).permute(1, 2, 3, 0).contiguous().numpy()
