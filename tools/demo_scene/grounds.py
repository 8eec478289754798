"""What does not move: lawn and daisies, brick wall and ivy, table and cloth."""

from __future__ import annotations

import numpy as np

from .meshes import Array, Shape, blades, box, copies, grid_faces, leaf, rotations
from .props import TABLE_HALF, TABLE_TOP, WALL_Y, Garden, flower

LAWN_X = 4.2
LAWN_Y = (-2.6, WALL_Y)
BLADES = 95_000
BRICK = (0.215, 0.1, 0.065)
JOINT = 0.012
WALL_HEIGHT = 2.3
WALL_X = 5.2


def lawn(garden: Garden) -> None:
    """Soil, grass denser near the middle, and clumps of daisies."""
    rng = garden.rng
    flat = np.array([[-9, -8, 0], [9, -8, 0], [9, WALL_Y, 0], [-9, WALL_Y, 0]], dtype=float)
    garden.add(Shape(flat, [(0, 1, 2, 3)]), "soil")
    x = LAWN_X * rng.uniform(-1, 1, BLADES) * rng.uniform(0.35, 1, BLADES)
    y = rng.uniform(*LAWN_Y, BLADES)
    roots = np.stack([x, y, np.zeros(BLADES)], axis=1)
    garden.add(blades(rng, roots, 0.075, 0.0032), "grass", smooth=False)

    centers = rng.uniform((-2.2, -1.6), (2.2, 1.0), (22, 2))
    ground = np.repeat(centers, 7, axis=0) + rng.normal(0, 0.09, (154, 2))
    ground = ground[ground[:, 1] < WALL_Y - 0.08]
    heads = np.column_stack([ground, rng.uniform(0.06, 0.085, len(ground))])
    count = len(heads)
    nod = rotations(rng.uniform(0, 6.28, count), rng.normal(0, 0.3, count), np.zeros(count))
    size = rng.uniform(0.85, 1.25, count)
    garden.add(copies(flower(9, 0.020), nod, heads, size), "daisy")
    dot = _dot(0.007)
    garden.add(copies(dot, nod, heads + [0, 0, 0.002], size), "heart")


def _dot(radius: float) -> Shape:
    angle = np.arange(8) * np.pi / 4
    ring = np.stack([radius * np.cos(angle), radius * np.sin(angle), np.zeros(8)], axis=1)
    top = 0.6 * ring + [0, 0, 0.6 * radius]
    faces = [*grid_faces(2, 8, wrap=True), tuple(range(8, 16))]
    return Shape(np.concatenate([ring, top]), faces)


def wall(garden: Garden) -> None:
    """A running-bond brick wall, every brick a little askew, before a bed of mortar, with ivy."""
    rng = garden.rng
    rows = int(WALL_HEIGHT / (BRICK[2] + JOINT))
    columns = int(2 * WALL_X / (BRICK[0] + JOINT))
    row, column = (a.ravel() for a in np.mgrid[0:rows, 0:columns])
    x = (column - columns / 2 + 0.5 * (row % 2)) * (BRICK[0] + JOINT)
    z = (row + 0.5) * (BRICK[2] + JOINT)
    count = len(x)
    offsets = np.stack([x, np.full(count, WALL_Y + BRICK[1] / 2), z], axis=1)
    offsets += rng.normal(0, (0.001, 0.004, 0.001), (count, 3))
    skew = rotations(*rng.normal(0, (0.006, 0.02, 0.006), (count, 3)).T)
    scale = rng.uniform((0.97, 0.97, 0.95), (1.0, 1.0, 1.0), (count, 3))
    garden.add(copies(box(BRICK, 0.006), skew, offsets, scale), "brick", smooth=False)
    top = WALL_HEIGHT
    y = WALL_Y + 0.014
    bed = np.array([[-WALL_X, y, 0], [WALL_X, y, 0], [WALL_X, y, top], [-WALL_X, y, top]])
    garden.add(Shape(bed, [(0, 1, 2, 3)]), "mortar", smooth=False)
    _ivy(garden, rng)


