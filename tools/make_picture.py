#!/usr/bin/env python3
"""Makes the pictures of the README: a moving one from gray photos to a flight, and a failure.

    python3 tools/make_picture.py SCENE --teacher NETWORK.onnx [--program target/release/gs-chroma]
        [--work target/picture] [--fit "--preset draft"] [--flight flight.webp]
        [--still still.jpg --photo NAME --box X,Y,WIDTH,HEIGHT --gain 1]

SCENE is a COLMAP folder whose photos may be shown. `fit`, `colorize`, `frames` and `render` run in
the work folder; what is there already is used again. `--still` shows a part of one photo, a box in
pixels: its true colors, the network's, and the photo colored through the scene; `--gain` brightens
all three alike. Needs Pillow 10.1.
"""

from __future__ import annotations

import argparse
import subprocess
from pathlib import Path

from PIL import Image, ImageDraw, ImageFont

ROOT = Path(__file__).parent.parent
# Of the moving picture: width, milliseconds a frame, frames of each part.
WIDTH, MILLISECONDS = 480, 100
PHOTOS, WIPE, FLIGHT = 16, 7, 48
QUALITY = 50
# Of the still one.
PART_WIDTH, GAP, JPEG_QUALITY = 400, 6, 88


def labeled(picture: Image.Image, words: str) -> Image.Image:
    """With words on a dark bar at the lower left."""
    picture = picture.copy()
    draw = ImageDraw.Draw(picture, "RGBA")
    font = ImageFont.load_default(15)
    left, top, right, bottom = draw.textbbox((0, 0), words, font)
    height = picture.height
    draw.rectangle((0, height - bottom - 12, right - left + 16, height), (0, 0, 0, 170))
    draw.text((8, height - bottom - 7), words, "white", font)
    return picture


def opened(path: Path, width: int) -> Image.Image:
    """RGB at a width, as high as its aspect says, in whole pixels of two."""
    picture = Image.open(path).convert("RGB")
    height = round(picture.height * width / picture.width / 2) * 2
    return picture.resize((width, height), Image.Resampling.LANCZOS)


def spread(items: list, count: int) -> list:
    """Some of a list, evenly; all if it is shorter."""
    if len(items) <= count:
        return items
    return [items[i * len(items) // count] for i in range(count)]


def moving(colored: Path, flight: Path) -> list[Image.Image]:
    """Gray photos, the same way back in color behind a line, and a flight through the scene."""
    photos = [opened(path, WIDTH) for path in spread(sorted(colored.glob("*.png")), PHOTOS)]
    grays = [photo.convert("L").convert("RGB") for photo in photos]
    frames = [labeled(gray, "gray photos") for gray in grays]
    for i, (photo, gray) in enumerate(zip(reversed(photos), reversed(grays))):
        edge = min(WIDTH, (i + 1) * WIDTH // WIPE)
        gray.paste(photo.crop((0, 0, edge, photo.height)), (0, 0))
        frames.append(labeled(gray, "the photos in color"))
    for path in spread(sorted(flight.glob("*.png")), FLIGHT):
        frames.append(labeled(opened(path, WIDTH), "the scene, from new viewpoints"))
    return frames


def still(paths: dict[str, Path], box: tuple[int, int, int, int], gain: float) -> Image.Image:
    """One part of several pictures of a photo, in a row, with what each is."""
    parts = []
    size = None
    for words, path in paths.items():
        picture = Image.open(path).convert("RGB")
        size = size or picture.size
        picture = picture.resize(size, Image.Resampling.BICUBIC)
        x, y, width, height = box
        part = picture.crop((x, y, x + width, y + height))
        part = part.resize((PART_WIDTH, round(PART_WIDTH * height / width)), Image.Resampling.LANCZOS)
        part = part.point(lambda value: min(255, round(value * gain)))
        parts.append(labeled(part, words))
    width = sum(part.width for part in parts) + GAP * (len(parts) - 1)
    row = Image.new("RGB", (width, parts[0].height), "white")
    for i, part in enumerate(parts):
        row.paste(part, (i * (PART_WIDTH + GAP), 0))
    return row


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("scene", type=Path)
    parser.add_argument("--teacher", required=True)
    parser.add_argument("--program", type=Path, default=ROOT / "target/release/gs-chroma")
    parser.add_argument("--work", type=Path, default=ROOT / "target/picture")
    parser.add_argument("--fit", default="--preset draft", help="options of fit")
    parser.add_argument("--path", default="orbit", help="the flight's path, as for render")
    parser.add_argument("--flight", type=Path)
    parser.add_argument("--still", type=Path)
    parser.add_argument("--photo", help="its name in images/")
    parser.add_argument("--box", type=lambda text: tuple(map(int, text.split(","))))
    parser.add_argument("--gain", type=float, default=1)
    options = parser.parse_args()

    run, colored, alone, flight = (
        options.work / name for name in ("run", "colored", "alone", "flight")
    )
    options.work.mkdir(parents=True, exist_ok=True)
    steps = [
        (run, ["fit", options.scene, "-o", run, *options.fit.split()]),
        (run / "color.ply", ["colorize", run, "--teacher", options.teacher]),
        (colored, ["frames", run, "-o", colored]),
    ]
    if options.flight:
        steps.append((flight, ["render", run, "--path", options.path, "-o", flight]))
    if options.still:
        steps.append((alone, ["frames", run, "--teacher-alone", "-o", alone]))
    for made, arguments in steps:
        if not made.exists():
            subprocess.run([options.program, *arguments], check=True)

    if options.flight:
        first, *rest = moving(colored, flight)
        first.save(
            options.flight,
            save_all=True,
            append_images=rest,
            duration=MILLISECONDS,
            loop=0,
            quality=QUALITY,
            method=6,
        )
    if options.still:
        name = Path(options.photo)
        paths = {
            "the truth": options.scene / "images" / name,
            "the network": alone / name.with_suffix(".png"),
            "through the scene": colored / name.with_suffix(".png"),
        }
        still(paths, options.box, options.gain).save(options.still, quality=JPEG_QUALITY)


if __name__ == "__main__":
    main()
