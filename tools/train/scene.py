"""A random scene: what stands where, what it is painted with, where the light and the camera are."""

import colorsys
import dataclasses

import numpy as np

from physics import Body, rotation, simulate

FRAMES = 37


@dataclasses.dataclass
class Paint:
    """Colours by the point on the surface, in coordinates of the body: plain, stripes, checks, halves or clouds."""

    kind: str
    first: np.ndarray
    second: np.ndarray
    axes: np.ndarray  # [3, 3] rows: directions times waves per metre
    phase: np.ndarray

    def colours(self, local):
        """Linear colours [N, 3] at points [N, 3]."""
        if self.kind == "plain":
            return np.broadcast_to(self.first, local.shape)
        waves = np.sin(local @ self.axes.T + self.phase)
        if self.kind == "stripes":
            value = waves[:, 0]
        elif self.kind == "checks":
            value = waves[:, 0] * waves[:, 1] * 2
        elif self.kind == "halves":
            value = (local @ self.axes[0]) * 2
        else:
            value = waves.sum(-1) / 3
        # Steep but not a step, or every edge of the pattern would flicker at 64 pixels.
        steep = 1.2 if self.kind == "clouds" else 3.0
        share = np.clip(0.5 + 0.5 * steep * value, 0, 1)[:, None].astype(np.float32)
        return self.first * (1 - share) + self.second * share


@dataclasses.dataclass
class Scene:
    """Everything a frame needs. Poses are per frame; `moving` tells which bodies the engine would move."""

    bodies: list
    centres: np.ndarray  # [N, F, 3]
    turns: np.ndarray  # [N, F, 3, 3]
    ground: Paint
    wall: Paint | None
    wall_offset: float
    sky: np.ndarray
    light: np.ndarray  # direction to the light
    ambient: float
    eyes: np.ndarray  # [F, 3]
    views: np.ndarray  # [F, 3, 3] rows: right, down, forward
    focal: float  # in image heights

    @property
    def moving(self):
        return [number for number, body in enumerate(self.bodies) if body.moving]


def colour(rng, saturation=(0.25, 0.95), value=(0.25, 0.95)):
    rgb = colorsys.hsv_to_rgb(rng.random(), rng.uniform(*saturation), rng.uniform(*value))
    return (np.array(rgb) ** 2.2).astype(np.float32)


def paint(rng, waves, kinds, **muted):
    """A random paint with `waves` (least, most) radians a metre."""
    axes = rng.normal(size=(3, 3))
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    if muted:  # ground and wall: pattern axes in their plane, at right angles
        angle = rng.uniform(0, np.pi)
        axes = np.array([[np.cos(angle), np.sin(angle), 0], [-np.sin(angle), np.cos(angle), 0], axes[2]])
    else:
        axes = np.linalg.qr(axes)[0]
    kind = kinds[rng.integers(len(kinds))]
    axes = axes * rng.uniform(*waves)
    if kind == "clouds":
        axes = axes * rng.uniform(0.4, 1, (3, 1))
    first, second = colour(rng, **muted), colour(rng, **muted)
    if muted:  # two tones of a like colour
        second = first * rng.uniform(0.35, 0.8) if rng.random() < 0.7 else second
    return Paint(kind, first, second, axes.astype(np.float32), rng.uniform(0, 6.3, 3).astype(np.float32))


def look(eye, target):
    """Rows right, down, forward of a level camera."""
    forward = target - eye
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, [0, 0, 1])
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(forward, right), forward])


def random_body(rng, size, moving):
    kind = "ball" if rng.random() < 0.55 else "box"
    shape = {"radius": size} if kind == "ball" else {"half": size * rng.uniform(0.6, 1.0, 3)}
    turn = rotation(np.array([0, 0, rng.uniform(0, np.pi)]))
    texture = paint(rng, (0.9 / size, 2.6 / size), ("plain", "stripes", "checks", "halves", "halves"))
    texture.phase = texture.phase if texture.kind != "halves" else texture.phase * 0
    if texture.kind == "halves":
        texture.axes = texture.axes / np.linalg.norm(texture.axes[0]) * np.float32(2 / size)
    return Body(
        kind, np.zeros(3), turn, np.zeros(3), np.zeros(3), moving=moving, bounce=rng.uniform(0.35, 0.8),
        friction=rng.uniform(0.2, 0.7), texture=texture, **shape,
    )  # fmt: skip


