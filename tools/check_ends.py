#!/usr/bin/env python3
"""What the shell around a scene and Gaussians in gaps bring at the ends of a capture, and elsewhere.

    cargo build --release && python3 tools/check_ends.py -o target/ends

Of COLMAP folders below DATA (default ../shared/data) the first and the last photo are held out, or
every eighth, in a copy without them. Drafts at 240 px without shell and gaps, with the shell, with
both; held-out PSNR as viewers show the scene. With `--against`, drafts as planned by another build
of the program and by this one; PSNR as viewers show the scene, and after each photo's own gain and
offset. A scene that is not there is skipped with a word. Needs numpy and Pillow.
"""

from __future__ import annotations

import argparse
import statistics
import subprocess
import sys
from pathlib import Path

from bench_peers.measure import corrected, load, psnr
from bench_peers.photos import HELD, copy_gray

SCENES = ["fern-llff", "brighton-drone", "banana-object", "caliterra-drone", "tiny-brighton", "tiny-banana"]
PROGRAM = "target/release/gs-chroma"
SIDE = 240
FIT = ["--preset", "draft", "--max-side", str(SIDE), "--max-splats", "12000", "--iterations", "1000"]
FIT += ["--no-holdout", "--force"]

# Of this build, one part after the other.
EFFECTS_OFF = ["--without", "background", "--without", "exposure"]
WAYS = {
    "nothing": (PROGRAM, [*EFFECTS_OFF, "--no-surround", "--no-fill-gaps"]),
    "shell": (PROGRAM, [*EFFECTS_OFF, "--no-fill-gaps"]),
    "shell and gaps": (PROGRAM, EFFECTS_OFF),
}


def quietly(*command: object) -> None:
    """Runs a program; its last words are shown if it fails."""
    words = list(map(str, command))
    ran = subprocess.run(words, capture_output=True, text=True, check=False)
    if ran.returncode:
        sys.exit(f"{' '.join(words)}: {ran.stderr.strip().splitlines()[-1]}")


def measured(folder: Path, held: list[str], seed: int, program: str, flags: list[str]) -> tuple[float, float]:
    """Mean PSNR of the held-out photos, as shown and after each photo's own gain and offset."""
    run, views = folder / "run", folder / "views"
    quietly(program, "fit", folder / "train", "-o", run, "--seed", seed, *FIT, *flags)
    scene = ["--colmap", folder / "held", "--views", "all", "--luma", "-o", views]
    quietly(PROGRAM, "render", run / "luma.ply", *scene)
    pairs = [(load(views / name), load(folder / "all/images" / name)) for name in held]
    shown = statistics.mean(psnr(*pair) for pair in pairs)
    return shown, statistics.mean(psnr(corrected(*pair), pair[1]) for pair in pairs)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-o", "--output", type=Path, default=Path("target/ends"))
    parser.add_argument("--data", type=Path, default=Path("../shared/data"))
    parser.add_argument("--scenes", nargs="*", default=SCENES)
    parser.add_argument("--hold", nargs="+", choices=HELD, default=HELD[::-1], help="which photos are held out")
    parser.add_argument("--seeds", type=int, default=2)
    parser.add_argument("--against", metavar="PROGRAM", help="another build to compare with")
    arguments = parser.parse_args()
    other = arguments.against
    ways = {other: (other, []), "this build": (PROGRAM, [])} if other else WAYS
    print(f"| scene | held out | {' | '.join(ways)} |")
    print(f"|---|---|{'---|' * len(ways)}")
    for scene in arguments.scenes:
        if not (arguments.data / scene).is_dir():
            print(f"{arguments.data / scene} is not there: skipped", file=sys.stderr)
            continue
        for held in arguments.hold:
            folder = arguments.output / f"{scene}-{held}"
            names = copy_gray(arguments.data / scene, folder, SIDE, held)
            cells = []
            for program, flags in ways.values():
                found = [measured(folder, names, seed, program, flags) for seed in range(arguments.seeds)]
                shown, after = (", ".join(f"{value:.2f}" for value in values) for values in zip(*found, strict=True))
                cells.append(f"{shown}; {after}" if other else shown)
            print(f"| {scene} | {held} | {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    main()
