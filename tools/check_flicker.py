#!/usr/bin/env python3
"""Measures how steady the colors of a run's film are, against the teacher's own film.

    python3 tools/check_flicker.py RUN [--program target/release/gs-chroma] [--work target/flicker]

For films without known colors: `frames` writes the run's frames as 16-bit TIFF (8 bits alone
flicker), once as ever and once with `--teacher-alone`; a and b of neighboring frames are compared
along OpenCV's DIS flow where the way there and back ends within a pixel. Still is what moves by
less than half a pixel and keeps its gray, moving what moves by more than one; highlights
(lightness above 95, where the gamut leaves no chroma) count for neither. Root mean squares,
ours over the teacher's. Needs numpy, tifffile, scikit-image, opencv-python-headless.
"""

from __future__ import annotations

import argparse
import subprocess
from pathlib import Path

import cv2
import numpy as np
import tifffile
from check_frames import flows
from skimage.color import rgb2lab

ROOT = Path(__file__).parent.parent
STILL, MOVING = 0.5, 1.0
# Lightness: a change of what is still, and highlights.
SAME, HIGHLIGHT = 4.0, 95.0


def colored(program: Path, run: Path, folder: Path, options: list[str]) -> list[np.ndarray]:
    """CIELAB of every frame."""
    if not folder.exists():
        command = [program, "frames", run, "-o", folder, "--codec", "tiff", *options]
        subprocess.run([str(word) for word in command], check=True, stdout=subprocess.DEVNULL)
    paths = sorted(folder.glob("*.tif*"))
    return [rgb2lab(tifffile.imread(path)[..., :3].astype(np.float64) / 65535) for path in paths]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("run", type=Path)
    parser.add_argument("--program", type=Path, default=ROOT / "target/release/gs-chroma")
    parser.add_argument("--work", type=Path, default=ROOT / "target/flicker")
    arguments = parser.parse_args()
    arguments.work.mkdir(parents=True, exist_ok=True)
    films = {
        name: colored(arguments.program.resolve(), arguments.run, arguments.work / name, options)
        for name, options in (("ours", []), ("teacher", ["--teacher-alone"]))
    }
    grays = [np.clip(2.55 * lab[..., 0], 0, 255).astype(np.uint8) for lab in films["ours"]]
    sums = {(name, part): [0.0, 0] for name in films for part in ("still", "moving")}
    for t, place, seen in flows(grays, 1):
        y, x = np.mgrid[: seen.shape[0], : seen.shape[1]]
        moved = np.hypot(place[..., 0] - x, place[..., 1] - y)
        first, second = [films["ours"][k][..., 0] for k in (t, t + 1)]
        then = cv2.remap(second, place[..., 0], place[..., 1], cv2.INTER_LINEAR)
        seen = seen & (np.maximum(first, then) < HIGHLIGHT)
        parts = {"still": seen & (moved < STILL) & (abs(first - then) < SAME), "moving": seen & (moved > MOVING)}
        for name, film in films.items():
            after = cv2.remap(film[t + 1][..., 1:], place[..., 0], place[..., 1], cv2.INTER_LINEAR)
            squares = ((film[t][..., 1:] - after) ** 2).sum(-1)
            for part, inside in parts.items():
                sums[name, part][0] += float(squares[inside].sum())
                sums[name, part][1] += int(inside.sum())
    print("| part | pixels a frame | ours | teacher's | ratio |\n|---|--:|--:|--:|--:|")
    for part in ("still", "moving"):
        ours, its = [(sums[name, part][0] / max(sums[name, part][1], 1)) ** 0.5 for name in ("ours", "teacher")]
        share = sums["ours", part][1] / max(len(grays) - 1, 1)
        print(f"| {part} | {share:.0f} | {ours:.2f} | {its:.2f} | {ours / max(its, 1e-9):.2f} |")


if __name__ == "__main__":
    main()
