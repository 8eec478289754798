#!/usr/bin/env python3
"""Held-out a/b error against the casts of an unsteady teacher, beside what no method could know.

    cargo build --release && python3 tools/check_casts.py -o target/color --svg casts.svg

A teacher gives every photo a saturation and a cast of its own (unsteady_teacher.py). However well
a scene is made from them, it ends at their mean, which is not the truth. `known` is what colorize
makes of a teacher whose every photo has that mean and no wrong patch: what is left of the error
when nothing is contradicted. `truth` is what it makes of the photos themselves. Scenes and runs are
those of check_color.py. Prints a Markdown table and draws it. Needs numpy, Pillow and matplotlib.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
# Text stays text, and two runs write the same file.
matplotlib.rcParams.update({"svg.fonttype": "none", "svg.hashsalt": "gs-chroma", "font.size": 9})

import matplotlib.pyplot as plt  # noqa: E402
from check_color import (  # noqa: E402
    SCENES,
    SIDE,
    TO_RGB_SPLATS,
    TO_TEACHER,
    TOOLS,
    by_method,
    fitted,
    line,
    run,
)

# Deviation of a cast's a and b, in CIELAB units; the bounds are for 8.
CASTS = [0, 4, 8, 16]
LINES = {
    "teacher": "the teacher's pictures",
    "rgb_splats": "RGB splats",
    "exported": "ours",
    "known": "ours, of the mean view",
    "truth": "ours, of the photos",
}
HEAD = ["scene", "cast", *LINES.values(), "ours / teacher's", "/ RGB splats'"]
HEAD += ["least / teacher's", "least / RGB splats'"]


def errors(program: str, run_folder: Path, teacher: Path, baselines: bool) -> dict[str, float]:
    """Held-out a/b error of each method, after colouring by this teacher."""
    asked = [str(run_folder), "--teacher", str(teacher)]
    run([program, "colorize", *asked])
    measure = [program, "eval", *asked, "--frames", "2", "--json"]
    found = json.loads(run([*measure, *(["--baselines"] if baselines else [])])[0])
    return {name: score["ab_error"] for name, score in by_method(found["pictures"]).items()}


def teacher(photos: Path, out: Path, cast: int, mean: bool) -> Path:
    """Makes a teacher's pictures."""
    folder = out / f"{'mean' if mean else 'cast'}-{cast}"
    script = [sys.executable, str(TOOLS / "unsteady_teacher.py"), str(photos), "-o", str(folder)]
    run([*script, "--max-side", str(SIDE), "--shift", str(cast), *(["--mean"] if mean else [])])
    return folder


def row(program: str, photos: Path, out: Path, cast: int, truth: float) -> dict[str, float]:
    """A point of each line."""
    found = errors(program, out / "run", teacher(photos, out, cast, False), True)
    mean = errors(program, out / "run", teacher(photos, out, cast, True), False)
    found |= {"known": mean["exported"], "truth": truth}
    return {key: found[key] for key in LINES}


def draw(scenes: dict[str, dict[int, dict[str, float]]], path: Path) -> None:
    """A panel a scene."""
    figure, axes = plt.subplots(
        1, len(scenes), figsize=(3 * len(scenes), 3), layout="constrained", squeeze=False
    )
    for axis, (scene, points) in zip(axes[0], scenes.items()):
        for key, name in LINES.items():
            style = "--" if key in ("known", "truth") else "-"
            axis.plot(list(points), [p[key] for p in points.values()], style, marker=".", label=name)
        axis.set_title(scene)
        axis.set_xlabel("cast, σ in CIELAB units")
        axis.set_ylim(bottom=0)
        axis.grid(alpha=0.3)
    axes[0][0].set_ylabel("held-out a/b error")
    axes[0][-1].legend(frameon=False, fontsize=7)
    figure.savefig(path, metadata={"Date": None})


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-o", "--output", type=Path, default=Path("target/color"))
    parser.add_argument("--svg", type=Path, required=True)
    parser.add_argument("--data", type=Path, default=Path("../shared/data"))
    parser.add_argument("--program", default="target/release/gs-chroma")
    parser.add_argument("--iterations", type=int, default=1000, help="of fit")
    parser.add_argument("--scenes", nargs="*", default=list(SCENES), choices=list(SCENES))
    parser.add_argument("--casts", nargs="*", type=int, default=CASTS)
    arguments = parser.parse_args()
    program = arguments.program
    line(HEAD)
    line(["---"] * len(HEAD))
    scenes: dict[str, dict[int, dict[str, float]]] = {}
    for scene in arguments.scenes:
        photos = arguments.data / scene / "images"
        if not photos.is_dir():
            print(f"{photos} is not there: skipped", file=sys.stderr)
            continue
        out = arguments.output / scene
        fitted(program, arguments.data / scene, out / "run", arguments.iterations)
        truth = errors(program, out / "run", photos, False)["exported"]
        points = scenes.setdefault(scene, {})
        for cast in arguments.casts:
            point = points[cast] = row(program, photos, out, cast, truth)
            figures = [f"{point[key]:.2f}" for key in LINES]
            for key in ("exported", "known"):
                figures += [f"{point[key] / point[other]:.2f}" for other in ("teacher", "rgb_splats")]
            line([scene, str(cast), *figures])
    if scenes:
        draw(scenes, arguments.svg)
    print(f"bounds at a cast of 8: {TO_TEACHER} and {TO_RGB_SPLATS}", file=sys.stderr)
    return 0


if __name__ == "__main__":
    sys.exit(main())
