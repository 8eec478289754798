#!/usr/bin/env python3
"""Makes of a folder of photos a gray film as an old one would be.

    python3 tools/make_film.py -o film.mp4 [--photos DIR] [--rate 5] [--letterbox 0.08] [--seed 1]

One frame a photo, by name, all brought to the first one's size: gray, flickering, grainy, with
dust and scratches that are on single frames only, and a tone for sound. `--flicker 0 --grain 0
--dust 0 --scratches 0 --silent` leaves the photos alone. The same seed gives the same film
with the same libraries. Needs ffmpeg with libx264, numpy, Pillow.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
from fractions import Fraction
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

BUNDLED = Path(__file__).parent.parent / "assets/demo/images"
ENDINGS = {".jpg", ".jpeg", ".png", ".tif", ".tiff"}

# Hardly to be told from the frames, grain included.
QUALITY = 12
# A concert pitch, low enough for every codec.
TONE = 440
# Grain is a little larger than a pixel: what a pixel has of each neighbor's.
GRAIN_SIZE = 0.3
# Radius of a speck in shares of the frame's height.
SPECK = (0.003, 0.012)
# Opacity of specks and scratches.
OPACITY = (0.5, 1.0)
# An offset flickers by this share of what the gain does.
OFFSET = 0.3


def photos_of(folder: Path) -> list[np.ndarray]:
    """Gray in [0, 1], all of one size with even sides, as a film with chroma at half size needs."""
    paths = sorted(path for path in folder.iterdir() if path.suffix.lower() in ENDINGS)
    if not paths:
        sys.exit(f"{folder} holds no photos")
    size = None
    found = []
    for path in paths:
        photo = Image.open(path).convert("L")
        size = size or (photo.width // 2 * 2, photo.height // 2 * 2)
        if abs(photo.width * size[1] - photo.height * size[0]) > max(photo.size) * 2:
            sys.exit(f"{path} has another shape than the photos before")
        if photo.size != size:
            photo = photo.resize(size, Image.Resampling.LANCZOS)
        found.append(np.asarray(photo, np.float64) / 255)
    return found


def grain(random: np.random.Generator, shape: tuple[int, int]) -> np.ndarray:
    """Noise of standard deviation 1, correlated over neighbors."""
    noise = random.normal(size=shape)
    for axis in (0, 1):
        noise = noise + GRAIN_SIZE * (np.roll(noise, 1, axis) + np.roll(noise, -1, axis))
    return noise / noise.std()


def defects(random: np.random.Generator, shape: tuple[int, int], dust: float, scratches: float):
    """Layers of value and opacity: white and black specks, and thin bright lines downwards."""
    height, width = shape
    value, opacity = Image.new("F", (width, height)), Image.new("F", (width, height))
    tones, covers = ImageDraw.Draw(value), ImageDraw.Draw(opacity)
    for _ in range(random.poisson(dust)):
        x, y = random.uniform(0, width), random.uniform(0, height)
        rx, ry = random.uniform(*SPECK, 2) * height
        box = [x - rx, y - ry, x + rx, y + ry]
        tones.ellipse(box, fill=float(random.integers(2)))
        covers.ellipse(box, fill=float(random.uniform(*OPACITY)))
    if random.uniform() < scratches:
        x, drift = random.uniform(0, width), random.uniform(-3, 3)
        line = [x, 0, x + drift, height]
        tones.line(line, fill=1.0)
        covers.line(line, fill=float(random.uniform(*OPACITY)))
    return np.asarray(value, np.float64), np.asarray(opacity, np.float64)


def aged(frame: np.ndarray, random: np.random.Generator, arguments) -> np.ndarray:
    """A frame as the old film has it."""
    gain, offset = random.normal(size=2) * arguments.flicker * np.array([1, OFFSET])
    frame = (1 + gain) * frame + offset
    # Film has most of its grain between black and white.
    strength = arguments.grain * np.clip(4 * frame * (1 - frame), 0.3, 1)
    frame = frame + strength * grain(random, frame.shape)
    value, opacity = defects(random, frame.shape, arguments.dust, arguments.scratches)
    frame = frame + opacity * (value - frame)
    border = round(arguments.letterbox * frame.shape[0])
    if border:
        frame[:border] = 0
        frame[-border:] = 0
    return np.clip(frame, 0, 1)


def write(frames: list[np.ndarray], arguments) -> None:
    """The film, by ffmpeg."""
    height, width = frames[0].shape
    seconds = float(len(frames) / arguments.rate)
    command = ["ffmpeg", "-v", "error", "-y", "-f", "rawvideo", "-pix_fmt", "gray"]
    command += ["-video_size", f"{width}x{height}", "-framerate", str(arguments.rate)]
    command += ["-i", "pipe:0"]
    if not arguments.silent:
        tone = f"sine=frequency={TONE}:sample_rate=48000:duration={seconds}"
        command += ["-f", "lavfi", "-i", tone, "-c:a", "aac", "-b:a", "96k"]
    scale = "scale=in_range=full:out_range=limited:out_color_matrix=bt709,format=yuv420p"
    command += ["-vf", scale, "-c:v", "libx264", "-crf", str(QUALITY), "-preset", "medium"]
    command += ["-threads", "1", "-colorspace", "bt709", "-color_range", "tv"]
    command += ["-bitexact", str(arguments.output)]
    raw = b"".join(np.round(frame * 255).astype(np.uint8).tobytes() for frame in frames)
    subprocess.run(command, input=raw, check=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-o", "--output", type=Path, required=True)
    parser.add_argument("--photos", type=Path, default=BUNDLED)
    parser.add_argument("--rate", type=Fraction, default=Fraction(5), help="frames a second")
    parser.add_argument("--flicker", type=float, default=0.06, help="of the gain, one sigma")
    parser.add_argument("--grain", type=float, default=0.02, help="of black to white, one sigma")
    parser.add_argument("--dust", type=float, default=3, help="specks a frame, mean")
    parser.add_argument("--scratches", type=float, default=0.2, help="share of scratched frames")
    parser.add_argument("--letterbox", type=float, default=0, help="each border's share of height")
    parser.add_argument("--silent", action="store_true", help="no sound track")
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    random = np.random.default_rng(arguments.seed)
    arguments.output.parent.mkdir(parents=True, exist_ok=True)
    write([aged(frame, random, arguments) for frame in photos_of(arguments.photos)], arguments)


if __name__ == "__main__":
    main()
