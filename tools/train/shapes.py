"""Where rays meet balls, boxes and planes. All vectorised over rays; lengths in metres, z is up.

Rays are an origin [F, P, 3] or [F, 1, 3] and a direction [F, P, 3], one row of P rays for each of F frames. Distances
are [F, P] in units of the direction's length, `FAR` where the ray misses.
"""

import numpy as np

FAR = np.float32(1e4)
NEAR = np.float32(1e-3)


def to_body(points, centre, turn):
    """Points [F, P, 3] in the body's own coordinates; centre [F, 3], turn [F, 3, 3] from the body to the world."""
    return np.matmul(points - centre[:, None], turn)


def ball(origin, direction, radius):
    """Distance to a ball at the origin."""
    a = np.einsum("fpi,fpi->fp", direction, direction)
    b = np.sum(origin * direction, -1)
    c = np.sum(origin * origin, -1) - np.float32(radius * radius)
    disc = b * b - a * c
    t = (-b - np.sqrt(np.maximum(disc, 0))) / a
    return np.where((disc > 0) & (t > NEAR), t, FAR)


def box(origin, direction, half):
    """Distance to a box at the origin with half sides `half` [3]."""
    inverse = 1 / np.where(np.abs(direction) < 1e-8, np.float32(1e-8), direction)
    near_end = (-np.sign(inverse) * half - origin) * inverse
    far_end = (np.sign(inverse) * half - origin) * inverse
    enter, leave = near_end.max(-1), far_end.min(-1)
    return np.where((enter < leave) & (enter > NEAR), enter, FAR)


def plane(origin, direction, normal, offset):
    """Distance to the plane normal . x = offset, seen from its front."""
    slope = direction @ normal
    t = (np.float32(offset) - origin @ normal) / np.where(slope > -1e-6, np.float32(-1), slope)
    return np.where((slope < -1e-6) & (t > NEAR), t, FAR)


def ball_normal(local, radius):
    return local / np.float32(radius)


def box_normal(local, half):
    """The outward normal of the face that `local` [N, 3] lies on."""
    ratio = np.abs(local) / half
    axis = ratio.argmax(-1)
    normal = np.zeros_like(local)
    rows = np.arange(len(local))
    normal[rows, axis] = np.sign(local[rows, axis])
    return normal
