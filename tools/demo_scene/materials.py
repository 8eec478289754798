"""The garden's surfaces: each has its own pattern, so a gray photo still tells its color.

Every function takes a `Palette` and returns a Blender material.
"""

from __future__ import annotations

import colorsys
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from .nodes import Color, Graph

BASE_COLORS: dict[str, str] = {
    "grass": "#5f9a2c",
    "soil": "#4b3a2a",
    "brick": "#a8472f",
    "mortar": "#b9afa0",
    "ivy": "#2f6b2a",
    "wood": "#9a6a3c",
    "cloth": "#c3202c",
    "cobalt": "#1f4fb0",
    "lemon": "#f2c81c",
    "banana": "#eec733",
    "apple": "#b5161c",
    "pumpkin": "#e8761a",
    "stem": "#77733a",
    "terracotta": "#b8623c",
    "leaf": "#4f8a35",
    "violet": "#7a3fb5",
    "daisy": "#f4f1e6",
    "heart": "#eeb21c",
    "enamel": "#e9e4d6",
    "iron": "#1c1d20",
}


@dataclass
class Palette:
    """Base colors as linear sRGB; `tuned` shifts each of them a little by chance."""

    colors: dict[str, Color] = field(
        default_factory=lambda: {name: linear(code) for name, code in BASE_COLORS.items()}
    )

    def __getitem__(self, name: str) -> Color:
        """The base color of that name."""
        return self.colors[name]

    def shade(self, name: str, value: float, saturation: float = 1.0, hue: float = 0.0) -> Color:
        """A relative of a base color: brightness and saturation factors, hue shift in turns."""
        h, s, v = colorsys.rgb_to_hsv(*self.colors[name])
        r, g, b = colorsys.hsv_to_rgb((h + hue) % 1.0, min(s * saturation, 1.0), v * value)
        return (min(r, 1.0), min(g, 1.0), min(b, 1.0))

    def tuned(self, rng: np.random.Generator) -> Palette:
        """Every color with a small random change of hue, saturation and brightness."""
        changed = {}
        for name in self.colors:
            hue = float(rng.normal(0.0, 0.008))
            saturation = float(rng.uniform(0.94, 1.06))
            changed[name] = self.shade(name, float(rng.uniform(0.85, 1.15)), saturation, hue)
        return Palette(changed)


def linear(code: str) -> Color:
    """A "#rrggbb" sRGB color as linear light."""
    encoded = np.array([int(code[i : i + 2], 16) / 255 for i in (1, 3, 5)])
    light = np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)
    return (float(light[0]), float(light[1]), float(light[2]))


def grass(p: Palette) -> Any:
    """Blades of many greens, dark at the root, lit through."""
    g = Graph("grass")
    tint = g.ramp(
        g.per_piece(),
        [(0.0, p.shade("grass", 0.55, 1.05, 0.02)), (0.5, p["grass"]),
         (0.9, p.shade("grass", 1.35, 0.95, -0.02)), (1.0, p.shade("grass", 1.7, 0.75, -0.06))],
    )  # fmt: skip
    height = g.component(g.attribute("surface"), "Y")
    dark = g.mix(1.0, tint, (0.3, 0.3, 0.3), "MULTIPLY")
    return g.finish(g.mix(g.step(height, -0.2, 0.9), dark, tint), 0.55, translucent=0.25)


def soil(p: Palette) -> Any:
    """Brown earth between the blades."""
    g = Graph("soil")
    grain = g.noise(g.position(), 30.0, 6.0, 0.7)
    return g.finish(
        g.ramp(grain, [(0.3, p.shade("soil", 0.4)), (0.7, p["soil"])]), 0.95, grain, 0.01
    )


