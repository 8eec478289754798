#!/usr/bin/env python3
"""Runs `fit` and `colorize` on real scenes and prints what came out as Markdown.

Each scene is a COLMAP folder of color photos below DATA (default $SCENES or scenes).
The photos are turned to gray by the program; they serve as the teacher and as
the truth. Scenes that are not there are skipped with a word.

    cargo build --release && python3 tools/check_scenes.py -o target/scenes
"""

from __future__ import annotations

import argparse
import json
import os
import shlex
import subprocess
import sys
import time
from pathlib import Path

# Scene, longer side in pixels, cap on Gaussians.
SCENES = [
    ("tiny-brighton", 320, 10_000),
    ("tiny-banana", 320, 20_000),
    ("fern-llff", 320, 20_000),
]


def run(command: list[str]) -> tuple[dict, float]:
    """The JSON that a command prints, and its wall seconds."""
    begun = time.monotonic()
    done = subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True)
    return json.loads(done.stdout), time.monotonic() - begun


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-o", "--output", type=Path, default=Path("target/scenes"))
    parser.add_argument("--data", type=Path, default=Path(os.environ.get("SCENES", "scenes")))
    parser.add_argument("--program", default="target/release/gs-chroma")
    parser.add_argument("--iterations", type=int, default=1000)
    parser.add_argument("--colorize", default="", help="more flags for colorize, as one word")
    parser.add_argument("--scenes", nargs="*", default=[name for name, _, _ in SCENES])
    arguments = parser.parse_args()
    print("| scene | side | Gaussians | fit | PSNR | SSIM | color | ΔE00 | colorfulness / teacher | bake ΔE00 mean, 95 % | memory |")
    print("|---|---|---|---|---|---|---|---|---|---|---|")
    for name, side, cap in SCENES:
        folder = arguments.data / name
        if name not in arguments.scenes:
            continue
        if not folder.is_dir():
            print(f"{folder} is not there: skipped", file=sys.stderr)
            continue
        out = arguments.output / name
        report, fit_seconds = run(
            [arguments.program, "fit", str(folder), "-o", str(out), "--max-side", str(side)]
            + ["--max-splats", str(cap), "--iterations", str(arguments.iterations)]
            + ["--preset", "draft", "--json"]
        )
        report, color_seconds = run(
            [arguments.program, "colorize", str(out), "--teacher", str(folder / "images")]
            + [*shlex.split(arguments.colorize), "--json"]
        )
        luma, chroma = report["luma"], report["chroma"]
        held_out, pictures, bake = luma["held_out"], chroma["pictures"], chroma["bake"]
        memory = max(luma["peak_host_memory"] or 0, chroma["peak_host_memory"] or 0) / 2**20
        print(
            f"| {name} | {side} | {luma['splats']} | {fit_seconds:.0f} s | {held_out['psnr']:.2f} dB"
            f" | {held_out['ssim']:.3f} | {color_seconds:.0f} s | {pictures['delta_e']['mean']:.2f}"
            f" | {pictures['colorfulness']:.1f} / {pictures['teacher_colorfulness']:.1f}"
            f" | {bake['mean']:.2f}, {bake['percentile_95']:.2f} | {memory:.0f} MiB |",
            flush=True,
        )
    return 0


if __name__ == "__main__":
    sys.exit(main())
