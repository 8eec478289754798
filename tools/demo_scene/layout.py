"""What stands where, in which light: the demo by hand, training scenes by chance."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from .materials import Palette
from .props import FOOTPRINT, TABLE_HALF, TABLE_TOP

ON_TABLE = ("vase", "bowl", "lemons", "bananas", "apples", "pitcher", "kettle", "pumpkin")
ON_LAWN = ("pumpkin", "planter", "crate", "kettle", "vase")
MANY_TRIES = 60


@dataclass
class Item:
    """One movable thing: a key of `props.ITEMS`, its place, turn (radians) and size factor."""

    kind: str
    x: float
    y: float
    z: float
    turn: float
    size: float = 1.0


@dataclass
class Light:
    """Sun direction (degrees), strength (W/m2), warmth 0 to 1, and strength of the open sky."""

    azimuth: float = 215.0
    elevation: float = 48.0
    strength: float = 3.6
    warmth: float = 0.5
    sky: float = 0.95


@dataclass
class Layout:
    """Everything that distinguishes one scene of this little world from another."""

    seed: int
    items: list[Item]
    light: Light = field(default_factory=Light)
    palette: Palette = field(default_factory=Palette)
    cloth_x: float = 0.02
    cloth_width: float = 0.78


def demo_layout() -> Layout:
    """The scene of `assets/demo`, arranged by hand."""
    top = TABLE_TOP + 0.006
    wood = TABLE_TOP
    items = [
        Item("bowl", 0.02, -0.06, top, 0.4, 1.1),
        Item("vase", -0.22, 0.20, top, 1.0, 1.05),
        Item("pitcher", 0.25, 0.23, top, 5.6, 1.05),
        Item("bananas", -0.28, -0.33, top, 0.5, 1.35),
        Item("apples", 0.27, -0.27, top, 0.9, 1.1),
        Item("pumpkin", -0.57, 0.12, wood, 0.7, 0.95),
        Item("kettle", 0.58, 0.02, wood, 0.5, 1.0),
        Item("lemons", 0.60, -0.27, wood, 0.2, 1.0),
        Item("pumpkin", 0.46, -0.74, 0.0, 2.0, 1.2),
        Item("pumpkin", 0.82, -0.62, 0.0, 0.3, 0.85),
        Item("planter", -1.12, -0.12, 0.0, 0.4, 1.35),
        Item("planter", 1.18, 0.48, 0.0, 2.2, 1.45),
        Item("crate", -0.62, -0.72, 0.0, 0.3, 0.95),
    ]
    return Layout(seed=7, items=items)


def random_layout(seed: int) -> Layout:
    """Another arrangement, light and shade of color; the same seed gives the same scene."""
    rng = np.random.default_rng([20250, seed])
    cloth_width = float(rng.uniform(0.5, 1.0))
    cloth_x = float(rng.uniform(-0.3, 0.3))
    items: list[Item] = []

    def try_item(
        kinds: tuple[str, ...], low: tuple[float, float], high: tuple[float, float], table: bool
    ) -> None:
        kind = str(rng.choice(kinds))
        size = float(rng.uniform(0.85, 1.25)) * (1.0 if table else float(rng.uniform(0.9, 1.3)))
        radius = FOOTPRINT[kind] * size
        for _ in range(MANY_TRIES):
            x, y = rng.uniform(low, high)
            under = abs(x) < TABLE_HALF[0] + radius and abs(y) < TABLE_HALF[1] + radius
            close = any(
                (i.z > 0) == table
                and np.hypot(i.x - x, i.y - y) < radius + FOOTPRINT[i.kind] * i.size
                for i in items
            )
            if close or (under and not table):
                continue
            z = 0.0
            if table:
                z = TABLE_TOP + 0.006 * (abs(x - cloth_x) < cloth_width / 2)
            items.append(Item(kind, float(x), float(y), z, float(rng.uniform(0, 6.28)), size))
            return

    for _ in range(int(rng.integers(5, 10))):
        try_item(ON_TABLE, (-0.68, -0.34), (0.68, 0.34), table=True)
    for _ in range(int(rng.integers(3, 8))):
        try_item(ON_LAWN, (-1.7, -1.3), (1.7, 0.9), table=False)
    light = Light(
        azimuth=float(rng.uniform(120, 240)),
        elevation=float(rng.uniform(30, 65)),
        strength=float(rng.uniform(2.2, 4.6)),
        warmth=float(rng.uniform(0.2, 0.8)),
        sky=float(rng.uniform(0.5, 1.1)),
    )
    return Layout(seed, items, light, Palette().tuned(rng), cloth_x, cloth_width)
