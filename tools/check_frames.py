#!/usr/bin/env python3
"""Measures `gs-chroma frames`: do photos colored through a scene agree better than the teacher's?

    cargo build --release && python3 tools/check_frames.py -o target/networks

The bundled scene and those below DATA (default $SCENES or scenes), each fitted once and not again
while its run is there, colored by the network in DATA/teacher-places (or `--teacher`), and by
their own photos where these are in color. What is not there is skipped with a word. Photos t and
t + Δ are compared in two ways that use nothing of the program: at COLMAP's points (means of 3 × 3
pixels around what both photos observed), and along OpenCV's DIS flow where the way there and back
ends within a pixel, if that is so over half of the photos. Figures are root mean squares of a, b. Needs numpy, Pillow, scikit-image,
opencv-python-headless.
"""

from __future__ import annotations

import argparse
import json
import os
import shlex
import struct
import sys
from pathlib import Path

import cv2
import numpy as np
from check_color import judged, line, ratio, run
from check_networks import BUNDLED, SCENES, fitted
from skimage.color import rgb2lab

# Bounds, as printed in the head of the table.
AGREE = {1: 0.5, 10: 0.4}
SIDE = 320
# Photos farther apart than flow can follow: what is left of them says little.
FOLLOWED = 0.5

HEAD = ["scene, teacher", "photos", "scene covers"]
for delta, most in AGREE.items():
    HEAD += [f"points, Δ = {delta} (≤ {most})", f"flow, Δ = {delta} (≤ {most})"]
HEAD += ["sharpness / photo's", "a/b error, frames / teacher / scene's render", "seconds a photo"]


def read(path: Path) -> np.ndarray:
    """RGB in [0, 1]."""
    found = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
    if found.ndim == 2:
        found = np.repeat(found[..., None], 3, axis=2)
    top = 65535 if found.dtype == np.uint16 else 255
    return found[..., 2::-1].astype(np.float64) / top


def images_of(model: Path) -> dict[str, list[tuple[float, float, int]]]:
    """x, y and point of every observation, by photo, from a model in binary form."""
    found = {}
    with (model / "images.bin").open("rb") as file:
        (count,) = struct.unpack("<Q", file.read(8))
        for _ in range(count):
            file.read(64)
            name = b""
            while (byte := file.read(1)) != b"\0":
                name += byte
            (points,) = struct.unpack("<Q", file.read(8))
            raw = np.frombuffer(file.read(24 * points), np.dtype("<f8,<f8,<i8"))
            found[name.decode()] = [(x, y, p) for x, y, p in raw.tolist() if p >= 0]
    return found


def sizes_of(model: Path) -> dict[int, tuple[int, int]]:
    """Width and height of every camera."""
    parameters = [3, 4, 4, 5, 8, 8, 12, 5, 4, 5, 12]
    found = {}
    with (model / "cameras.bin").open("rb") as file:
        (count,) = struct.unpack("<Q", file.read(8))
        for _ in range(count):
            camera, kind, width, height = struct.unpack("<iiQQ", file.read(24))
            file.read(8 * parameters[kind])
            found[camera] = (width, height)
    return found


class Pictures:
    """a/b of the pictures of a folder, small and at points."""

    def __init__(self, folder: Path, names: list[str]):
        self.lab = {}
        for name in names:
            path = next(p for p in folder.rglob("*") if p.stem == Path(name).stem)
            picture = read(path)
            scale = min(1.0, SIDE / max(picture.shape[:2]))
            size = (round(picture.shape[1] * scale), round(picture.shape[0] * scale))
            small = cv2.resize(picture, size, interpolation=cv2.INTER_AREA)
            self.lab[name] = rgb2lab(small)

    def at(self, name: str, places: np.ndarray, size: tuple[int, int]) -> np.ndarray:
        """Means of 3 × 3 pixels around places in pixels of a picture of `size`."""
        ab = cv2.blur(self.lab[name][..., 1:], (3, 3))
        height, width = ab.shape[:2]
        x = np.clip(places[:, 0] * width / size[0], 0, width - 1).astype(int)
        y = np.clip(places[:, 1] * height / size[1], 0, height - 1).astype(int)
        return ab[y, x]