def place(rng, body, others, lift, spread):
    """Puts a body on the ground, or `lift` above it, clear of the others; False where no place is found."""
    for _ in range(30):
        height = body.radius if body.kind == "ball" else body.half[2]
        body.centre = np.array([rng.uniform(-spread, spread), rng.uniform(-0.7, 0.9), height + lift])
        if all(np.linalg.norm(body.centre - other.centre) > body.reach + other.reach for other in others):
            return True
    return False


def throw(rng, body):
    """Speed and spin at the start: falling, thrown, or along the ground."""
    across = -np.sign(body.centre[0]) if rng.random() < 0.75 else rng.choice([-1, 1])
    flying = body.centre[2] > 0.6
    body.speed = np.array(
        [across * rng.uniform(0.1, 1.6), rng.uniform(-0.5, 0.5), rng.uniform(-0.5, 1.5) if flying else 0]
    )
    if flying:
        body.spin = rng.normal(size=3) * 2.5
        body.turn = rotation(rng.normal(size=3)) @ body.turn
    elif body.kind == "ball":
        body.speed[0] *= 1.3
        body.spin = np.cross([0, 0, 1], body.speed) / body.radius
    else:
        body.speed[:2] *= 2


def random_scene(seed, act):
    """The scene of a seed. `animate`: bodies move, the camera stands; `reconstruct`: the other way round."""
    rng = np.random.default_rng(seed)
    animate = act == "animate"
    bodies = []
    moving = int(rng.integers(1, 4)) if animate else 0
    still = int(rng.integers(0, 2)) if animate else int(rng.integers(2, 5))
    for number in range(moving + still):
        body = random_body(rng, rng.uniform(0.24, 0.46), number < moving)
        lift = rng.uniform(0.3, 1.1) if number < moving and rng.random() < 0.7 else 0.0
        if place(rng, body, bodies, lift, 1.0 if number < moving else 1.3):
            bodies.append(body)
            if number < moving:
                throw(rng, body)

    wall_offset = -rng.uniform(1.6, 2.6)
    wall = paint(rng, (1.5, 6), ("plain", "stripes", "clouds", "clouds"), saturation=(0, 0.5), value=(0.3, 0.9))
    wall = wall if rng.random() < 0.75 else None
    ground = paint(rng, (2.5, 7), ("checks", "checks", "clouds", "stripes"), saturation=(0, 0.5), value=(0.25, 0.9))
    planes = [(np.array([0, 0, 1.0]), 0.0)] + ([(np.array([0, -1.0, 0]), wall_offset)] if wall else [])
    centres, turns = simulate(bodies, planes, FRAMES)

    elevation, azimuth = rng.uniform(0.6, 1.2), rng.uniform(0, 2 * np.pi)
    if wall:  # the light comes from the front, or the wall would lie in the dark
        azimuth = rng.uniform(np.pi * 1.1, np.pi * 1.9)
    light = np.array([np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)])

    distance, height, side = rng.uniform(3.0, 4.2), rng.uniform(0.9, 2.0), rng.uniform(-0.35, 0.35)
    sweep = np.zeros(FRAMES)
    if not animate:
        sweep = rng.choice([-1, 1]) * rng.uniform(0.2, 0.6) * np.linspace(0, 1, FRAMES)
    target = np.array([rng.uniform(-0.2, 0.2), rng.uniform(-0.1, 0.3), rng.uniform(0.35, 0.6)])
    angles = side + sweep
    eyes = np.stack([np.sin(angles) * distance, -np.cos(angles) * distance, np.full(FRAMES, height)], 1)
    views = np.stack([look(eye, target) for eye in eyes])
    sky = colour(rng, (0.1, 0.6), (0.5, 0.95))
    return Scene(
        bodies, centres, turns, ground, wall, wall_offset, sky, light.astype(np.float32), rng.uniform(0.2, 0.4),
        eyes.astype(np.float32), views.astype(np.float32), rng.uniform(1.15, 1.6),
    )  # fmt: skip
