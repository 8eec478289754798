#!/usr/bin/env python3
"""Prints as Markdown where runs that went on to the end would have ended with other rules for
a flat curve (`src/luma/trainer/ends.rs`), by the curves in their `report.json`.

    gs-chroma fit $SCENES/banana-object --preset balanced --max-side 160 --max-splats 5000 --iterations 7000 -o target/flat/banana
    python3 tools/replay_flat.py target/flat/* --gains 0.1,0.3 --from 1050,1750

What a run would have ended with only a run tells: of what remains after a verdict, the table
has the best look before it and the best that was still to come.
"""

from __future__ import annotations

import argparse
import json
from math import ceil, log2
from pathlib import Path
from statistics import linear_regression

# As in src/luma: a run settles for so much of the iterations before, all harmonics get so much
# longer than passed until the last came, and no verdict falls once the whole run settles.
SETTLING_SHARE = 0.2
HARMONICS_SHOW = 1.25
SETTLE_FROM = 0.7
PAPER_ITERATIONS, PAPER_RAISE_EVERY = 15_000, 1_000
RAISED_BY = 250
POINTS_MIN = 3

Point = tuple[int, float]


def gain_of_doubling(curve: list[Point]) -> float | None:
    """Slope of PSNR against log2 of the iteration over the last half."""
    points = [point for point in curve if 2 * point[0] >= curve[-1][0]]
    if len(points) < POINTS_MIN:
        return None
    doublings = [log2(iteration) for iteration, _ in points]
    return linear_regression(doublings, [psnr for _, psnr in points]).slope


def full_degree_from(iterations: int, degree: int) -> int:
    return degree * min(ceil(PAPER_RAISE_EVERY * iterations / PAPER_ITERATIONS), RAISED_BY)


def verdict(curve: list[Point], iterations: int, degree: int, gain: float, begin: int) -> int | None:
    """Index of the look after which the curve is called flat."""
    first = max(begin, HARMONICS_SHOW * full_degree_from(iterations, degree))
    for index, (iteration, _) in enumerate(curve):
        slope = gain_of_doubling(curve[: index + 1])
        if first <= iteration < SETTLE_FROM * iterations and slope is not None and slope < gain:
            return index
    return None


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("runs", nargs="+", type=Path, help="folders of `fit --iterations`")
    parser.add_argument("--gains", default="0.1,0.3", help="in dB for twice the iterations")
    parser.add_argument("--from", dest="begins", default="1050", help="no verdict before so many iterations")
    arguments = parser.parse_args()
    rules = [
        (float(gain), int(begin))
        for begin in arguments.begins.split(",")
        for gain in arguments.gains.split(",")
    ]
    print("| run | flat below, from | verdict after | best look before | iterations in all | best look of all |")
    print("|---|---|--:|--:|--:|--:|")
    for run in arguments.runs:
        luma = json.loads((run / "report.json").read_text())["luma"]
        curve = [(point["iteration"], point["psnr"]) for point in luma["curve"]]
        iterations, degree = luma["iterations"], luma["settings"]["sh_degree"]
        whole = full_degree_from(iterations, degree)
        best_of_all = max(curve, key=lambda point: point[1])
        for gain, begin in rules:
            index = verdict(curve, iterations, degree, gain, begin)
            row = ["never", "", str(iterations)]
            if index is not None:
                best = max((p for p in curve[: index + 1] if p[0] > whole), key=lambda p: p[1])
                settling = ceil(SETTLING_SHARE * best[0])
                row = [str(curve[index][0]), shown(best), str(curve[index][0] + settling)]
            print(f"| {run.name} | {gain} dB, {begin} | {' | '.join(row)} | {shown(best_of_all)} |")
    return 0


def shown(point: Point) -> str:
    return f"{point[1]:.2f} dB after {point[0]}"


if __name__ == "__main__":
    raise SystemExit(main())