def flows(grays: list[np.ndarray], delta: int) -> list[tuple[int, np.ndarray, np.ndarray]]:
    """For each pair the places in the second picture, and which can be compared."""
    dis = cv2.DISOpticalFlow_create(cv2.DISOPTICAL_FLOW_PRESET_MEDIUM)
    found = []
    for t in range(len(grays) - delta):
        first, second = grays[t], grays[t + delta]
        if first.shape != second.shape:
            continue
        there, back = dis.calc(first, second, None), dis.calc(second, first, None)
        y, x = np.mgrid[: first.shape[0], : first.shape[1]].astype(np.float32)
        place = np.stack([x, y], -1) + there
        again = cv2.remap(back, place[..., 0], place[..., 1], cv2.INTER_LINEAR)
        inside = (place >= 0).all(-1) & (place[..., 0] < first.shape[1] - 1)
        inside &= place[..., 1] < first.shape[0] - 1
        found.append((t, place, inside & (np.hypot(*np.moveaxis(there + again, -1, 0)) < 1)))
    return found


def along_flow(pictures: Pictures, names: list[str], delta: int, pairs) -> dict:
    """Sum of squares and count over all pairs."""
    squares, count = 0.0, 0
    for t, place, seen in pairs:
        a, b = pictures.lab[names[t]][..., 1:], pictures.lab[names[t + delta]][..., 1:]
        moved = cv2.remap(b, place[..., 0], place[..., 1], cv2.INTER_LINEAR)
        squares += float(((a - moved)[seen] ** 2).sum())
        count += 2 * int(seen.sum())
    return {"rms": (squares / max(count, 1)) ** 0.5, "pixels": count // 2}


def at_points(pictures: Pictures, names: list[str], delta: int, seen, size) -> float:
    """Root mean square over all points that both photos of a pair observed."""
    squares, count = 0.0, 0
    for first, second in zip(names, names[delta:]):
        one = {p: (x, y) for x, y, p in seen[first]}
        other = {p: (x, y) for x, y, p in seen[second]}
        common = sorted(one.keys() & other.keys())
        if not common:
            continue
        a = pictures.at(first, np.array([one[p] for p in common]), size)
        b = pictures.at(second, np.array([other[p] for p in common]), size)
        squares += float(((a - b) ** 2).sum())
        count += 2 * len(common)
    return (squares / max(count, 1)) ** 0.5


def sharpness(gray: np.ndarray) -> float:
    return float(cv2.Laplacian(gray * 255, cv2.CV_64F).var())


def gray_of(rgb: np.ndarray) -> np.ndarray:
    """The encoded gray with the same L*."""
    linear = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
    y = linear @ np.array([0.212671, 0.715160, 0.072169])
    return np.where(y <= 0.0031308, 12.92 * y, 1.055 * np.maximum(y, 1e-12) ** (1 / 2.4) - 0.055)


def ab_error(ours: Pictures, truth: Pictures) -> float:
    each = [
        np.hypot(*np.moveaxis(ours.lab[n][..., 1:] - truth.lab[n][..., 1:], -1, 0)).mean()
        for n in truth.lab
        if ours.lab[n].shape == truth.lab[n].shape
    ]
    return float(np.mean(each))


def measure(program: str, scene: str, folder: Path, teacher: str, out: Path, flags: list[str]):
    """One row."""
    asked = [str(out / "run"), "--teacher", teacher]
    run([program, "colorize", *asked, *flags])
    done = {}
    for name, more in [("frames", []), ("teacher", ["--teacher-alone"])]:
        told = run([program, "frames", *asked, *more, "-o", str(out / name), "--json"])
        done[name] = json.loads(told[0])
    run([program, "render", str(out / "run"), "--views", "all", "-o", str(out / "views")])
    model = folder / "sparse" / "0"
    seen, sizes = images_of(model), sizes_of(model)
    names = sorted(seen)
    # All photos of these scenes were taken by one camera.
    size = next(iter(sizes.values()))
    photos = Pictures(folder / "images", names)
    ours, alone = Pictures(out / "frames", names), Pictures(out / "teacher", names)
    grays = [
        np.clip(photos.lab[name][..., 0] * 2.55, 0, 255).astype(np.uint8) for name in names
    ]
    label = "photos" if teacher == "photos" else Path(teacher).stem
    cells = [f"{scene}, {label}", str(done["frames"]["photos"])]
    cells.append(f"{100 * done['frames']['covered']:.0f} %")
    for delta, most in AGREE.items():
        if len(names) <= delta:
            cells += ["", ""]
            continue
        # Photos agree with each other by themselves.
        steady = teacher == "photos"
        one, other = (at_points(p, names, delta, seen, size) for p in (ours, alone))
        told = judged(one / other, steady or one <= most * other)
        cells.append(f"{one:.2f} / {other:.2f}, {told}")
        pairs = flows(grays, delta)
        one, other = (along_flow(p, names, delta, pairs) for p in (ours, alone))
        share = one["pixels"] / max(1, sum(seen.size for _, _, seen in pairs))
        if share < FOLLOWED or not other["rms"]:
            cells.append("")
            continue
        value = one["rms"] / other["rms"]
        told = judged(value, steady or value <= most)
        cells.append(f"{one['rms']:.2f} / {other['rms']:.2f}, {told}")
    ratios = []
    for name in names:
        paths = [next(p for p in f.rglob("*") if p.stem == Path(name).stem)
                 for f in (out / "frames", folder / "images")]
        made, photo = (gray_of(read(path)) for path in paths)
        ratios.append(sharpness(made) / sharpness(np.round(photo * 255) / 255))
    cells.append(f"{min(ratios):.3f} to {max(ratios):.3f}")
    colorful = max(float(np.abs(lab[..., 1:]).max()) for lab in photos.lab.values()) > 1
    if colorful:
        drawn = Pictures(out / "views", names)
        errors = [ab_error(p, photos) for p in (ours, alone, drawn)]
        cells.append(" / ".join(f"{error:.2f}" for error in errors))
    else:
        cells.append("")
    cells.append(f"{done['frames']['seconds'] / done['frames']['photos']:.2f}")
    line(cells)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-o", "--output", type=Path, default=Path("target/networks"))
    parser.add_argument("--data", type=Path, default=Path(os.environ.get("SCENES", "scenes")))
    parser.add_argument("--program", default="target/release/gs-chroma")
    parser.add_argument("--teacher", help="[default: the network in DATA/teacher-places]")
    parser.add_argument("--fit", default="--max-side 320 --seed 0", help="flags, as one word")
    parser.add_argument("--colorize", default="", help="more flags for colorize, as one word")
    parser.add_argument("--scenes", nargs="*", default=[BUNDLED.name, *SCENES[:2]])
    parser.add_argument("--photos", action="store_true", help="by their own photos as well")
    arguments = parser.parse_args()
    places = arguments.data / "teacher-places" / "places-resnet18.onnx"
    teachers = [arguments.teacher or str(places)]
    if not arguments.teacher and not places.is_file():
        print(f"{places} is not there: skipped", file=sys.stderr)
        teachers = []
    if arguments.photos:
        teachers.append("photos")
    line(HEAD)
    line(["---"] * len(HEAD))
    for scene in arguments.scenes:
        folder = BUNDLED if scene == BUNDLED.name else arguments.data / scene
        if not folder.is_dir():
            print(f"{folder} is not there: skipped", file=sys.stderr)
            continue
        out = arguments.output / scene
        fitted(arguments.program, folder, out / "run", shlex.split(arguments.fit))
        for teacher in teachers:
            flags = shlex.split(arguments.colorize)
            measure(arguments.program, scene, folder, teacher, out, flags)
    return 0


if __name__ == "__main__":
    sys.exit(main())
