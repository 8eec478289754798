#!/usr/bin/env python3
"""What the shell around a scene and Gaussians in gaps bring at the ends of a capture, and elsewhere.

    cargo build --release && python3 tools/check_ends.py -o target/ends

Of COLMAP folders below DATA (default ../shared/data) the first and the last photo are held out, or
every eighth, in a copy without them. Drafts at 240 px without shell and gaps, with the shell, with
both; held-out PSNR as viewers show the scene. A scene that is not there is skipped with a word.
Needs numpy and Pillow.
"""

from __future__ import annotations

import argparse
import statistics
import subprocess
import sys
from pathlib import Path

from bench_peers.measure import load, psnr
from bench_peers.photos import HELD, copy_gray

SCENES = ["fern-llff", "brighton-drone", "banana-object", "caliterra-drone", "tiny-brighton", "tiny-banana"]
WAYS = [["--no-surround", "--no-fill-gaps"], ["--no-fill-gaps"], []]
SIDE = 240
FIT = ["--preset", "draft", "--max-side", str(SIDE), "--max-splats", "12000", "--iterations", "1000"]
FIT += ["--without", "background", "--without", "exposure", "--no-holdout", "--force"]


def gs_chroma(*arguments: object) -> None:
    """Runs the program quietly; its last words are shown if it fails."""
    command = ["target/release/gs-chroma", *map(str, arguments)]
    ran = subprocess.run(command, capture_output=True, text=True, check=False)
    if ran.returncode:
        sys.exit(f"{' '.join(command)}: {ran.stderr.strip().splitlines()[-1]}")


def measured(folder: Path, held: list[str], seed: int, flags: list[str]) -> float:
    """Mean PSNR of the held-out photos."""
    run, views = folder / "run", folder / "views"
    gs_chroma("fit", folder / "train", "-o", run, "--seed", seed, *FIT, *flags)
    gs_chroma("render", run / "luma.ply", "--colmap", folder / "held", "--views", "all", "--luma", "-o", views)
    pairs = [(load(views / name), load(folder / "all/images" / name)) for name in held]
    return statistics.mean(psnr(*pair) for pair in pairs)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-o", "--output", type=Path, default=Path("target/ends"))
    parser.add_argument("--data", type=Path, default=Path("../shared/data"))
    parser.add_argument("--scenes", nargs="*", default=SCENES)
    parser.add_argument("--hold", nargs="+", choices=HELD, default=HELD[::-1], help="which photos are held out")
    parser.add_argument("--seeds", type=int, default=2)
    arguments = parser.parse_args()
    print("| scene | held out | nothing | shell | shell and gaps |")
    print("|---|---|---|---|---|")
    for scene in arguments.scenes:
        if not (arguments.data / scene).is_dir():
            print(f"{arguments.data / scene} is not there: skipped", file=sys.stderr)
            continue
        for held in arguments.hold:
            folder = arguments.output / f"{scene}-{held}"
            names = copy_gray(arguments.data / scene, folder, SIDE, held)
            cells = []
            for flags in WAYS:
                found = [measured(folder, names, seed, flags) for seed in range(arguments.seeds)]
                cells.append(", ".join(f"{value:.2f}" for value in found))
            print(f"| {scene} | {held} | {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    main()
