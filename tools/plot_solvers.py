#!/usr/bin/env python3
"""Draws what `cargo bench --bench solvers -- RUN TEACHER --csv SCENE.csv` wrote, a row of panels for
each file: loss against seconds and against view passes, both solvers. Prints as Markdown what least
squares need to reach the loss that Adam ends at.

    python3 tools/plot_solvers.py fern-llff.csv brighton-drone.csv -o docs/images/solvers.svg

Needs matplotlib (tools/requirements.txt).
"""

from __future__ import annotations

import argparse
import csv
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
# Text stays text, and two runs write the same file.
matplotlib.rcParams.update({"svg.fonttype": "none", "svg.hashsalt": "gs-chroma", "font.size": 9})

import matplotlib.pyplot as plt  # noqa: E402

NAMES = {"irls": "least squares", "adam": "Adam"}
Point = dict[str, float]
# Losses up to this many times the least are shown: where the curves meet.
SHOWN = 1.3


def read(path: Path) -> dict[str, list[Point]]:
    """The curve of each solver: step, passes, seconds, objective."""
    with path.open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    curves: dict[str, list[Point]] = {name: [] for name in NAMES}
    for row in rows:
        curves[row.pop("solver")].append({key: float(value) for key, value in row.items()})
    return curves


def compared(scene: str, curves: dict[str, list[Point]]) -> list[str]:
    """Cells: where Adam ends, and the first point of least squares at or below that."""
    end = curves["adam"][-1]
    cells = [scene, f"{end['objective']:.4f}", f"{end['passes']:,.0f}", f"{end['seconds']:.0f}"]
    reached = [point for point in curves["irls"] if point["objective"] <= end["objective"]]
    if not reached:
        return [*cells, "not reached", "", "", ""]
    first = reached[0]
    return [
        *cells,
        f"{first['passes']:,.0f}",
        f"{first['seconds']:.1f}",
        f"{end['passes'] / first['passes']:.0f}",
        f"{end['seconds'] / first['seconds']:.0f}",
    ]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("csv", type=Path, nargs="+", help="named after its scene")
    parser.add_argument("-o", "--output", type=Path, required=True)
    arguments = parser.parse_args()
    scenes = {path.stem: read(path) for path in arguments.csv}
    head = ["scene", "Adam's loss", "its view passes", "its seconds"]
    head += ["passes to reach it", "seconds to reach it", "ratio of passes", "of seconds"]
    print("| " + " | ".join(head) + " |\n|---" + "|--:" * (len(head) - 1) + "|")
    figure, rows = plt.subplots(
        len(scenes), 2, figsize=(8, 2.6 * len(scenes)), sharey="row", squeeze=False, layout="constrained"
    )  # fmt: skip
    for axes, (scene, curves) in zip(rows, scenes.items()):
        print("| " + " | ".join(compared(scene, curves)) + " |")
        for axis, key, label in zip(axes, ["seconds", "passes"], ["seconds", "view passes"]):
            for solver, name in NAMES.items():
                points = curves[solver]
                axis.plot(
                    [point[key] for point in points],
                    [point["objective"] for point in points],
                    marker=".",
                    label=name,
                )
            axis.set_xscale("log")
            axis.set_xlabel(label)
            axis.set_title(scene)
            axis.grid(alpha=0.3)
        least = min(point["objective"] for points in curves.values() for point in points)
        axes[0].set_ylim(0.99 * least, SHOWN * least)
        axes[0].set_ylabel("loss, CIELAB units")
        axes[0].legend(frameon=False)
    figure.savefig(arguments.output, metadata={"Date": None})


if __name__ == "__main__":
    main()
