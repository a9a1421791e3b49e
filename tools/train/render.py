"""Pictures of a scene by ray casting: colours with one light and hard shadows, and what each pixel sees."""

import dataclasses

import numpy as np

import shapes

SIZE = 64
SKY, GROUND, WALL, FIRST_BODY = 0, 1, 2, 3
SKY_DISTANCE = np.float32(20)


@dataclasses.dataclass
class Hits:
    """What rays see: [F, P] surface number and distance along the optical axis, [F, P, 3] point in the world."""

    surface: np.ndarray
    depth: np.ndarray
    point: np.ndarray


def rays(scene, frames, grid):
    """Directions [F, grid * grid, 3] through the pixel centres of a grid, one metre deep along the optical axis."""
    at = ((np.arange(grid, dtype=np.float32) + 0.5) / grid - 0.5) / np.float32(scene.focal)
    x, y = np.meshgrid(at, at)
    flat = np.stack([x.ravel(), y.ravel(), np.ones(grid * grid, np.float32)], 1)
    return np.matmul(flat, scene.views[frames])


def distances(scene, number, frames, origin, direction):
    """Distances [F, P] from points [F, P or 1, 3] along directions [F, P or 1, 3] to a body in each frame."""
    body, centre, turn = scene.bodies[number], scene.centres[number, frames], scene.turns[number, frames]
    origin, direction = shapes.to_body(origin, centre, turn), np.matmul(direction, turn)
    if body.kind == "ball":
        return shapes.ball(origin, direction, body.radius)
    return shapes.box(origin, direction, body.half.astype(np.float32))


UP = np.array([0, 0, 1], np.float32)
TO_FRONT = np.array([0, -1, 0], np.float32)


def cast(scene, frames, grid, bodies):
    """What the rays of `grid` see in `frames`, with only the bodies in the list `bodies`."""
    direction = rays(scene, frames, grid)
    eye = scene.eyes[frames][:, None]
    depth = np.full(direction.shape[:2], SKY_DISTANCE, np.float32)
    surface = np.zeros(direction.shape[:2], np.int8)

    def nearer(t, number):
        closer = t < depth
        depth[closer] = t[closer] if t.shape == depth.shape else np.broadcast_to(t, depth.shape)[closer]
        surface[closer] = number

    nearer(shapes.plane(eye, direction, UP, 0), GROUND)
    if scene.wall is not None:
        nearer(shapes.plane(eye, direction, TO_FRONT, scene.wall_offset), WALL)
    for number in bodies:
        nearer(distances(scene, number, frames, eye, direction), FIRST_BODY + number)
    return Hits(surface, depth, eye + direction * depth[..., None])


def shade(scene, frames, hits, bodies):
    """Linear colours [F, P, 3] of what the rays see, lit and shadowed by the listed bodies."""
    colours = np.empty((*hits.surface.shape, 3), np.float32)
    facing = np.zeros(hits.surface.shape, np.float32)
    start = hits.point + scene.light * np.float32(0.004)
    seen = hits.surface == SKY
    up = hits.point[..., 2][seen] / SKY_DISTANCE
    colours[seen] = scene.sky * (1 - 0.5 * np.clip(up, 0, 1))[:, None]

    seen = hits.surface == GROUND
    colours[seen] = scene.ground.colours(hits.point[seen])
    facing[seen] = scene.light[2]
    if scene.wall is not None:
        seen = hits.surface == WALL
        colours[seen] = scene.wall.colours(hits.point[seen][:, [0, 2, 1]])
        facing[seen] = max(scene.light @ TO_FRONT, 0)
    for number in bodies:
        body = scene.bodies[number]
        seen = hits.surface == FIRST_BODY + number
        frame = np.nonzero(seen)[0]
        turn = scene.turns[number, frames][frame]
        local = np.einsum("ni,nij->nj", hits.point[seen] - scene.centres[number, frames][frame], turn)
        normal = shapes.ball_normal(local, body.radius) if body.kind == "ball" else shapes.box_normal(local, body.half)
        colours[seen] = body.texture.colours(local)
        normal = np.einsum("nj,nij->ni", normal, turn)
        facing[seen] = np.maximum(normal @ scene.light, 0)
        start[seen] += normal * np.float32(0.004)

    lit = facing > 0
    for number in bodies:
        lit &= distances(scene, number, frames, start, scene.light[None, None]) == shapes.FAR
    light = np.float32(scene.ambient) + np.float32(1 - scene.ambient) * 1.1 * facing * lit
    light[hits.surface == SKY] = 1
    return colours * light[..., None]


def encode(linear):
    """uint8 of linear colours."""
    return (np.clip(linear, 0, 1) ** np.float32(1 / 2.2) * 255 + 0.5).astype(np.uint8)


def video(scene, frames=None, bodies=None, samples=2):
    """Frames uint8 [F, SIZE, SIZE, 3], `samples` x `samples` rays a pixel."""
    frames = np.arange(len(scene.eyes)) if frames is None else np.asarray(frames)
    bodies = range(len(scene.bodies)) if bodies is None else bodies
    out = []
    for some in np.array_split(frames, max(1, len(frames) // 6)):  # keeps the arrays in the cache
        colours = shade(scene, some, cast(scene, some, SIZE * samples, bodies), bodies)
        out.append(encode(colours.reshape(len(some), SIZE, samples, SIZE, samples, 3).mean((2, 4))))
    return np.concatenate(out)


def project(scene, frame, points):
    """Pixel coordinates [N, 2] (centres at +0.5) and depth [N] of points [N, 3] in a frame."""
    local = (points - scene.eyes[frame]) @ scene.views[frame].T
    depth = np.maximum(local[:, 2], 1e-3)
    return (local[:, :2] / depth[:, None] * scene.focal + 0.5) * SIZE, depth
