#!/usr/bin/env python3
"""Draws agreement against nearness from the table of that name in docs/lab/07-chroma-solver.md: how
far views differ against the held-out a/b error, a panel for each scene with photos as teacher.

    python3 tools/plot_agreement.py -o docs/images/agreement.svg

Needs matplotlib (tools/requirements.txt).
"""

from __future__ import annotations

import argparse
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
# Text stays text, and two runs write the same file.
matplotlib.rcParams.update({"svg.fonttype": "none", "svg.hashsalt": "gs-chroma", "font.size": 9})

import matplotlib.pyplot as plt  # noqa: E402

NOTES = Path(__file__).parent.parent / "docs" / "lab" / "07-chroma-solver.md"
NAMED = {"default": ("C0", "o"), "ChromaDistill, code": ("C3", "D")}
Point = tuple[float, float]


def table() -> tuple[list[str], list[list[str]]]:
    """Head and rows of the section's table."""
    section = NOTES.read_text(encoding="utf-8").split("## Agreement against nearness")[1]
    lines = [line for line in section.split("\n## ")[0].splitlines() if line.startswith("|")]
    head, _, *rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]
    return head, rows


def points(cell: str) -> list[Point]:
    """Difference and error of each variant in a cell."""
    variants = [variant.split(",") for variant in cell.split(";") if variant]
    return [(float(difference), float(error)) for difference, error in variants]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-o", "--output", type=Path, required=True)
    output = parser.parse_args().output
    head, rows = table()
    scenes = [column for column, name in enumerate(head) if name.endswith("photos")]
    figure, panels = plt.subplots(1, len(scenes), figsize=(4.4 * len(scenes), 3.6))
    for panel, column in zip(panels, scenes):
        for row in rows:
            color, mark = NAMED.get(row[0], ("0.6", "."))
            found = points(row[column])
            if not found:
                continue
            label = row[0] if row[0] in NAMED else "variants"
            panel.plot(*zip(*found, strict=True), mark, color=color, label=label)
        panel.set_title(head[column].replace("`", ""))
        panel.set_xlabel("views' difference, a/b units")
        panel.grid(alpha=0.25)
    panels[0].set_ylabel("held-out a/b error")
    handles = dict(zip(*reversed(panels[0].get_legend_handles_labels())))
    panels[0].legend(handles.values(), handles.keys())
    figure.tight_layout()
    figure.savefig(output, metadata={"Date": None})


if __name__ == "__main__":
    main()
