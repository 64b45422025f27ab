#!/usr/bin/env python3
"""Lets Embree answer a suite of rays with a mesh of the surface, for `photolathe grade`.

    pip install embreex trimesh numpy
    python embree.py SCENE.toml RAYS.csv THEIRS.csv [SEGMENTS]

SCENE holds one surface of revolution that is neither moved, turned nor scaled. Each piece of its profile becomes SEGMENTS chords
(default 64), turned in 4 SEGMENTS steps. Embree works in single precision.
"""
import csv
import sys
import tomllib

import numpy as np
import trimesh
from trimesh.ray.ray_pyembree import RayMeshIntersector

scene, rays, theirs = sys.argv[1:4]
n = int(sys.argv[4]) if len(sys.argv) > 4 else 64

with open(scene, "rb") as file:
    (revolution,) = tomllib.load(file)["revolution"]
u = np.linspace(0, 1, n + 1)[:, None]
weights = np.hstack([(1 - u) ** 3, 3 * u * (1 - u) ** 2, 3 * u**2 * (1 - u), u**3])
outline = np.vstack([weights @ np.array(piece, float) for piece in revolution["profile"]])
theta = np.linspace(0, 2 * np.pi, 4 * n, endpoint=False)
vertices = np.stack([np.outer(outline[:, 0], np.sin(theta)),
                     np.repeat(outline[:, 1:], len(theta), axis=1),
                     np.outer(outline[:, 0], np.cos(theta))], axis=2).reshape(-1, 3)
i, j = np.meshgrid(np.arange(len(outline) - 1), np.arange(len(theta)), indexing="ij")
a, b = i * len(theta) + j, i * len(theta) + (j + 1) % len(theta)
c, d = a + len(theta), b + len(theta)
faces = np.stack([np.stack([a, b, c], -1), np.stack([b, d, c], -1)]).reshape(-1, 3)
mesh = trimesh.Trimesh(vertices, faces, process=False)

with open(rays, newline="") as file:
    table = [[float(row[k]) for k in ("ox", "oy", "oz", "dx", "dy", "dz")] for row in csv.DictReader(file)]
origins, directions = np.split(np.array(table), 2, axis=1)
lengths = np.linalg.norm(directions, axis=1)
unit = directions / lengths[:, None]
points, ray, _ = RayMeshIntersector(mesh, scale_to_box=False).intersects_location(origins, unit, multiple_hits=False)
t = np.einsum("ij,ij->i", points - origins[ray], unit[ray]) / lengths[ray]

with open(theirs, "w") as file:
    file.write("ray,hit,t\n")
    file.writelines(f"{number},1,{value!r}\n" for number, value in zip(ray.tolist(), t.tolist()))
