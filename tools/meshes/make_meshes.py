"""Writes the meshes of the scenes: a sand castle, an apple, a gummy bear, a plume of steam. Closed, faces outwards, z up, about 1 unit high.

  python3 make_meshes.py ../../assets/meshes      (needs numpy and scikit-image; see README.md)
"""
import sys
from pathlib import Path

import numpy as np
from skimage.measure import marching_cubes


def write(path, comment, vertices, faces):
    with open(path, "w") as f:
        f.write(f"# {comment}\n")
        f.writelines("v %.4g %.4g %.4g\n" % tuple(v) for v in vertices)
        f.writelines("f %d %d %d\n" % tuple(i + 1 for i in face) for face in faces)


def castle():
    """A keep, four towers with battlements and walls between them, as boxes of 1/24 on a plane."""
    n = 24
    height = np.zeros((n, n), int)
    height[3:21, 3:21] = 8                                    # walls
    height[6:18, 6:18] = 5                                    # court
    height[9:15, 9:15] = 16                                   # keep
    for i in range(3, 21, 2):                                 # battlements of the walls
        for k in (3, 20):
            height[i, k] = height[k, i] = 10
    for x in (9, 11, 13):
        for y in (9, 14):
            height[x, y] = height[y, x] = 18
    height[14, 14] = 18
    for x, y in ((1, 1), (1, 17), (17, 1), (17, 17)):         # towers
        tower = height[x:x + 6, y:y + 6]
        tower[:] = 14
        tower[0::2, 0] = tower[0::2, 5] = tower[0, 0::2] = tower[5, 0::2] = 16
        tower[5, 5] = tower[0, 5] = tower[5, 0] = 16
    height[10:14, 3:6] = 0                                    # gate
    solid = np.zeros((n + 2, n + 2, 26), bool)
    for z in range(24):
        solid[1:-1, 1:-1, z + 1] = height > z
    vertices, faces, index = [], [], {}

    def corner(p):
        if p not in index:
            index[p] = len(vertices)
            vertices.append([p[0] / n - 0.5 - 1 / n, p[1] / n - 0.5 - 1 / n, (p[2] - 1) / n])
        return index[p]

    # Corners of a cell's face towards +axis and −axis, seen from outside counter-clockwise.
    for axis in range(3):
        b, c = (axis + 1) % 3, (axis + 2) % 3
        for at in np.argwhere(solid):
            for side in (0, 1):
                other = at.copy()
                other[axis] += 2 * side - 1
                if solid[tuple(other)]:
                    continue
                quad = []
                for u, v in ((0, 0), (1, 0), (1, 1), (0, 1)):
                    p = at.copy()
                    p[axis] += side
                    p[b] += u
                    p[c] += v
                    quad.append(corner(tuple(int(q) for q in p)))
                if not side:
                    quad.reverse()
                faces += [[quad[0], quad[1], quad[2]], [quad[0], quad[2], quad[3]]]
    return vertices, faces


def apple(rings=20, sectors=28):
    """A profile with a dimple at the stalk and a smaller one below, turned about z."""
    t = np.linspace(0, np.pi, rings + 1)[1:-1]
    radius = 0.5 * np.sin(t) ** 0.9 * (0.95 + 0.12 * np.cos(t))
    dimple = 0.34 * np.exp(-(np.sin(t) / 0.42) ** 2)
    z = 0.52 * np.cos(t) * (1 - np.where(t < np.pi / 2, dimple, 0.5 * dimple))
    vertices = [[0, 0, 0.52 * 0.66], [0, 0, -0.52 * 0.83]]
    for r, h in zip(radius, z):
        vertices += [[r * np.cos(a), r * np.sin(a), h] for a in 2 * np.pi * np.arange(sectors) / sectors]
    at = lambda ring, sector: 2 + ring * sectors + sector % sectors
    faces = []
    for s in range(sectors):
        faces += [[0, at(0, s), at(0, s + 1)], [1, at(rings - 2, s + 1), at(rings - 2, s)]]
        for ring in range(rings - 2):
            a, b, c, d = at(ring, s), at(ring, s + 1), at(ring + 1, s), at(ring + 1, s + 1)
            faces += [[a, c, d], [a, d, b]]
    return vertices, faces