def brick(p: Palette) -> Any:
    """Fired clay, every brick its own shade, pitted and worn."""
    g = Graph("brick")
    place = g.position()
    base = g.ramp(
        g.per_piece(),
        [(0.0, p.shade("brick", 0.45, 0.95)), (0.35, p["brick"]), (0.7, p.shade("brick", 1.25)),
         (1.0, p.shade("brick", 1.6, 0.8, 0.015))],
    )  # fmt: skip
    grain = g.noise(place, 55.0, 6.0, 0.7)
    pits = g.cells(place, 90.0)
    worn = g.mix(g.step(grain, 0.3, 0.72), g.mix(1.0, base, (0.4, 0.36, 0.36), "MULTIPLY"), base)
    bump = g.math("ADD", grain, g.math("MULTIPLY", pits, 0.4))
    return g.finish(worn, 0.9, bump, 0.006)


def mortar(p: Palette) -> Any:
    """Pale sandy joints."""
    g = Graph("mortar")
    grain = g.noise(g.position(), 60.0, 8.0, 0.75)
    tone = g.ramp(grain, [(0.3, p.shade("mortar", 0.5)), (0.7, p["mortar"])])
    return g.finish(tone, 0.95, grain, 0.006)


def _foliage(p: Palette, name: str, gloss: float) -> Any:
    g = Graph(name)
    surface = g.attribute("surface")
    across, along = g.component(surface, "X"), g.component(surface, "Y")
    tint = g.ramp(
        g.per_piece(),
        [
            (0.0, p.shade(name, 0.5, 1.1, 0.02)),
            (0.6, p[name]),
            (1.0, p.shade(name, 1.7, 0.9, -0.03)),
        ],
    )
    wave = g.math(
        "SINE", g.math("MULTIPLY", g.math("ADD", along, g.math("ABSOLUTE", across)), 40.0)
    )
    rib = g.math("SUBTRACT", 1.0, g.step(g.math("ABSOLUTE", across), 0.0, 0.05))
    vein = g.math("MAXIMUM", rib, g.step(wave, 0.75, 1.0))
    light = g.mix(1.0, tint, (1.9, 1.8, 1.7), "MULTIPLY")
    return g.finish(g.mix(g.math("MULTIPLY", vein, 0.6), tint, light), gloss, translucent=0.2)


def ivy(p: Palette) -> Any:
    """Glossy dark leaves with light veins."""
    return _foliage(p, "ivy", 0.35)


def leaf(p: Palette) -> Any:
    """Soft mid-green leaves with light veins."""
    return _foliage(p, "leaf", 0.5)


def _petal(p: Palette, name: str) -> Any:
    g = Graph(name)
    along = g.component(g.attribute("surface"), "Y")
    tone = g.ramp(
        along, [(0.0, p.shade(name, 0.5)), (0.6, p[name]), (1.0, p.shade(name, 1.25, 0.9))]
    )
    return g.finish(tone, 0.6, translucent=0.2)


def violet(p: Palette) -> Any:
    """Petals, dark towards the heart."""
    return _petal(p, "violet")


def daisy(p: Palette) -> Any:
    """White petals."""
    return _petal(p, "daisy")


def heart(p: Palette) -> Any:
    """The yellow middle of a daisy."""
    g = Graph("heart")
    grain = g.cells(g.position(), 700.0)
    return g.finish(g.ramp(grain, [(0.0, p["heart"]), (1.0, p.shade("heart", 0.5))]), 0.8)


def wood(p: Palette) -> Any:
    """Oiled planks: figure and fibre along x, one shade per board."""
    g = Graph("wood")
    place = g.position((1.0, 9.0, 9.0))
    rings = g.noise(place, 1.6, 3.0, 0.5, 2.5)
    fibre = g.noise(g.position((3.0, 90.0, 90.0)), 1.5, 6.0, 0.7)
    figure = g.math("ADD", g.math("MULTIPLY", rings, 0.5), g.math("MULTIPLY", fibre, 0.5))
    tone = g.ramp(
        figure,
        [(0.32, p.shade("wood", 0.3, 1.05)), (0.5, p["wood"]), (0.68, p.shade("wood", 1.6, 0.9))],
    )
    board = g.ramp(g.per_object(), [(0.0, (0.7, 0.7, 0.7)), (1.0, (1.15, 1.1, 1.05))])
    return g.finish(g.mix(1.0, tone, board, "MULTIPLY"), 0.55, figure, 0.002)


