"""How near a video is to the truth: PSNR, SSIM, and where its surface points go. Videos are uint8 [T, H, W, 3]."""

import numpy as np

GAP = 2  # frames a tracker looks ahead
PATCH, SEARCH = 4, 8  # half sides in pixels


def grown(mask, pixels):
    """bool [T, H, W] grown by a square of `pixels`."""
    for axis in (1, 2):
        out = mask.copy()
        for step in range(1, pixels + 1):
            ahead, back = [slice(None)] * 3, [slice(None)] * 3
            ahead[axis], back[axis] = slice(step, None), slice(None, -step)
            out[tuple(ahead)] |= mask[tuple(back)]
            out[tuple(back)] |= mask[tuple(ahead)]
        mask = out
    return mask


def psnr(video, truth, where=None):
    """dB over all pixels, or those where `where` [T, H, W] is set."""
    square = np.square(video.astype(np.float64) - truth).mean(-1)
    square = square.mean() if where is None else square[where].mean()
    return float(10 * np.log10(255**2 / max(square, 1e-9)))


def box_mean(planes, side):
    """Means over side x side windows of [T, H, W], at the same size (edges repeat)."""
    pad = side // 2
    total = np.pad(planes, ((0, 0), (pad, pad), (pad, pad)), mode="edge").cumsum(1).cumsum(2)
    total = np.pad(total, ((0, 0), (1, 0), (1, 0)))
    return (
        total[:, side:, side:] - total[:, :-side, side:] - total[:, side:, :-side] + total[:, :-side, :-side]
    ) / side**2


def ssim(video, truth, where, side=7):
    """Structural similarity of the luma, windows of `side`, mean over the pixels `where`."""
    weights = np.array([0.299, 0.587, 0.114])
    a, b = video @ weights, truth @ weights
    mean_a, mean_b = box_mean(a, side), box_mean(b, side)
    var_a, var_b = box_mean(a * a, side) - mean_a**2, box_mean(b * b, side) - mean_b**2
    both = box_mean(a * b, side) - mean_a * mean_b
    c1, c2 = (0.01 * 255) ** 2, (0.03 * 255) ** 2
    value = (2 * mean_a * mean_b + c1) * (2 * both + c2) / ((mean_a**2 + mean_b**2 + c1) * (var_a + var_b + c2))
    return float(value[where].mean())


def tracking_error(video, tracks):
    """Mean distance in pixels between where points go and where block matching finds them in `video`.

    For every point and frame i where it is seen in frames i and i + GAP: the patch of the video around the true place
    in frame i is searched in frame i + GAP, within SEARCH pixels of that place, by squared difference, to a fraction
    of a pixel by a parabola. NaN without points.
    """
    frames, height, width, _ = video.shape
    margin = PATCH + SEARCH + 1
    padded = np.pad(video.astype(np.float32), ((0, 0), (margin, margin), (margin, margin), (0, 0)), mode="edge")
    errors = []
    for track in tracks:
        for frame in range(0, frames - GAP, GAP):
            (x, y, seen), (later_x, later_y, later_seen) = track[frame], track[frame + GAP]
            if not (seen and later_seen):
                continue
            column, row = int(x) + margin, int(y) + margin
            patch = padded[frame, row - PATCH : row + PATCH + 1, column - PATCH : column + PATCH + 1]
            reach = PATCH + SEARCH
            area = padded[frame + GAP, row - reach : row + reach + 1, column - reach : column + reach + 1]
            windows = np.lib.stride_tricks.sliding_window_view(area, patch.shape[:2], (0, 1))
            cost = np.square(windows - patch.transpose(2, 0, 1)).sum((2, 3, 4))
            best = np.unravel_index(cost.argmin(), cost.shape)
            found = np.array([finer(cost[best[0]], best[1]), finer(cost[:, best[1]], best[0])]) - SEARCH
            errors.append(np.hypot(*(found - (later_x - x, later_y - y))))
    return float(np.mean(errors)) if errors else float("nan")


def finer(cost, at):
    """The minimum of the parabola through a cost and its neighbours."""
    if not 0 < at < len(cost) - 1:
        return float(at)
    left, middle, right = cost[at - 1 : at + 2]
    bend = left - 2 * middle + right
    return at + float(0.5 * (left - right) / bend) if bend > 1e-6 else float(at)
