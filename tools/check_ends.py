#!/usr/bin/env python3
"""What the shell around a scene and Gaussians in gaps bring at the ends of a capture, and elsewhere.

    cargo build --release && python3 tools/check_ends.py -o target/ends

Of COLMAP folders below DATA (default $SCENES or scenes) the first and the last photo are held out, or
every eighth, in a copy without them. Drafts at 240 px without shell and gaps, with the shell, with
both; held-out PSNR as viewers show the scene. With `--against`, drafts as planned by another build
of the program and by this one; PSNR as viewers show the scene, after each photo's own gain and
offset, and SSIM. A scene that is not there is skipped with a word. Needs numpy and Pillow.
"""

from __future__ import annotations

import argparse
import os
import shutil
import statistics
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

from bench_peers.measure import corrected, load, psnr, ssim
from bench_peers.photos import HELD, copy_gray

SCENES = ["fern-llff", "brighton-drone", "banana-object", "caliterra-drone", "tiny-brighton", "tiny-banana"]
SIDE = 240
FIT = ["--preset", "draft", "--max-side", str(SIDE), "--max-splats", "12000", "--iterations", "1000"]
FIT += ["--no-holdout"]

# One part after the other.
EFFECTS_OFF = ["--without", "background", "--without", "exposure"]
WAYS = {
    "nothing": [*EFFECTS_OFF, "--no-surround", "--no-fill-gaps"],
    "shell": [*EFFECTS_OFF, "--no-fill-gaps"],
    "shell and gaps": EFFECTS_OFF,
}


def quietly(*command: object) -> None:
    """Runs a program; its last words are shown if it fails."""
    words = list(map(str, command))
    ran = subprocess.run(words, capture_output=True, text=True, check=False)
    if ran.returncode:
        sys.exit(f"{' '.join(words)}: {ran.stderr.strip().splitlines()[-1]}")


class Place(NamedTuple):
    """A copy of a scene without the photos that are held out."""

    folder: Path
    held: list[str]

    def measured(self, program: str, flags: list[str], seed: int) -> list[str]:
        """Of the held-out photos: mean PSNR as shown and after each one's own gain and offset, and SSIM."""
        run, views = self.folder / "run", self.folder / "views"
        shutil.rmtree(run, ignore_errors=True)
        quietly(program, "fit", self.folder / "train", "-o", run, "--seed", seed, *FIT, *flags)
        scene = ["--colmap", self.folder / "held", "--views", "all", "--luma", "-o", views]
        quietly(program, "render", run / "luma.ply", *scene)
        pairs = [(load(views / name), load(self.folder / "all/images" / name)) for name in self.held]
        after = [(corrected(*pair), pair[1]) for pair in pairs]
        decibels = [f"{statistics.mean(psnr(*pair) for pair in some):.2f}" for some in (pairs, after)]
        return [*decibels, f"{statistics.mean(ssim(*pair) for pair in pairs):.3f}"]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-o", "--output", type=Path, default=Path("target/ends"))
    parser.add_argument("--data", type=Path, default=Path(os.environ.get("SCENES", "scenes")))
    parser.add_argument("--scenes", nargs="*", default=SCENES)
    parser.add_argument("--hold", nargs="+", choices=HELD, default=HELD[::-1], help="which photos are held out")
    parser.add_argument("--seeds", type=int, default=2)
    parser.add_argument("--program", default="target/release/gs-chroma")
    parser.add_argument("--against", metavar="PROGRAM", help="another build to compare with")
    arguments = parser.parse_args()
    ways = {name: (arguments.program, flags) for name, flags in WAYS.items()}
    if arguments.against:
        ways = {program: (program, []) for program in (arguments.against, arguments.program)}
    print(f"| scene | held out | {' | '.join(ways)} |")
    print(f"|---|---|{'---|' * len(ways)}")
    for scene in arguments.scenes:
        if not (arguments.data / scene).is_dir():
            print(f"{arguments.data / scene} is not there: skipped", file=sys.stderr)
            continue
        for held in arguments.hold:
            folder = arguments.output / f"{scene}-{held}"
            shutil.rmtree(folder, ignore_errors=True)
            place = Place(folder, copy_gray(arguments.data / scene, folder, SIDE, held))
            cells = []
            for program, flags in ways.values():
                found = [place.measured(program, flags, seed) for seed in range(arguments.seeds)]
                measures = [", ".join(values) for values in zip(*found, strict=True)]
                cells.append("; ".join(measures) if arguments.against else measures[0])
            print(f"| {scene} | {held} | {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    main()
