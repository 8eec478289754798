#!/usr/bin/env python3
"""Makes an unsteady teacher out of color photos: right on the whole, wrong in each view by itself.

    python3 tools/unsteady_teacher.py scene/images -o target/unsteady

Every photo keeps its L*. Its saturation is multiplied by a number between 0.6 and 1.1, its a and b
are shifted by normal numbers of standard deviation 8, and three rectangles of 15 to 25 % of a side
get a wrong color. Numbers depend on the seed and the photo's place among the names. Needs numpy
and Pillow.

`--mean` makes a teacher that agrees with itself instead: every photo has the saturation and the
cast that those in training have on average, and no patch. check_casts.py estimates from it
what can be expected of the unsteady one.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np
from lab import Array, lab_to_rgb, rgb_to_lab
from PIL import Image

SATURATION = (0.6, 1.1)
SHIFT = 8.0
PATCHES = 3
PATCH_SIDE = (0.15, 0.25)
# Photos 0, 8, 16, … are held out by `fit`: what is said of them teaches nothing.
HOLDOUT_STEP = 8
# A wrong color is as strong as a real one, and of any hue.
PATCH_CHROMA = (20.0, 60.0)


def whim(chance: np.random.Generator, shift: float) -> Array:
    """A view's saturation and the cast of its a and b."""
    saturation = chance.uniform(*SATURATION)
    return np.array([saturation, *chance.normal(0.0, shift, 2)])


def mean_whim(seed: int, count: int, shift: float) -> Array:
    """The mean over those of `count` views that are not held out, or over all if they are few."""
    learned = [index for index in range(count) if index % HOLDOUT_STEP] if count > 2 else range(count)
    return np.mean([whim(np.random.default_rng([seed, index]), shift) for index in learned], axis=0)


def colored(rgb: Array, whim: Array, patches: int, chance: np.random.Generator) -> Array:
    """An sRGB picture (height, width, 3) in [0, 1] with colors as of a whim."""
    lab = rgb_to_lab(rgb)
    height, width = lab.shape[:2]
    lab[..., 1:] = lab[..., 1:] * whim[0] + whim[1:]
    for _ in range(patches):
        w, h = (chance.uniform(*PATCH_SIDE, 2) * (width, height)).astype(int).clip(1)
        x, y = chance.integers(width - w + 1), chance.integers(height - h + 1)
        chroma, hue = chance.uniform(*PATCH_CHROMA), chance.uniform(0.0, 2.0 * np.pi)
        lab[y : y + h, x : x + w, 1:] = chroma * np.cos(hue), chroma * np.sin(hue)
    return in_gamut(lab)


def in_gamut(lab: Array) -> Array:
    """sRGB of the same L* and hue, with as much of the chroma as fits (12 halvings)."""
    inside, outside = np.zeros(lab.shape[:2]), np.ones(lab.shape[:2])

    def scaled(share: Array) -> Array:
        return np.concatenate([lab[..., :1], lab[..., 1:] * share[..., None]], axis=-1)

    def fits(share: Array) -> Array:
        back = rgb_to_lab(lab_to_rgb(scaled(share)))
        return np.abs(back - scaled(share)).max(axis=-1) < 0.1

    inside[fits(outside)] = 1.0
    for _ in range(12):
        middle = (inside + outside) / 2
        good = fits(middle)
        inside, outside = np.where(good, middle, inside), np.where(good, outside, middle)
    return lab_to_rgb(scaled(inside))


def photo_paths(folder: Path) -> list[Path]:
    """The photos below a folder, in the order of their names."""
    known = {".png", ".jpg", ".jpeg"}
    return sorted(path for path in folder.rglob("*") if path.suffix.lower() in known)


def read_photo(path: Path, max_side: int) -> Array:
    """A photo as sRGB (height, width, 3) in [0, 1], shrunk unless `max_side` is 0."""
    with Image.open(path) as opened:
        photo = opened.convert("RGB")
    if max_side:
        photo.thumbnail((max_side, max_side), Image.Resampling.BOX)
    return np.asarray(photo, dtype=np.float64) / 255.0


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("photos", type=Path)
    parser.add_argument("-o", "--output", type=Path, required=True)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--max-side", type=int, default=0, help="shrink photos first (pixels)")
    parser.add_argument("--shift", type=float, default=SHIFT, help="deviation of a cast's a and b")
    parser.add_argument("--patches", type=int, default=PATCHES, help="wrong patches in a view")
    parser.add_argument("--mean", action="store_true", help="the mean view, for all")
    arguments = parser.parse_args()
    names = photo_paths(arguments.photos)
    if not names:
        print(f"{arguments.photos}: holds no .png, .jpg or .jpeg image", file=sys.stderr)
        return 1
    mean = mean_whim(arguments.seed, len(names), arguments.shift)
    for index, path in enumerate(names):
        chance = np.random.default_rng([arguments.seed, index])
        view = whim(chance, arguments.shift)
        rgb = read_photo(path, arguments.max_side)
        if arguments.mean:
            picture = colored(rgb, mean, 0, chance)
        else:
            picture = colored(rgb, view, arguments.patches, chance)
        out = arguments.output / path.relative_to(arguments.photos).with_suffix(".png")
        out.parent.mkdir(parents=True, exist_ok=True)
        Image.fromarray((picture * 255.0).round().astype(np.uint8)).save(out)
    print(f"wrote {len(names)} pictures to {arguments.output}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
