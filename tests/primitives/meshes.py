"""Small surfaces with known areas and gaps."""

from typing import Any

import numpy as np

from primitives.surface import Surface


def sheet(width: float = 0.05, height: float = 0.05) -> Surface:
    corners = [[0, 0, 0], [width, 0, 0], [width, height, 0], [0, height, 0]]
    return Surface(np.array(corners, dtype=float), np.array([[0, 1, 2], [0, 2, 3]]))


def ball(radius: float = 0.03, rounds: int = 4, below: float = np.inf) -> Surface:
    """A sphere from an octahedron, halved so often; only triangles whose middle is below a height."""
    vertices = np.array([[1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], dtype=float)
    faces = np.array([[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4], [1, 0, 5], [2, 1, 5], [3, 2, 5], [0, 3, 5]])
    triangles = vertices[faces]
    for _ in range(rounds):
        a, b, c = np.moveaxis(triangles, 1, 0)
        ab, bc, ca = a + b, b + c, c + a
        parts = [np.stack(t, axis=1) for t in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))]
        triangles = np.concatenate(parts)
        triangles /= np.linalg.norm(triangles, axis=2, keepdims=True)
    triangles *= radius
    triangles = triangles[triangles.mean(axis=1)[:, 2] < below]
    return Surface(triangles.reshape(-1, 3), np.arange(3 * len(triangles)).reshape(-1, 3))


def tube(radius: float = 0.012, length: float = 0.08, around: int = 48) -> Surface:
    """An open tube along z."""
    azimuth = np.linspace(0.0, 2.0 * np.pi, around, endpoint=False)
    ring = radius * np.stack([np.cos(azimuth), np.sin(azimuth), 0.0 * azimuth], axis=1)
    i = np.arange(around)
    j = (i + 1) % around
    faces = np.concatenate([np.stack([i, j, j + around], axis=1), np.stack([i, j + around, i + around], axis=1)])
    return Surface(np.concatenate([ring, ring + np.array([0.0, 0.0, length])]), faces)


def box(sides: Any = (0.05, 0.04, 0.03)) -> Surface:
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)]) * np.array(sides)
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return Surface(corners, np.array([t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))]))


SMOOTH = {"sheet": sheet(), "ball": ball(), "bowl": ball(below=0.0), "tube": tube(), "box": box()}
