#!/usr/bin/env python3
"""Measures the peak memory of `fit` and `colorize` against the number of photos, and draws it.

    cargo build --release
    python3 tools/plot_memory.py -o docs/images/memory.svg

Captures are those of `make_large_capture.py`. The host's peak is the process's as the system counts
it; on a software adapter it has the device's memory in it, which is drawn beside it. Prints a
Markdown table. Needs matplotlib and Pillow (tools/requirements.txt).
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
# Text stays text, and two runs write the same file.
matplotlib.rcParams.update({"svg.fonttype": "none", "svg.hashsalt": "gs-chroma", "font.size": 9})

import matplotlib.pyplot as plt  # noqa: E402

TOOLS = Path(__file__).parent
PROGRAM = TOOLS.parent / "target/release/gs-chroma"
STAGES = {"luma": "fit", "chroma": "colorize"}
KINDS = {"peak_host_memory": "host", "peak_device_memory": "device"}
PHOTOS = [25, 50, 100, 200, 400, 800, 1600]
Peaks = dict[tuple[str, str], float]


def commands(photos: int, arguments: argparse.Namespace, folder: Path) -> list[list[str]]:
    """What makes, trains and colors a capture."""
    side = arguments.size.partition("x")[0]
    capture, teacher, run = (str(folder / name) for name in ["capture", "teacher", "run"])
    make = [sys.executable, str(TOOLS / "make_large_capture.py"), capture, "--teacher", teacher]
    make += ["--photos", str(photos), "--size", arguments.size]
    fit = [str(PROGRAM), "fit", capture, "-o", run, "--preset", "draft", "--max-side", side]
    limit = ["--memory-limit", str(arguments.memory_limit)]
    fit += ["--iterations", str(arguments.iterations), *limit]
    color = [str(PROGRAM), "colorize", run, "--teacher", teacher]
    color += ["--rounds", "2", *limit]
    return [make, fit, color]


def measured(photos: int, arguments: argparse.Namespace) -> Peaks:
    """Peaks in MiB by stage and kind."""
    with tempfile.TemporaryDirectory() as folder:
        for command in commands(photos, arguments, Path(folder)):
            quiet = subprocess.DEVNULL
            subprocess.run(command, check=True, stdout=quiet, stderr=quiet)
        report = json.loads((Path(folder) / "run/report.json").read_text(encoding="utf-8"))
    return {(stage, kind): report[stage][kind] / 2**20 for stage in STAGES for kind in KINDS}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-o", "--output", type=Path, required=True)
    parser.add_argument("--photos", type=int, nargs="+", default=PHOTOS)
    parser.add_argument("--size", default="800x600")
    parser.add_argument("--iterations", type=int, default=50)
    parser.add_argument("--memory-limit", type=int, default=384, help="in MiB")
    arguments = parser.parse_args()
    names = [f"{command}, {kind}" for command in STAGES.values() for kind in KINDS.values()]
    print(f"| photos | {' | '.join(names)} |\n|--:{'|--:' * len(names)}|", flush=True)
    found = {}
    for photos in arguments.photos:
        found[photos] = measured(photos, arguments)
        cells = [f"{peak:,.0f}" for peak in found[photos].values()]
        print(f"| {photos} | {' | '.join(cells)} |", flush=True)
    figure, axes = plt.subplots(1, 2, figsize=(8, 2.8), sharey=True, layout="constrained")
    for axis, (stage, command) in zip(axes, STAGES.items()):
        for kind, name in KINDS.items():
            peaks = [peaks[stage, kind] for peaks in found.values()]
            axis.plot(list(found), peaks, marker=".", label=name)
        axis.set_title(f"{command}, {arguments.size.replace('x', ' × ')}")
        axis.set_xscale("log")
        axis.set_xticks(list(found), [f"{photos}" for photos in found])
        axis.minorticks_off()
        axis.set_xlabel("photos")
        axis.grid(alpha=0.3)
    axes[0].set_ylim(bottom=0)
    axes[0].set_ylabel("peak, MiB")
    axes[0].legend(frameon=False)
    figure.savefig(arguments.output, metadata={"Date": None})


if __name__ == "__main__":
    main()
