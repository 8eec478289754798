#!/usr/bin/env python3
"""Restores an old film from end to end: seconds of every step, and whether colors are steady.

    cargo build --release && python3 tools/check_film.py -o target/film

The film is make_film.py's of the bundled photos (or of `--photos DIR`), the teacher the network in
DATA/teacher-places (or `--teacher`); where that is not there, it is skipped with a word. The
colored film and one of the teacher's own pictures, written by the same codec, are decoded, and
compared frame by frame: at COLMAP's points, and along OpenCV's DIS flow of the old film, its
flicker taken out, where the way there and back ends within a pixel. So are the pictures that no
codec has seen. Figures are of a, b in CIELAB units: root mean squares between frames t and t + Δ,
and flicker: the standard deviation over so many frames where gray stays the same. Needs COLMAP,
ffmpeg, numpy, Pillow, scikit-image, opencv-python-headless.
"""

from __future__ import annotations

import argparse
import json
import os
import shlex
import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np
from check_color import judged, line, run
from check_frames import AGREE, Pictures, along_flow, at_points, flows, gray_of, images_of
from check_frames import sharpness
from skimage.color import rgb2lab

TOOLS = Path(__file__).parent

# What is written beside the colored film, by flags of `frames`.
OUTPUTS = {"--teacher-alone": "teacher.mp4", "": "colored", "--teacher-alone ": "teacher"}

# Frames of a track of flicker, and by how many gray levels it may change.
TRACK = 5
STILL = 6
# Bound on flicker, ours by the teacher's, and on what sharpness may lose or win.
FLICKER = 0.5
SHARPNESS = 0.1


class Decoded(Pictures):
    """The frames of a film or folder: RGB in [0, 1], and CIELAB by the name of the frame."""

    def __init__(self, path: Path):
        path = path / "%06d.png" if path.is_dir() else path
        asked = ["ffprobe", "-v", "error", "-select_streams", "v", "-of", "json"]
        said = subprocess.run([*asked, "-show_streams", str(path)], check=True, capture_output=True)
        stream = json.loads(said.stdout)["streams"][0]
        self.shape = (stream["height"], stream["width"])
        self.rate, self.seconds = stream["r_frame_rate"], stream["duration"]
        decode = ["ffmpeg", "-v", "error", "-i", str(path), "-f", "rawvideo"]
        raw = subprocess.run([*decode, "-pix_fmt", "rgb24", "-"], check=True, capture_output=True).stdout
        self.rgb = np.frombuffer(raw, np.uint8).reshape(-1, *self.shape, 3) / 255
        self.names = [f"{number:06}.png" for number in range(1, len(self.rgb) + 1)]
        self.lab = dict(zip(self.names, rgb2lab(self.rgb)))

    def __len__(self) -> int:
        return len(self.rgb)

    def form(self) -> tuple:
        return len(self), self.shape, self.rate, self.seconds


def steadied(film: Decoded) -> list[np.ndarray]:
    """L* in bytes with the mean and the contrast of all frames."""
    light = np.stack([film.lab[name][..., 0] for name in film.names])
    mean, contrast = light.mean((1, 2), keepdims=True), light.std((1, 2), keepdims=True)
    light = (light - mean) / contrast * contrast.mean() + mean.mean()
    return list(np.clip(light * 2.55, 0, 255).astype(np.uint8))


def flicker(film: Decoded, grays: list[np.ndarray], steps) -> tuple[float, int]:
    """Standard deviation of a, b along tracks over which gray stays, and how many there are."""
    squares, count = 0.0, 0
    for first in range(len(grays) - TRACK + 1):
        height, width = grays[first].shape
        y, x = np.mgrid[:height, :width].astype(np.float32)
        place, still = np.stack([x, y], -1), np.ones((height, width), bool)
        colors = [film.lab[film.names[first]][..., 1:]]
        for t in range(first, first + TRACK - 1):
            _, step, seen = steps[t]
            still &= moved(seen.astype(np.float32), place) > 0.99
            place = moved(step, place)
            gray = moved(grays[t + 1].astype(np.float32), place)
            still &= np.abs(gray - grays[first]) <= STILL
            colors.append(moved(film.lab[film.names[t + 1]][..., 1:], place))
        squares += float(np.stack(colors).var(0)[still].sum())
        count += int(still.sum())
    return (squares / max(2 * count, 1)) ** 0.5, count


def moved(picture: np.ndarray, place: np.ndarray) -> np.ndarray:
    return cv2.remap(picture, place[..., 0], place[..., 1], cv2.INTER_LINEAR)