def bear(cells=24):
    """Ellipsoids that melt into one another: belly, head, muzzle, ears, arms, legs. It looks towards −y."""
    parts = [((0, 0, .38), (.24, .20, .27)), ((0, -.01, .78), (.19, .17, .17)), ((0, -.16, .74), (.09, .08, .07)),
             ((.15, 0, .94), (.07, .05, .07)), ((-.15, 0, .94), (.07, .05, .07)),
             ((.25, -.10, .50), (.09, .13, .09)), ((-.25, -.10, .50), (.09, .13, .09)),
             ((.15, -.14, .12), (.12, .17, .12)), ((-.15, -.14, .12), (.12, .17, .12))]
    low, high = np.array([-.45, -.42, -.06]), np.array([.45, .34, 1.08])
    axes = [np.linspace(low[a], high[a], int(cells * (high[a] - low[a])) + 2) for a in range(3)]
    x = np.stack(np.meshgrid(*axes, indexing="ij"), -1)
    field = np.zeros(x.shape[:3])
    for center, radii in parts:
        q = np.linalg.norm((x - center) / radii, axis=-1)
        field += np.exp(-3.0 * (q ** 2 - 1))
    vertices, faces, _, _ = marching_cubes(np.log(field), 0.0, spacing=[a[1] - a[0] for a in axes])
    vertices = vertices + low
    a, b, c = (vertices[faces[:, i]] for i in range(3))
    if np.einsum("ij,ij->", a, np.cross(b, c)) < 0:      # twice three times the volume
        faces = faces[:, ::-1]
    return vertices - [0, 0, vertices[:, 2].min()], faces


def plume(rings=40, sectors=32):
    """Steam over a pot: a column that leans to and fro, wider with height, with puffs on all sides."""
    turns = 2 * np.pi * np.arange(sectors) / sectors
    vertices = [[0, 0, 0], [0, 0, 0]]
    for z in np.linspace(0, 1, rings):
        lean = 0.12 * z * np.array([np.sin(5.0 * z), np.cos(6.5 * z + 0.6)])
        puffs = 1 + 0.28 * np.sin(3 * turns + 9 * z) * np.cos(13 * z) + 0.18 * np.sin(5 * turns - 17 * z)
        cap = np.sqrt(max(1 - ((z - 0.9) / 0.1) ** 2, 0.02)) if z > 0.9 else 1
        radius = (0.06 + 0.17 * z ** 1.3) * (1 + (puffs - 1) * min(1, 4 * z)) * cap
        ring = lean[:, None] + radius * np.array([np.cos(turns), np.sin(turns)])
        vertices += [[x, y, z] for x, y in ring.T]
        vertices[1] = [*lean, z]
    at = lambda ring, sector: 2 + ring * sectors + sector % sectors
    faces = []
    for s in range(sectors):
        faces += [[0, at(0, s + 1), at(0, s)], [1, at(rings - 1, s), at(rings - 1, s + 1)]]
        for ring in range(rings - 1):
            a, b, c, d = at(ring, s), at(ring, s + 1), at(ring + 1, s), at(ring + 1, s + 1)
            faces += [[a, b, d], [a, d, c]]
    return vertices, faces


if __name__ == "__main__":
    out = Path(sys.argv[1])
    write(out / "castle.obj", "A sand castle of side 1 around the z axis, standing on z = 0.", *castle())
    write(out / "apple.obj", "An apple of diameter 1 around the origin, stalk up.", *apple())
    write(out / "bear.obj", "A gummy bear of height 1 standing on z = 0, looking towards -y.", *bear())
    write(out / "plume.obj", "Steam of height 1 that rises from z = 0 and spreads.", *plume())
