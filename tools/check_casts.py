#!/usr/bin/env python3
"""What is to be expected of colors whose teacher gives every photo another cast.

    python3 tools/check_casts.py --svg docs/images/casts.svg

However well a scene is made from pictures of unsteady_teacher.py, it ends at best at the mean
saturation and cast of those in training, and that mean is not the truth. For each scene below DATA
(default $SCENES or scenes) this gives the held-out photos that mean, and takes their a/b error. To what is
expected of ours is added, as if the two were independent, what is left with the photos themselves
as teacher; that, and what ours and RGB splats reached, is read from the table that
check_color.py printed into RESULTS, as Markdown or CSV (default docs/experiments/colors.csv). An estimate, no bound: another method may
err less on the photos themselves. Prints it beside what was reached, and draws it as a share of the teacher's own error for several strengths of the casts and
many draws of them. No scene is trained. Needs numpy, Pillow and matplotlib.
"""

from __future__ import annotations

import argparse
import csv
import os
import sys
from dataclasses import dataclass
from pathlib import Path

import matplotlib
import numpy as np
from check_color import HEAD, TO_RGB_SPLATS, TO_TEACHER
from lab import Array, rgb_to_lab
from unsteady_teacher import (
    HOLDOUT_STEP,
    PATCHES,
    SHIFT,
    colored,
    mean_whim,
    photo_paths,
    read_photo,
    whim,
)

matplotlib.use("Agg")
# Text stays text, and two runs write the same file.
matplotlib.rcParams.update({"svg.fonttype": "none", "svg.hashsalt": "gs-chroma", "font.size": 9})

import matplotlib.pyplot as plt  # noqa: E402

CASTS = [1.0, 2.0, 4.0, 6.0, SHIFT, 12.0, 16.0]
# Casts and patches are as large in small pictures.
SIDE = 96


@dataclass
class Reached:
    """Held-out a/b errors of a scene: ours of the photos, then with the unsteady teacher."""

    oracle: float
    ours: float
    teacher: float
    rgb_splats: float


def reached(results: Path) -> dict[str, Reached]:
    """What the table of check_color.py says, by scene."""
    rows = {}
    for text in results.read_text(encoding="utf-8").splitlines():
        row = text.strip("|").split("|") if text.startswith("|") else next(csv.reader([text]), [])
        cells = [cell.strip(" *") for cell in row]
        if len(cells) >= len(HEAD) - 1 and cells[1] in ("oracle", "unsteady"):
            rows[cells[0], cells[1]] = dict(zip(HEAD, cells))
    scenes = {}
    for scene in dict.fromkeys(scene for scene, _ in rows):
        oracle, unsteady = rows[scene, "oracle"], rows[scene, "unsteady"]
        ours, to_teacher, to_rgb = (float(unsteady[key]) for key in HEAD[3:6])
        scenes[scene] = Reached(float(oracle[HEAD[3]]), ours, ours / to_teacher, ours / to_rgb)
    return scenes


def ab_error(ours: Array, truth: Array) -> float:
    """Root mean square over both channels, in CIELAB units."""
    return float(np.sqrt(np.mean((rgb_to_lab(ours) - rgb_to_lab(truth))[..., 1:] ** 2)))


def errors(photos: list[Array], count: int, seed: int, cast: float) -> tuple[float, float]:
    """The teacher's error and that of the mean view, over the held-out photos of `count`."""
    mean = mean_whim(seed, count, cast)
    pairs = []
    for k, photo in enumerate(photos):
        chance = np.random.default_rng([seed, k * HOLDOUT_STEP])
        teacher = colored(photo, whim(chance, cast), PATCHES, chance)
        pairs.append((ab_error(teacher, photo), ab_error(colored(photo, mean, 0, chance), photo)))
    teacher, least = np.mean(pairs, axis=0)
    return float(teacher), float(least)


def shares(folder: Path, oracle: float, seeds: int) -> dict[float, Array]:
    """For each cast and seed: the teacher's error, and as shares of it the mean view's and what is
    expected of ours."""
    paths = photo_paths(folder)
    photos = [read_photo(path, SIDE) for path in paths[::HOLDOUT_STEP]]
    found = {}
    for cast in CASTS:
        pairs = [errors(photos, len(paths), seed, cast) for seed in range(seeds)]
        rows = [(t, least / t, np.hypot(least, oracle) / t) for t, least in pairs]
        found[cast] = np.array(rows)
    return found


def draw(
    scenes: dict[str, dict[float, Array]], of_scene: dict[str, Reached], path: Path
) -> None:
    """A panel a scene: medians, and 10 to 90 % of the draws."""
    size = (3 * len(scenes), 3)
    figure, axes = plt.subplots(1, len(scenes), figsize=size, sharey=True, layout="constrained")
    for axis, (scene, found) in zip(np.atleast_1d(axes), scenes.items()):
        for column, name in ((1, "the mean view"), (2, "expected of ours")):
            low, middle, high = np.percentile(
                [rows[:, column] for rows in found.values()], [10, 50, 90], axis=1
            )
            axis.plot(list(found), middle, marker=".", label=name)
            axis.fill_between(list(found), low, high, alpha=0.2)
        there = of_scene[scene]
        axis.plot(SHIFT, found[SHIFT][0, 2], "kx", label="the same, seed 0")
        axis.plot(SHIFT, there.ours / there.teacher, "k*", label="ours, seed 0")
        axis.axhline(TO_TEACHER, color="gray", linestyle=":", label="bound")
        axis.set_title(scene)
        axis.set_xlabel("casts, σ in CIELAB units")
        axis.grid(alpha=0.3)
    figure.axes[0].set_ylim(0, 1.2)
    figure.axes[0].set_ylabel("held-out a/b error / teacher's")
    figure.axes[-1].legend(frameon=False, fontsize=7)
    figure.savefig(path, metadata={"Date": None})


def against(least: float, ours: float, bound: float) -> str:
    """Two shares, each bold where it misses the bound."""
    return ", ".join(f"{v:.2f}" if v <= bound else f"**{v:.2f}**" for v in (least, ours))


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--svg", type=Path, required=True)
    parser.add_argument("--data", type=Path, default=Path(os.environ.get("SCENES", "scenes")))
    parser.add_argument("--results", type=Path, default=Path("docs/experiments/colors.csv"))
    parser.add_argument("--seeds", type=int, default=20)
    arguments = parser.parse_args()
    print("| scene | the mean view | expected of ours | ours | / teacher's: expected, ours (≤ 0.4) | / RGB splats': expected, ours (≤ 0.6) |")
    print("|---|---|---|---|---|---|")
    of_scene = reached(arguments.results)
    scenes = {}
    for scene, there in of_scene.items():
        folder = arguments.data / scene / "images"
        if not folder.is_dir():
            print(f"{folder} is not there: skipped", file=sys.stderr)
            continue
        scenes[scene] = shares(folder, there.oracle, arguments.seeds)
        teacher, in_pictures, on_geometry = scenes[scene][SHIFT][0]
        least = on_geometry * teacher
        print(
            f"| {scene} | {in_pictures * teacher:.2f} | {least:.2f} | {there.ours:.2f}"
            f" | {against(least / there.teacher, there.ours / there.teacher, TO_TEACHER)}"
            f" | {against(least / there.rgb_splats, there.ours / there.rgb_splats, TO_RGB_SPLATS)} |",
            flush=True,
        )
    if scenes:
        draw(scenes, of_scene, arguments.svg)
    return 0


if __name__ == "__main__":
    sys.exit(main())