def cloth(p: Palette) -> Any:
    """Gingham: two sets of stripes whose crossings are full color, and a woven thread bump."""
    g = Graph("cloth")
    surface = g.attribute("surface")
    u, v = g.component(surface, "X"), g.component(surface, "Y")

    def stripe(axis: Any) -> Any:
        return g.step(g.math("SINE", g.math("MULTIPLY", axis, 2 * np.pi / 0.08)), -0.06, 0.06)

    amount = g.math("MULTIPLY", g.math("ADD", stripe(u), stripe(v)), 0.5)
    white = (0.82, 0.80, 0.76)
    tone = g.ramp(
        amount, [(0.0, white), (0.5, p.shade("cloth", 1.15, 0.78)), (1.0, p.shade("cloth", 0.8))]
    )
    threads = g.math(
        "ADD",
        g.math("SINE", g.math("MULTIPLY", u, 2200.0)),
        g.math("SINE", g.math("MULTIPLY", v, 2200.0)),
    )
    crumple = g.noise(g.position(), 14.0, 3.0)
    fuzz = g.mix(
        g.step(g.noise(g.position(), 160.0), 0.3, 0.7), (0.78, 0.78, 0.78), (1.0, 1.0, 1.0)
    )
    bump = g.math("ADD", g.math("MULTIPLY", threads, 0.05), crumple)
    return g.finish(g.mix(1.0, tone, fuzz, "MULTIPLY"), 0.9, bump, 0.006)


def cobalt(p: Palette) -> Any:
    """Blue glaze with darker runs and a spatter of bright specks."""
    g = Graph("cobalt")
    place = g.position((1.0, 1.0, 0.35))
    runs = g.noise(place, 18.0, 5.0, 0.6, 1.5)
    speck = g.step(g.cells(g.position(), 75.0), 0.16, 0.26)
    glaze = g.ramp(
        runs,
        [(0.32, p.shade("cobalt", 0.3)), (0.5, p["cobalt"]), (0.68, p.shade("cobalt", 1.9, 0.75))],
    )
    return g.finish(g.mix(speck, p.shade("cobalt", 3.0, 0.4), glaze), 0.2, runs, 0.002, coat=0.6)


def enamel(p: Palette) -> Any:
    """Off-white enamel, crazed and chipped here and there."""
    g = Graph("enamel")
    chips = g.step(g.noise(g.position(), 16.0, 6.0, 0.65), 0.34, 0.37)
    tone = g.ramp(g.noise(g.position(), 5.0), [(0.3, p.shade("enamel", 0.82)), (0.7, p["enamel"])])
    return g.finish(g.mix(chips, p["iron"], tone), 0.25, chips, 0.001, coat=0.4)


def iron(p: Palette) -> Any:
    """Black, grainy cast iron."""
    g = Graph("iron")
    grain = g.noise(g.position(), 120.0, 6.0, 0.75)
    return g.finish(
        g.ramp(grain, [(0.3, p.shade("iron", 0.5)), (0.8, p.shade("iron", 2.2))]),
        0.45,
        grain,
        0.003,
    )


def lemon(p: Palette) -> Any:
    """Yellow peel with pores, greenish in patches."""
    g = Graph("lemon")
    pores = g.cells(g.position(), 130.0)
    patch = g.noise(g.position(), 14.0)
    tone = g.ramp(patch, [(0.3, p.shade("lemon", 0.72, 1.0, 0.02)), (0.6, p["lemon"])])
    return g.finish(tone, 0.4, pores, 0.0012)


