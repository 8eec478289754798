#!/usr/bin/env python3
"""What Gaussians gain that start where COLMAP has no points, on the bundled scene's lawn.

    cargo build --release && python3 tools/check_lawn.py -o target/lawn

Fits the bundled scene as a draft without them and with them, to as many Gaussians, and prints the
held-out PSNR of the gray pictures in the lawn and outside it. The lawn is what is greener than red
and blue by 8 %, in the lower 45 % of a photo and without its outer sevenths, where pots stand.
Needs numpy and Pillow.
"""

from __future__ import annotations

import argparse
import json
import subprocess
from pathlib import Path

import lab
import numpy as np
from PIL import Image

SCENE = Path("assets/demo")


def gs_chroma(*arguments: object) -> None:
    command = ["target/release/gs-chroma", *map(str, arguments)]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def lawn(photo: lab.Array) -> np.ndarray:
    rows, columns = photo.shape[:2]
    y, x = np.mgrid[:rows, :columns]
    green = photo[..., 1] > 1.08 * np.maximum(photo[..., 0], photo[..., 2])
    return green & (y > 0.55 * rows) & (x > columns / 7) & (x < columns * 6 / 7)


def psnr(run: Path) -> list[float]:
    """Of the held-out views, in the lawn and outside it."""
    gs_chroma("render", run, "-o", run / "pictures")
    found = []
    for picture in sorted((run / "pictures").glob("*.png")):
        shown = Image.open(picture).convert("RGB")
        photo = Image.open(SCENE / "images" / f"{picture.stem}.jpg").convert("RGB")
        small = np.asarray(photo.resize(shown.size, Image.Resampling.BOX)) / 255
        gray = lab.lightness_to_gray(lab.rgb_to_lab(small)[..., 0])
        square = (np.asarray(shown)[..., 0] / 255 - gray) ** 2
        inside = lawn(small)
        found.append([-10 * np.log10(square[mask].mean()) for mask in (inside, ~inside)])
    return list(np.mean(found, axis=0))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-o", "--output", type=Path, default=Path("target/lawn"))
    parser.add_argument("--seeds", type=int, default=3)
    arguments = parser.parse_args()
    print("| seed | Gaussians | lawn without, with | gain | elsewhere without, with |")
    print("|---|---|---|---|---|")
    for seed in range(arguments.seeds):
        without, filled = (arguments.output / f"{name}-{seed}" for name in ("without", "with"))
        fit = ("fit", SCENE, "--preset", "draft", "--seed", seed, "--force", "-o")
        gs_chroma(*fit, without, "--no-fill-gaps")
        count = json.loads((without / "report.json").read_text())["luma"]["splats"]
        gs_chroma(*fit, filled, "--max-splats", count)
        (before, beside), (after, there) = psnr(without), psnr(filled)
        print(
            f"| {seed} | {count} | {before:.2f}, {after:.2f} | {after - before:+.2f} |"
            f" {beside:.2f}, {there:.2f} |",
            flush=True,
        )


if __name__ == "__main__":
    main()