def restored(program: str, film: Path, teacher: str, out: Path, flags: list[str]) -> dict:
    """All steps of docs/guides/old-film.md; prints their seconds and gives what they tell."""
    house, fitted = str(out / "house"), str(out / "run")
    asked = [fitted, "--teacher", teacher]
    steps = {
        "prepare": [str(film), "-o", house, "--json"],
        "plan": [house, "--json"],
        "fit": [house, "-o", fitted, *flags, "--json"],
        "colorize": [*asked, "--json"],
        "frames": [*asked, "-o", str(out / "colored.mp4"), "--json"],
        "export": [fitted, "-o", str(out / "house.ply")],
    }
    told = {}
    line(["step", "seconds"])
    line(["---"] * 2)
    for step, arguments in steps.items():
        said, seconds = run([program, step, *arguments])
        line([f"`{step}`", f"{seconds:.1f}"])
        told[step] = json.loads(said) if "--json" in arguments else said
    for more, output in OUTPUTS.items():
        run([program, "frames", *asked, *shlex.split(more), "-o", str(out / output)])
    print()
    return told


def measure(out: Path, film: Path, told: dict) -> None:
    """The table of what was measured."""
    old = Decoded(film)
    names = ["colored.mp4", "teacher.mp4", "colored", "teacher"]
    colored = [Decoded(out / name) for name in names]
    kept = old.form() == colored[0].form()
    frames = told["frames"]
    posed = f"{frames['placed']} of {frames['photos']} frames with a pose"
    print(f"{posed}; the scene covers {100 * frames['covered']:.0f} %.")
    print(f"Frames, size, rate and length as the old film's: {'yes' if kept else '**no**'}.")
    print()
    grays = steadied(old)
    seen = images_of(out / "house" / "sparse" / "0")
    placed = sorted(seen)
    line(["ours / teacher's; sharpness and gray of ours alone", "as films", "as pictures"])
    line(["---"] * 3)

    def compared(name: str, found: list[float], most: float) -> None:
        pairs = zip(found[::2], found[1::2])
        cells = [f"{a:.2f} / {b:.2f}, {judged(a / b, a <= most * b)}" for a, b in pairs]
        line([name, *cells])

    for delta, most in AGREE.items():
        if len(old) <= delta:
            continue
        found = [at_points(film, placed, delta, seen, old.shape[::-1]) for film in colored]
        compared(f"frames differ at points, Δ = {delta} (≤ {most})", found, most)
        pairs = flows(grays, delta)
        found = [along_flow(film, old.names, delta, pairs) for film in colored]
        share = 100 * found[0]["pixels"] / sum(known.size for _, _, known in pairs)
        name = f"frames differ along flow, Δ = {delta} ({share:.0f} % of pixels; ≤ {most})"
        compared(name, [each["rms"] for each in found], most)
    steps = flows(grays, 1)
    found = [flicker(film, grays, steps) for film in colored]
    name = f"flicker over {TRACK} frames ({found[0][1]:,} tracks; ≤ {FLICKER})"
    compared(name, [each for each, _ in found], FLICKER)
    gray, *others = ([gray_of(frame) for frame in film.rgb] for film in (old, *colored[::2]))
    sharp = np.array([sharpness(frame) for frame in gray])
    found = [float((np.array([sharpness(f) for f in o]) / sharp).mean()) for o in others]
    cells = [judged(value, abs(value - 1) <= SHARPNESS) for value in found]
    line([f"sharpness / the old film's (± {SHARPNESS})", *cells])
    cells = [f"{255 * float(np.abs(np.stack(o) - gray).mean()):.2f}" for o in others]
    line(["gray levels off the old film's", *cells])


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-o", "--output", type=Path, default=Path("target/film"))
    parser.add_argument("--data", type=Path, default=Path(os.environ.get("SCENES", "scenes")))
    parser.add_argument("--program", default="target/release/gs-chroma")
    parser.add_argument("--teacher", help="[default: the network in DATA/teacher-places]")
    parser.add_argument("--photos", help="a folder [default: the bundled scene's]")
    parser.add_argument("--film", default="", help="more flags for make_film.py, as one word")
    parser.add_argument("--fit", default="--preset draft --seed 0", help="flags, as one word")
    arguments = parser.parse_args()
    places = arguments.data / "teacher-places" / "places-resnet18.onnx"
    if not arguments.teacher and not places.is_file():
        print(f"{places} is not there: skipped", file=sys.stderr)
        return 0
    film = arguments.output / "film.mp4"
    photos = ["--photos", arguments.photos] if arguments.photos else []
    make = [sys.executable, str(TOOLS / "make_film.py"), "-o", str(film), *photos]
    run([*make, *shlex.split(arguments.film)])
    teacher = arguments.teacher or str(places)
    told = restored(
        arguments.program, film, teacher, arguments.output, shlex.split(arguments.fit)
    )
    measure(arguments.output, film, told)
    return 0


if __name__ == "__main__":
    sys.exit(main())
