#!/usr/bin/env python3
"""Draws what `cargo bench --bench solvers -- RUN TEACHER --csv F` wrote: loss against seconds and
against view passes, both solvers.

    python3 tools/plot_solvers.py solvers.csv -o docs/images/solvers.svg

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


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("csv", type=Path)
    parser.add_argument("-o", "--output", type=Path, required=True)
    arguments = parser.parse_args()
    with arguments.csv.open() as file:
        points = list(csv.DictReader(file))
    figure, axes = plt.subplots(1, 2, figsize=(8, 3), sharey=True, layout="constrained")
    for axis, key, label in zip(axes, ["seconds", "passes"], ["seconds", "view passes"]):
        for solver, name in NAMES.items():
            of_solver = [p for p in points if p["solver"] == solver]
            x = [float(p[key]) for p in of_solver]
            y = [float(p["objective"]) for p in of_solver]
            axis.plot(x, y, marker=".", label=name)
        axis.set_xscale("log")
        axis.set_xlabel(label)
        axis.grid(alpha=0.3)
    axes[0].set_ylabel("loss, CIELAB units")
    axes[0].legend(frameon=False)
    figure.savefig(arguments.output, metadata={"Date": None})


if __name__ == "__main__":
    main()
