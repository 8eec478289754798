#!/usr/bin/env python3
"""Draws what `cargo bench --bench accuracy -- --csv F` wrote: errors of picture and gradient
against the time of an iteration, a line a knob.

    python3 tools/plot_accuracy.py accuracy.csv -o docs/images/accuracy.svg

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

# What is drawn of each knob: a changed loss or step is no error of a picture.
ERRORS = {
    "picture_rms": ("RMS error of the picture, levels of 255",
                    ["alpha-min", "transmittance-min", "depth-bits", "together"]),
    "gradient": ("relative error of the gradient",
                 ["alpha-min", "transmittance-min", "depth-bits", "storage", "ssim-window",
                  "together"]),
}

# The default's value of each knob that has several others: a line goes through them in order.
DEFAULTS = {"alpha-min": 1 / 255, "transmittance-min": 1e-4, "depth-bits": 32, "ssim-window": 11}
# The default but for rounding: how far its time is from 1 is what noise looks like.
AGAIN = ("alpha-min", "0.003922")
# A label says nothing of what lies on the default.
CLOSE = 0.05
# Where labels stand beside their points, so that those of two knobs keep clear of each other.
CORNER = {"xytext": (2, 2), "ha": "left"}
CORNERS = {
    "transmittance-min": {"xytext": (3, -7), "ha": "left"},
    "depth-bits": {"xytext": (-3, -2), "ha": "right"},
    "ssim-window": {"xytext": (-3, -7), "ha": "right"},
}

COLORS = {knob: f"C{number}" for number, knob in enumerate(ERRORS["gradient"][1])}


def tells(point: dict[str, str], default: dict[str, str], key: str) -> bool:
    """Whether a point's error is another than the default's."""
    return abs(float(point[key]) / float(default[key]) - 1) > CLOSE


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("csv", type=Path)
    parser.add_argument("-o", "--output", type=Path, required=True)
    arguments = parser.parse_args()
    with arguments.csv.open() as file:
        rows = list(csv.DictReader(file))
    subjects = list(dict.fromkeys(row["subject"] for row in rows))
    figure, axes = plt.subplots(len(subjects), len(ERRORS), figsize=(9, 3.2 * len(subjects)),
                                squeeze=False, layout="constrained")
    for subject, line in zip(subjects, axes):
        of_subject = [row for row in rows if row["subject"] == subject]
        for axis, (key, (label, knobs)) in zip(line, ERRORS.items()):
            default = next(row for row in of_subject if row["knob"] == "default")
            again = next(row for row in of_subject if (row["knob"], row["value"]) == AGAIN)
            band = [float(again[quartile]) for quartile in ("time_low", "time_high")]
            axis.axvspan(min(1.0, *band), max(1.0, *band), color="0.92", label="default again")
            for knob in knobs:
                points = [row for row in of_subject if row["knob"] == knob and row is not again]
                if knob in DEFAULTS:
                    points.append(default)
                    points.sort(key=lambda row: float(row["value"] or DEFAULTS[knob]))
                axis.plot([float(p["time"]) for p in points], [float(p[key]) for p in points],
                          marker="o", markersize=3, linewidth=0.8, color=COLORS[knob], label=knob)
                for point in points:
                    if knob != "together" and tells(point, default, key):
                        axis.annotate(point["value"], (float(point["time"]), float(point[key])),
                                      fontsize=6, color=COLORS[knob], textcoords="offset points",
                                      **CORNERS.get(knob, CORNER))
            axis.plot(float(default["time"]), float(default[key]), "k*", markersize=9,
                      label="default")
            axis.set_yscale("log")
            axis.margins(x=0.12)
            axis.set_xlabel("time of an iteration, default = 1")
            axis.set_ylabel(label)
            axis.set_title(subject, fontsize=9)
            axis.grid(alpha=0.3)
    axes[0][-1].legend(frameon=False, fontsize=7)
    figure.savefig(arguments.output, metadata={"Date": None})


if __name__ == "__main__":
    main()
