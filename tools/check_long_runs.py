#!/usr/bin/env python3
"""Runs `fit` for as many iterations as the presets for a GPU, where pixels and Gaussians are few
enough to do that without one, and prints as Markdown where the held-out PSNR ended and
where it was best on the way.

    cargo build --release && python3 tools/check_long_runs.py $SCENES/fern-llff --iterations 7000 -o target/long

Without `--iterations` a preset may end earlier, where its curve is flat.

A training that falls far below its best was harmed by its own schedule, or has learned its
photos instead of the scene: the loss on the photos in training, low or not, tells which.
"""

from __future__ import annotations

import argparse
import json
import shlex
import subprocess
import sys
import time
from pathlib import Path


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scenes", nargs="+", type=Path, help="COLMAP folders of at least 8 photos")
    parser.add_argument("-o", "--output", type=Path, default=Path("target/long"))
    parser.add_argument("--program", default="target/release/gs-chroma")
    parser.add_argument("--preset", default="balanced")
    parser.add_argument("--iterations", default="", help="instead of the preset's, as 700,7000")
    parser.add_argument("--max-side", type=int, default=160)
    parser.add_argument("--max-splats", type=int, default=5_000)
    parser.add_argument("--fit", default="", help="more flags for fit, as one word")
    arguments = parser.parse_args()
    counts = [["--iterations", count] for count in arguments.iterations.split(",") if count]
    print("| scene | iterations | degree | held-out PSNR, SSIM | best on the way | loss | Gaussians | s |")
    print("|---|--:|--:|--:|--:|--:|--:|--:|")
    for scene in arguments.scenes:
        for count in counts or [[]]:
            name = "-".join([scene.name, arguments.preset, *count[1:]])
            command = [arguments.program, "fit", str(scene), "-o", str(arguments.output / name)]
            command += ["--preset", arguments.preset, "--max-side", str(arguments.max_side)]
            command += ["--max-splats", str(arguments.max_splats), *count]
            command += [*shlex.split(arguments.fit), "--json"]
            begun = time.monotonic()
            done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
            seconds = time.monotonic() - begun
            if done.returncode != 0:
                reason = done.stderr.strip().splitlines()[-1:] or [f"exit code {done.returncode}"]
                print(f"| {scene.name} | {reason[0]} | | | | | | |", flush=True)
                continue
            luma = json.loads(done.stdout)["luma"]
            end, best = luma["held_out"], max(luma["curve"], key=lambda look: look["psnr"])
            print(
                f"| {scene.name} | {luma['iterations']:,} | {luma['settings']['sh_degree']}"
                f" | {end['psnr']:.2f}, {end['ssim']:.3f}"
                f" | {best['psnr']:.2f} at {best['iteration']:,} | {luma['loss']:.4f}"
                f" | {luma['splats']:,} | {seconds:.0f} |",
                flush=True,
            )
    return 0


if __name__ == "__main__":
    sys.exit(main())
