"""The things in the garden: fruit, pottery, pumpkins, table, wall and lawn.

Movable things are functions (garden, at, turn, size); `at` is the point they stand on.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np

from .meshes import (
    Array,
    Shape,
    box,
    copies,
    lathe,
    leaf,
    radial,
    rotations,
    tube,
)  # fmt: skip

Point = tuple[float, float, float]

TABLE_TOP = 0.46
TABLE_HALF = (0.80, 0.46)
WALL_Y = 1.25


@dataclass
class Garden:
    """Where props are put: materials by name, a source of chance, and a running object number."""

    materials: dict[str, Any]
    rng: np.random.Generator
    count: int = 0

    def add(
        self, shape: Shape, material: str, at: Point = (0.0, 0.0, 0.0),
        angles: Point = (0.0, 0.0, 0.0), size: float = 1.0, smooth: bool = True,
    ) -> None:  # fmt: skip
        """Adds one object. Names are numbered, since Blender draws per-object chance from them."""
        self.count += 1
        name = f"{material}.{self.count:03d}"
        mesh = bpy.data.meshes.new(name)
        mesh.from_pydata(shape.vertices.tolist(), [], shape.faces)
        if shape.surface is not None:
            full = np.column_stack([shape.surface, np.zeros(len(shape.surface))])
            layer = mesh.attributes.new("surface", "FLOAT_VECTOR", "POINT")
            layer.data.foreach_set("vector", full.astype(np.float32).ravel())
        if smooth:
            mesh.polygons.foreach_set("use_smooth", np.ones(len(shape.faces), dtype=bool))
        mesh.materials.append(self.materials[material])
        item = bpy.data.objects.new(name, mesh)
        item.location, item.rotation_euler, item.scale = at, angles, (size, size, size)
        bpy.context.collection.objects.link(item)


def _up(at: Point, height: float) -> Point:
    return (at[0], at[1], at[2] + height)


def vase(garden: Garden, at: Point, turn: float, size: float) -> None:
    """A tall blue jug-shaped vase."""
    profile = [(0.0, 0.0), (0.06, 0.0), (0.075, 0.02), (0.115, 0.12), (0.10, 0.22), (0.05, 0.30),
               (0.042, 0.34), (0.065, 0.39), (0.058, 0.39), (0.036, 0.34),
               (0.03, 0.28)]  # fmt: skip
    garden.add(lathe(profile), "cobalt", at, (0, 0, turn), size)


def _bowl_profile() -> list[tuple[float, float]]:
    return [(0.0, 0.0), (0.07, 0.0), (0.075, 0.015), (0.07, 0.025), (0.13, 0.06), (0.175, 0.115),
            (0.168, 0.115), (0.12, 0.065), (0.05, 0.035), (0.0, 0.033)]  # fmt: skip


def _lemon_shape() -> Shape:
    profile = [(0.0, -0.052), (0.009, -0.048), (0.014, -0.042), (0.031, -0.022), (0.036, 0.0),
               (0.031, 0.022), (0.015, 0.041), (0.009, 0.047), (0.0, 0.05)]  # fmt: skip
    return lathe(profile, 40)


def _apple_shape() -> Shape:
    def radius(polar: Array, azimuth: Array) -> Array:
        dimple = 0.30 * np.exp(-((polar / 0.38) ** 2)) + 0.16 * np.exp(
            -(((np.pi - polar) / 0.3) ** 2)
        )
        return 0.043 * (1 - dimple) * (1 + 0.015 * np.cos(5 * azimuth) * np.sin(polar))

    return radial(radius, 32, 48)


def bowl(garden: Garden, at: Point, turn: float, size: float) -> None:
    """A blue bowl heaped with lemons."""
    garden.add(lathe(_bowl_profile()), "cobalt", at, (0, 0, turn), size)
    spots = [(0.07, 0.0, 0.085), (-0.02, 0.075, 0.085), (-0.065, -0.03, 0.085),
             (0.02, -0.08, 0.085),
             (0.01, 0.0, 0.125)]  # fmt: skip
    for x, y, z in spots:
        c, s = np.cos(turn) * size, np.sin(turn) * size
        angles = (
            1.4 + garden.rng.normal(0, 0.25),
            garden.rng.uniform(-3, 3),
            garden.rng.uniform(-3, 3),
        )
        spot = (at[0] + c * x - s * y, at[1] + s * x + c * y, at[2] + z * size)
        garden.add(_lemon_shape(), "lemon", spot, angles, size)


def lemons(garden: Garden, at: Point, turn: float, size: float) -> None:
    """Three loose lemons."""
    for k in range(3):
        angle = turn + 2.1 * k
        spot = (
            at[0] + 0.055 * size * np.cos(angle),
            at[1] + 0.055 * size * np.sin(angle),
            at[2] + 0.036 * size,
        )
        garden.add(_lemon_shape(), "lemon", spot, (1.57, 0.0, garden.rng.uniform(0, 6.28)), size)


def bananas(garden: Garden, at: Point, turn: float, size: float) -> None:
    """A hand of four bananas lying on its side."""
    t = np.linspace(0.0, 1.0, 32)
    taper = np.interp(
        t, [0.0, 0.10, 0.22, 0.5, 0.82, 0.96, 1.0], [0.45, 0.42, 0.85, 1.0, 0.85, 0.4, 0.3]
    )
    for k in range(4):
        # An arc of 80 degrees in the plane of the table; each fruit a little wider and higher.
        bend = 1.4 * t
        reach = 0.125 + 0.03 * k
        path = np.stack([reach * np.sin(bend), reach * (1 - np.cos(bend)) - 0.03 * k * np.sqrt(t),
                         0.012 * k * np.sin(np.pi * t)], axis=1)  # fmt: skip
        shape = tube(path, 0.019 * taper, 20, 0.06)
        shape.surface = np.stack([np.zeros(len(shape.vertices)), np.repeat(t, 20)], axis=1)
        garden.add(shape, "banana", _up(at, 0.019 * size), (0.0, 0.0, turn), size)


def apples(garden: Garden, at: Point, turn: float, size: float) -> None:
    """Three red apples."""
    for k in range(3):
        angle = turn + 2.1 * k
        spot = (
            at[0] + 0.055 * size * np.cos(angle),
            at[1] + 0.055 * size * np.sin(angle),
            at[2] + 0.037 * size,
        )
        tilt = garden.rng.normal(0, 0.25, 2)
        garden.add(_apple_shape(), "apple", spot, (tilt[0], tilt[1], angle), size)
        stalk = tube(
            np.array([[0, 0, 0.02], [0.002, 0, 0.04], [0.008, 0, 0.055]]), np.full(3, 0.002), 8
        )
        garden.add(stalk, "stem", spot, (tilt[0], tilt[1], angle), size)


def pitcher(garden: Garden, at: Point, turn: float, size: float) -> None:
    """A white enamel pitcher with a dark rim and handle."""
    profile = [(0.0, 0.0), (0.075, 0.0), (0.082, 0.02), (0.078, 0.12), (0.058, 0.20), (0.07, 0.25),
               (0.064, 0.25), (0.05, 0.20), (0.06, 0.1)]  # fmt: skip
    garden.add(lathe(profile), "enamel", at, (0, 0, turn), size)
    ring = np.linspace(0, 2 * np.pi, 49)
    rim = np.stack([0.068 * np.cos(ring), 0.068 * np.sin(ring), np.full(49, 0.25)], axis=1)
    garden.add(tube(rim, np.full(49, 0.005), 8), "iron", at, (0, 0, turn), size)
    s = np.linspace(0, np.pi, 20)
    grip = np.stack(
        [0.065 + 0.06 * np.sin(s), np.zeros(20), 0.06 + 0.16 * (1 - np.cos(s)) / 2], axis=1
    )
    garden.add(tube(grip, np.full(20, 0.008), 10), "enamel", at, (0, 0, turn), size)


def kettle(garden: Garden, at: Point, turn: float, size: float) -> None:
    """A black cast-iron pot with a lid and a bail handle."""
    profile = [(0.0, 0.0), (0.08, 0.0), (0.12, 0.04), (0.13, 0.085), (0.11, 0.135), (0.118, 0.142),
               (0.115, 0.15), (0.06, 0.172), (0.018, 0.178), (0.016, 0.19), (0.025, 0.205),
               (0.0, 0.212)]  # fmt: skip
    garden.add(lathe(profile), "iron", at, (0, 0, turn), size)
    s = np.linspace(0, np.pi, 30)
    bail = np.stack([0.13 * np.cos(s), np.zeros(30), 0.11 + 0.17 * np.sin(s)], axis=1)
    garden.add(tube(bail, np.full(30, 0.006), 8), "iron", at, (0, 0, turn), size)


def pumpkin(garden: Garden, at: Point, turn: float, size: float) -> None:
    """A ribbed pumpkin of about 0.3 m with a bent stalk."""

    def radius(polar: Array, azimuth: Array) -> Array:
        rib = 0.87 + 0.13 * np.abs(np.sin(5.5 * azimuth)) ** 0.55
        squash = 1.0 / np.sqrt(np.sin(polar) ** 2 + (np.cos(polar) / 0.72) ** 2)
        dimple = (
            1
            - 0.28 * np.exp(-((polar / 0.3) ** 2))
            - 0.15 * np.exp(-(((np.pi - polar) / 0.4) ** 2))
        )
        return 0.16 * squash * dimple * (1 + (rib - 1) * np.sin(polar) ** 0.5)

    body = radial(radius, 64, 176)
    garden.add(body, "pumpkin", _up(at, 0.105 * size), (0.06, 0.0, turn), size)
    path = np.array(
        [[0, 0, 0.06], [0, 0, 0.10], [0.006, 0, 0.13], [0.022, 0, 0.155], [0.045, 0, 0.165]]
    )
    garden.add(tube(path, np.array([0.026, 0.018, 0.014, 0.014, 0.017]), 10, 0.12), "stem",
               _up(at, 0.105 * size), (0.06, 0.0, turn), size)  # fmt: skip


def planter(garden: Garden, at: Point, turn: float, size: float) -> None:
    """A terracotta pot with a leafy plant in violet bloom."""
    profile = [(0.0, 0.0), (0.095, 0.0), (0.13, 0.17), (0.15, 0.172), (0.155, 0.225),
               (0.135, 0.225),
               (0.125, 0.19), (0.0, 0.185)]  # fmt: skip
    garden.add(lathe(profile, smooth=4), "terracotta", at, (0, 0, turn), size)
    rng = garden.rng

    def crown(count: int, low: float, radius: float, height: float) -> Array:
        angle, polar = rng.uniform(0, 2 * np.pi, count), np.arccos(rng.uniform(0.0, 1.0, count))
        r = rng.uniform(0.75, 1.0, count) ** 0.5
        return np.stack(
            [radius * r * np.sin(polar) * np.cos(angle), radius * r * np.sin(polar) * np.sin(angle),
             low + height * r * np.cos(polar)], axis=1,
        )  # fmt: skip

    def facing(spots: Array, droop: float) -> Array:
        yaw = np.arctan2(spots[:, 1], spots[:, 0]) - np.pi / 2 + rng.normal(0, 0.5, len(spots))
        return rotations(yaw, rng.normal(droop, 0.35, len(spots)), rng.normal(0, 0.3, len(spots)))

    spots = crown(230, 0.19, 0.17, 0.17)
    foliage = copies(leaf(), facing(spots, 0.1), spots, rng.uniform(0.05, 0.085, 230))
    garden.add(foliage, "leaf", at, (0, 0, turn), size)
    heads = crown(26, 0.215, 0.185, 0.20)
    bloom = flower(5, 0.024)
    garden.add(
        copies(bloom, facing(heads, -0.5), heads, rng.uniform(0.8, 1.2, 26)),
        "violet",
        at,
        (0, 0, turn),
        size,
    )


def flower(petals: int, length: float) -> Shape:
    """A ring of petals, each `length` meters long, opening upwards."""
    angle = np.arange(petals) * 2 * np.pi / petals
    spin = rotations(angle, np.full(petals, 0.25), np.zeros(petals))
    wide = (
        np.column_stack([np.full(petals, 1.9 * 5 / petals), np.ones(petals), np.ones(petals)])
        * length
    )
    return copies(leaf(), spin, np.zeros((petals, 3)), wide)


def crate(garden: Garden, at: Point, turn: float, size: float) -> None:
    """A slatted wooden crate filled with apples."""
    c, s = np.cos(turn), np.sin(turn)

    def place(x: float, y: float, z: float) -> Point:
        return (at[0] + size * (c * x - s * y), at[1] + size * (s * x + c * y), at[2] + size * z)

    for level in range(3):
        for side in (-1, 1):
            garden.add(
                box((0.44, 0.012, 0.06), 0.003),
                "wood",
                place(0, 0.15 * side, 0.045 + 0.075 * level),
                (0, 0, turn),
                size,
                False,
            )
            garden.add(
                box((0.29, 0.012, 0.06), 0.003),
                "wood",
                place(0.215 * side, 0, 0.045 + 0.075 * level),
                (0, 0, turn + np.pi / 2),
                size,
                False,
            )
    for sx in (-1, 1):
        for sy in (-1, 1):
            garden.add(
                box((0.24, 0.03, 0.03), 0.003),
                "wood",
                place(0.195 * sx, 0.13 * sy, 0.115),
                (0, np.pi / 2, turn),
                size,
                False,
            )
    garden.add(box((0.42, 0.29, 0.10), 0.003), "wood", place(0, 0, 0.06), (0, 0, turn), size, False)
    for i in range(5):
        for j in range(3):
            jitter = garden.rng.normal(0, 0.006, 3)
            spot = place(
                -0.158 + 0.079 * i + jitter[0], -0.085 + 0.085 * j + jitter[1], 0.155 + jitter[2]
            )
            tilt = garden.rng.normal(0, 0.5, 2)
            garden.add(
                _apple_shape(), "apple", spot, (tilt[0], tilt[1], garden.rng.uniform(0, 6)), size
            )


ITEMS: dict[str, Callable[[Garden, Point, float, float], None]] = {
    "vase": vase, "bowl": bowl, "lemons": lemons, "bananas": bananas, "apples": apples,
    "pitcher": pitcher, "kettle": kettle, "pumpkin": pumpkin, "planter": planter, "crate": crate,
}  # fmt: skip
FOOTPRINT: dict[str, float] = {
    "vase": 0.12, "bowl": 0.18, "lemons": 0.10, "bananas": 0.15, "apples": 0.11, "pitcher": 0.13,
    "kettle": 0.14, "pumpkin": 0.17, "planter": 0.20, "crate": 0.27,
}  # fmt: skip
