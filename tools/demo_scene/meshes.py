"""Vertex and face arrays: lathes, radial bodies, tubes, and many copies of one small template.

Lengths are meters, z is up. A `Shape` is plain data; `props` hands it to Blender.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Faces = list[tuple[int, ...]]


@dataclass
class Shape:
    """Vertices (N, 3), faces as vertex indices, and an optional (N, 2) surface coordinate."""

    vertices: Array
    faces: Faces
    surface: Array | None = None

    def moved(self, offset: tuple[float, float, float]) -> Shape:
        """The same shape shifted by `offset`."""
        return Shape(self.vertices + np.asarray(offset), self.faces, self.surface)


def joined(shapes: list[Shape]) -> Shape:
    """One shape made of several; surface coordinates are dropped."""
    faces: Faces = []
    start = 0
    for shape in shapes:
        faces += [tuple(i + start for i in face) for face in shape.faces]
        start += len(shape.vertices)
    return Shape(np.concatenate([shape.vertices for shape in shapes]), faces)


def grid_faces(rows: int, columns: int, wrap: bool) -> Faces:
    """Quads over a row-major grid of vertices; `wrap` closes every row into a ring."""
    last = columns if wrap else columns - 1
    return [
        (
            r * columns + c,
            r * columns + (c + 1) % columns,
            (r + 1) * columns + (c + 1) % columns,
            (r + 1) * columns + c,
        )
        for r in range(rows - 1)
        for c in range(last)
    ]


def lathe(profile: list[tuple[float, float]], segments: int = 64, smooth: int = 6) -> Shape:
    """Turns an (r, z) profile about z, after a Catmull-Rom spline through its points."""
    points = np.asarray(profile, dtype=float)
    padded = np.vstack([points[:1], points, points[-1:]])
    t = np.linspace(0.0, 1.0, smooth, endpoint=False)[:, None]
    curve = []
    for p0, p1, p2, p3 in zip(padded, padded[1:], padded[2:], padded[3:]):
        curve.append(
            0.5
            * (
                2 * p1
                + (p2 - p0) * t
                + (2 * p0 - 5 * p1 + 4 * p2 - p3) * t**2
                + (3 * p1 - p0 - 3 * p2 + p3) * t**3
            )
        )
    outline = np.vstack([*curve, points[-1:]])
    outline[:, 0] = np.maximum(outline[:, 0], 1e-4)
    angle = np.linspace(0.0, 2 * np.pi, segments, endpoint=False)
    ring = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    xy = outline[:, None, :1] * ring[None]
    z = np.broadcast_to(outline[:, None, 1:], (*xy.shape[:2], 1))
    vertices = np.concatenate([xy, z], axis=2).reshape(-1, 3)
    return Shape(vertices, grid_faces(len(outline), segments, wrap=True))


def radial(radius: Callable[[Array, Array], Array], rows: int = 48, segments: int = 96) -> Shape:
    """A body r(polar angle, azimuth) about the origin."""
    polar = np.linspace(1e-3, np.pi - 1e-3, rows)[:, None]
    azimuth = np.linspace(0.0, 2 * np.pi, segments, endpoint=False)[None]
    r = radius(polar, azimuth) * np.ones((rows, segments))
    vertices = np.stack(
        [
            r * np.sin(polar) * np.cos(azimuth),
            r * np.sin(polar) * np.sin(azimuth),
            r * np.cos(polar) * np.ones_like(azimuth),
        ],
        axis=2,
    ).reshape(-1, 3)
    faces = [face[::-1] for face in grid_faces(rows, segments, wrap=True)]
    return Shape(vertices, faces)


def tube(path: Array, radii: Array, sides: int = 12, squareness: float = 0.0) -> Shape:
    """A tube along `path` (N, 3) with radius per point; `squareness` flattens its sides."""
    tangent = np.gradient(path, axis=0)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    side = np.empty_like(tangent)
    carried = np.eye(3)[np.argmin(np.abs(tangent[0]))]
    for k, along in enumerate(tangent):  # Carry one direction along the path: no sudden twist.
        carried = carried - along * (along @ carried)
        carried /= np.linalg.norm(carried)
        side[k] = carried
    up = np.cross(tangent, side)
    angle = np.linspace(0.0, 2 * np.pi, sides, endpoint=False)
    bulge = 1.0 + squareness * np.cos(5 * angle)
    ring = (
        side[:, None] * np.cos(angle)[None, :, None] + up[:, None] * np.sin(angle)[None, :, None]
    ) * bulge[None, :, None]
    vertices = (path[:, None] + ring * radii[:, None, None]).reshape(-1, 3)
    faces = grid_faces(len(path), sides, wrap=True)
    faces.append(tuple(range(sides))[::-1])
    faces.append(tuple(range(len(vertices) - sides, len(vertices))))
    return Shape(vertices, faces)


def box(size: tuple[float, float, float], chamfer: float) -> Shape:
    """A box about the origin whose twelve edges are cut by `chamfer`."""
    half = np.asarray(size) / 2
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=float)
    vertices = []
    for corner in corners:
        for axis in range(3):
            inner = corner * (half - chamfer)
            inner[axis] = corner[axis] * half[axis]
            vertices.append(inner)
    points = np.array(vertices)

    def outward(indices: list[int]) -> tuple[int, ...]:
        center = points[indices].mean(axis=0)
        normal = center / np.linalg.norm(center)
        helper = np.eye(3)[np.argmin(np.abs(normal))]
        u = np.cross(normal, helper)
        v = np.cross(normal, u)
        spoke = points[indices] - center
        order = np.argsort(np.arctan2(spoke @ v, spoke @ u))
        return tuple(indices[i] for i in order)

    faces: Faces = []
    for axis in range(3):
        for sign in (-1, 1):
            faces.append(outward([3 * i + axis for i in range(8) if corners[i, axis] == sign]))
    for i in range(8):
        faces.append(outward([3 * i, 3 * i + 1, 3 * i + 2]))
        for axis in range(3):
            j = i | (1 << (2 - axis))
            if j != i:
                others = [a for a in range(3) if a != axis]
                faces.append(outward([3 * k + a for k in (i, j) for a in others]))
    return Shape(points, faces)


def copies(template: Shape, rotations: Array, offsets: Array, scales: Array) -> Shape:
    """One mesh of K copies: rotations (K, 3, 3), offsets (K, 3), scales (K,) or (K, 3)."""
    scale = scales[:, None, None] if scales.ndim == 1 else scales[:, None, :]
    local = template.vertices[None] * scale
    vertices = np.einsum("kij,knj->kni", rotations, local) + offsets[:, None]
    count = len(template.vertices)
    faces = [
        tuple(i + k * count for i in face) for k in range(len(offsets)) for face in template.faces
    ]
    surface = None if template.surface is None else np.tile(template.surface, (len(offsets), 1))
    return Shape(vertices.reshape(-1, 3), faces, surface)


def rotations(yaw: Array, pitch: Array, roll: Array) -> Array:
    """Rotation matrices Rz(yaw) Rx(pitch) Ry(roll), angles in radians, shape (K, 3, 3)."""
    zero, one = np.zeros_like(yaw), np.ones_like(yaw)
    c, s = np.cos(yaw), np.sin(yaw)
    about_z = np.array([[c, -s, zero], [s, c, zero], [zero, zero, one]])
    c, s = np.cos(pitch), np.sin(pitch)
    about_x = np.array([[one, zero, zero], [zero, c, -s], [zero, s, c]])
    c, s = np.cos(roll), np.sin(roll)
    about_y = np.array([[c, zero, s], [zero, one, zero], [-s, zero, c]])
    return np.einsum("ijk,jlk,lmk->kim", about_z, about_x, about_y)


def blades(rng: np.random.Generator, roots: Array, height: float, width: float) -> Shape:
    """Grass: a bent blade of five vertices at each root (K, 3); `surface` is (0, height share)."""
    count = len(roots)
    turn = rng.uniform(0, 2 * np.pi, count)
    along = np.stack([np.cos(turn), np.sin(turn), np.zeros(count)], axis=1)
    across = np.stack([-np.sin(turn), np.cos(turn), np.zeros(count)], axis=1)
    tall = height * rng.uniform(0.55, 1.25, count)[:, None]
    wide = width * rng.uniform(0.6, 1.2, count)[:, None]
    lean = tall * rng.uniform(0.15, 0.9, count)[:, None]
    up = np.array([0.0, 0.0, 1.0])
    middle = roots + 0.35 * lean * along + 0.6 * tall * up
    tip = roots + lean * along + tall * up
    vertices = np.stack(
        [roots - wide * across, roots + wide * across, middle - 0.7 * wide * across,
         middle + 0.7 * wide * across, tip], axis=1,
    ).reshape(-1, 3)  # fmt: skip
    template: Faces = [(0, 1, 3, 2), (2, 3, 4)]
    faces = [tuple(i + 5 * k for i in face) for k in range(count) for face in template]
    share = np.tile(np.array([[0, 0], [0, 0], [0, 0.6], [0, 0.6], [0, 1.0]]), (count, 1))
    return Shape(vertices, faces, share)


def leaf(lobes: int = 0) -> Shape:
    """A leaf of length 1 along +y, folded along its midrib; `lobes` > 0 gives an ivy outline."""
    t = np.linspace(0.0, 1.0, 9)
    half = 0.33 * np.sin(np.pi * t**0.75)
    if lobes:
        half = 0.52 * np.sin(np.pi * t**0.6) * (0.72 + 0.28 * np.cos(2 * np.pi * lobes * t))
    rib = np.stack([np.zeros(9), t, 0.12 * np.sin(np.pi * t) - 0.1 * t], axis=1)
    left = rib + np.stack([-half, np.zeros(9), 0.35 * half], axis=1)
    right = rib + np.stack([half, np.zeros(9), 0.35 * half], axis=1)
    vertices = np.concatenate([left, rib, right])
    faces = grid_faces(3, 9, wrap=False)
    width = np.concatenate([-half, np.zeros(9), half])
    return Shape(vertices, faces, np.stack([width, np.tile(t, 3)], axis=1))