def _ivy(garden: Garden, rng: np.random.Generator) -> None:
    """Trails that climb the wall as random walks, each step shedding a few leaves."""
    spots: list[Array] = []
    roots = np.concatenate(
        [rng.uniform(-3.2, -0.75, 11), rng.uniform(0.85, 3.2, 10), rng.uniform(-4.8, 4.8, 6)]
    )
    for root in roots:
        steps = int(rng.uniform(25, 62))
        heading = np.cumsum(rng.normal(0, 0.16, steps))
        x = root + np.cumsum(0.032 * np.sin(heading))
        z = np.cumsum(0.032 * np.abs(np.cos(heading)))
        trail = np.stack([x, np.full(steps, WALL_Y - 0.03), z], axis=1)
        near = np.repeat(trail, 5, axis=0) + rng.normal(0, (0.055, 0.012, 0.045), (5 * steps, 3))
        spots.append(near[near[:, 2] > 0.02])
    place = np.concatenate(spots)
    place[:, 1] = np.minimum(place[:, 1], WALL_Y - 0.012)
    count = len(place)
    hang = rotations(
        rng.normal(0, 0.45, count), rng.normal(-1.9, 0.3, count), rng.normal(0, 0.6, count)
    )
    garden.add(copies(leaf(lobes=3), hang, place, rng.uniform(0.05, 0.095, count)), "ivy")


def table(garden: Garden, cloth_x: float, cloth_width: float) -> None:
    """A low plank table with a gingham runner across it that hangs over both long edges."""
    half_x, half_y = TABLE_HALF
    boards = 5
    width = 2 * half_y / boards
    for k in range(boards):
        y = -half_y + (k + 0.5) * width
        shape = box((2 * half_x, width - 0.006, 0.035), 0.004)
        garden.add(shape, "wood", (0.0, y, TABLE_TOP - 0.0175), smooth=False)
    for sx in (-1, 1):
        for sy in (-1, 1):
            leg = box((TABLE_TOP - 0.035, 0.06, 0.06), 0.004)
            at = (sx * (half_x - 0.1), sy * (half_y - 0.07), (TABLE_TOP - 0.035) / 2)
            garden.add(leg, "wood", at, (0.0, np.pi / 2, 0.0), smooth=False)
        apron = box((2 * half_x - 0.2, 0.022, 0.07), 0.003)
        garden.add(apron, "wood", (0.0, sx * (half_y - 0.07), TABLE_TOP - 0.07), smooth=False)
    garden.add(_runner(cloth_width, half_y), "cloth", (cloth_x, 0.0, 0.0))


def _runner(width: float, half_y: float) -> Shape:
    """The cloth by arc length: flat on the table, rounded at the edge, hanging with soft folds."""
    drop, edge = 0.20, 0.02
    u = np.linspace(-width / 2, width / 2, 97)
    v = np.linspace(-half_y - drop, half_y + drop, 181)
    uu, vv = np.meshgrid(u, v)
    over = np.maximum(np.abs(vv) - half_y, 0.0)
    bend = np.minimum(over / edge, np.pi / 2)
    hang = np.maximum(over - edge * np.pi / 2, 0.0)
    fold = (hang / drop) * 0.022 * np.sin(uu * 34.0 + np.sign(vv) * 1.3) + 0.10 * hang
    y = np.sign(vv) * (np.minimum(np.abs(vv), half_y) + edge * np.sin(bend) + fold)
    ripple = 0.0015 * (np.sin(uu * 23 + vv * 9) * np.sin(vv * 17 - uu * 5))
    z = TABLE_TOP + 0.004 + ripple * (over == 0) - edge * (1 - np.cos(bend)) - hang
    vertices = np.stack([uu, y, z], axis=2).reshape(-1, 3)
    surface = np.stack([uu, vv], axis=2).reshape(-1, 2)
    return Shape(vertices, grid_faces(len(v), len(u), wrap=False), surface)