def banana(p: Palette) -> Any:
    """Yellow with brown flecks, brown at both ends (`surface.Y` runs along the fruit)."""
    g = Graph("banana")
    along = g.component(g.attribute("surface"), "Y")
    brown = (0.07, 0.04, 0.015)
    flecks = g.step(g.noise(g.position((1.0, 1.0, 1.0)), 70.0, 4.0, 0.7), 0.62, 0.68)
    ends = g.math(
        "MAXIMUM", g.step(along, 0.9, 0.97), g.math("SUBTRACT", 1.0, g.step(along, 0.04, 0.09))
    )
    tone = g.ramp(
        along, [(0.05, p.shade("banana", 0.7, 1.0, 0.05)), (0.25, p["banana"]), (1.0, p["banana"])]
    )
    return g.finish(
        g.mix(g.math("MAXIMUM", g.math("MULTIPLY", flecks, 0.8), ends), tone, brown), 0.45
    )


def apple(p: Palette) -> Any:
    """Red with pale streaks from the stem and small dots."""
    g = Graph("apple")
    streak = g.noise(g.position((60.0, 60.0, 7.0)), 1.6, 4.0, 0.6)
    dots = g.math("SUBTRACT", 0.4, g.step(g.cells(g.position(), 190.0), 0.0, 0.6))
    tone = g.ramp(
        streak,
        [
            (0.35, p.shade("apple", 0.6)),
            (0.55, p["apple"]),
            (0.75, p.shade("apple", 2.0, 0.85, 0.03)),
        ],
    )
    return g.finish(g.mix(dots, tone, p.shade("apple", 2.2, 0.7, 0.03)), 0.3, coat=0.3)


def pumpkin(p: Palette) -> Any:
    """Mottled orange skin with small warts."""
    g = Graph("pumpkin")
    skin = g.noise(g.position((1.0, 1.0, 0.3)), 30.0, 6.0, 0.65)
    warts = g.cells(g.position(), 60.0)
    tone = g.ramp(
        skin,
        [
            (0.3, p.shade("pumpkin", 0.5, 1.0, -0.01)),
            (0.5, p["pumpkin"]),
            (0.72, p.shade("pumpkin", 1.35, 0.9, 0.015)),
        ],
    )
    return g.finish(tone, 0.5, g.math("ADD", skin, g.math("MULTIPLY", warts, 0.3)), 0.006)


def stem(p: Palette) -> Any:
    """Fibrous, olive to brown."""
    g = Graph("stem")
    fibre = g.noise(g.position((60.0, 60.0, 8.0)), 2.0)
    return g.finish(
        g.ramp(fibre, [(0.3, p.shade("stem", 0.4)), (0.7, p["stem"])]), 0.9, fibre, 0.004
    )


def terracotta(p: Palette) -> Any:
    """Stained clay with the rings of the wheel."""
    g = Graph("terracotta")
    stain = g.noise(g.position((1.0, 1.0, 2.5)), 9.0, 6.0, 0.65)
    rings = g.bands(g.position(), 32.0, 1.0, "Z")
    tone = g.ramp(
        stain,
        [
            (0.3, p.shade("terracotta", 0.55)),
            (0.52, p["terracotta"]),
            (0.72, p.shade("terracotta", 1.4, 0.7)),
        ],
    )
    return g.finish(tone, 0.9, g.math("ADD", stain, g.math("MULTIPLY", rings, 0.3)), 0.003)


MAKERS: dict[str, Callable[[Palette], Any]] = {
    maker.__name__: maker
    for maker in (
        grass, soil, brick, mortar, ivy, leaf, violet, daisy, heart, wood, cloth, cobalt, enamel,
        iron, lemon, banana, apple, pumpkin, stem, terracotta,
    )
}  # fmt: skip


def make_all(palette: Palette) -> dict[str, Any]:
    """All materials by name."""
    return {name: maker(palette) for name, maker in MAKERS.items()}
