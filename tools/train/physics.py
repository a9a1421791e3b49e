"""Rigid balls and boxes under gravity: impulses with restitution and Coulomb friction, short steps.

Only good enough to look right for a second and a half: boxes meet boxes as balls.
"""

import dataclasses

import numpy as np

GRAVITY = np.array([0, 0, -9.81])
FRAMES_PER_SECOND = 24
STEPS_PER_FRAME = 16
CORNERS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)


@dataclasses.dataclass
class Body:
    """A ball (`radius`) or a box (`half` sides). Mass is volume; a fixed body has inverse mass 0."""

    kind: str
    centre: np.ndarray
    turn: np.ndarray
    speed: np.ndarray
    spin: np.ndarray
    radius: float = 0.0
    half: np.ndarray | None = None
    moving: bool = True
    bounce: float = 0.5
    friction: float = 0.4
    texture: object = None

    def __post_init__(self):
        if self.kind == "ball":
            mass = 4.19 * self.radius**3
            inertia = np.full(3, 0.4 * mass * self.radius**2)
            self.reach = self.radius
        else:
            mass = 8 * self.half.prod()
            inertia = mass / 3 * (np.square(self.half).sum() - np.square(self.half))
            self.reach = float(np.linalg.norm(self.half))
        self.inverse_mass = 1 / mass if self.moving else 0.0
        self.inverse_inertia = 1 / inertia if self.moving else np.zeros(3)

    def turned(self, torque):
        """The change of spin by an impulse moment."""
        return self.turn @ (self.inverse_inertia * (self.turn.T @ torque))


def push(one, other, point, normal, depth):
    """A contact at `point`, `normal` from `other` (None: the world) to `one`, overlapping by `depth`."""
    pair = [(one, 1.0)] + ([(other, -1.0)] if other is not None else [])
    arms = [point - body.centre for body, _ in pair]
    slip = sum(side * (body.speed + np.cross(body.spin, arm)) for (body, side), arm in zip(pair, arms))
    closing = slip @ normal
    total = sum(body.inverse_mass for body, _ in pair)
    if total == 0:
        return

    def resistance(way):
        return sum(
            body.inverse_mass + np.cross(body.turned(np.cross(arm, way)), arm) @ way
            for (body, _), arm in zip(pair, arms)
        )

    impulse = np.zeros(3)
    if closing < 0:
        bounce = one.bounce if closing < -0.4 else 0.0  # else a body at rest would tremble
        strength = -(1 + bounce) * closing / resistance(normal)
        impulse = strength * normal
        along = slip - closing * normal
        length = np.linalg.norm(along)
        if length > 1e-6:
            along = along / length
            impulse = impulse - along * min(one.friction * strength, length / resistance(along))
    for (body, side), arm in zip(pair, arms):
        body.speed = body.speed + side * impulse * body.inverse_mass
        body.spin = body.spin + side * body.turned(np.cross(arm, impulse))
        body.centre = body.centre + side * normal * (0.3 * max(depth - 0.001, 0) * body.inverse_mass / total)


def meet_plane(body, normal, offset):
    """Contacts of a body with the plane normal . x = offset."""
    if body.centre @ normal - offset > body.reach:
        return
    points = (
        [body.centre - normal * body.radius] if body.kind == "ball" else body.centre + CORNERS * body.half @ body.turn.T
    )
    for point in points:
        depth = offset - point @ normal
        if depth > 0:
            push(body, None, point, normal, depth)


def meet(one, other):
    """The contact of two bodies, if they touch."""
    apart = one.centre - other.centre
    distance = np.linalg.norm(apart)
    if distance > one.reach + other.reach or distance < 1e-6:
        return
    if one.kind == "box" and other.kind == "ball":
        one, other, apart = other, one, -apart
    if one.kind == "ball" and other.kind == "box":
        local = other.turn.T @ apart
        nearest = np.clip(local, -other.half, other.half)
        gap = np.linalg.norm(local - nearest)
        if 1e-6 < gap < one.radius:
            normal = other.turn @ ((local - nearest) / gap)
            push(one, other, other.centre + other.turn @ nearest, normal, one.radius - gap)
        return
    radii = [body.radius if body.kind == "ball" else float(body.half.mean()) * 1.15 for body in (one, other)]
    if distance < sum(radii):
        normal = apart / distance
        push(one, other, other.centre + normal * radii[1], normal, sum(radii) - distance)


def rotation(vector):
    """The rotation by the angle |vector| about the vector (Rodrigues)."""
    angle = np.linalg.norm(vector)
    if angle < 1e-9:
        return np.eye(3)
    x, y, z = vector / angle
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


def simulate(bodies, planes, frames):
    """Centres [N, F, 3] and turns [N, F, 3, 3] of all bodies, frame 0 being how they stand now."""
    centres = np.zeros((len(bodies), frames, 3), np.float32)
    turns = np.zeros((len(bodies), frames, 3, 3), np.float32)
    dt = 1 / (FRAMES_PER_SECOND * STEPS_PER_FRAME)
    moving = [body for body in bodies if body.moving]
    for frame in range(frames):
        for number, body in enumerate(bodies):
            centres[number, frame], turns[number, frame] = body.centre, body.turn
        for _ in range(STEPS_PER_FRAME if moving else 0):
            for body in moving:
                body.speed = body.speed + GRAVITY * dt
                body.centre = body.centre + body.speed * dt
                body.turn = rotation(body.spin * dt) @ body.turn
                for normal, offset in planes:
                    meet_plane(body, normal, offset)
            for number, body in enumerate(bodies):
                for other in bodies[number + 1 :]:
                    if body.moving or other.moving:
                        meet(body, other)
        for body in moving:
            u, _, v = np.linalg.svd(body.turn)
            body.turn = u @ v
    return centres, turns
