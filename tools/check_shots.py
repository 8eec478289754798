#!/usr/bin/env python3
"""Checks shots whose camera moves, turns or stands, with a person walking through them.

    python3 tools/check_shots.py [--program target/release/gs-chroma] [--work target/shots]
        [--kinds moves turns stands] [--preset draft] [--sheet FILE.jpg]

Renders a room (textures: the bundled photos) by ray casting, in true colors; makes a gray, grainy
film of it and an unsteady teacher: the true colors with another cast and blotches in each frame.
Then `prepare`, `fit`, `colorize` and `frames`, and against the truth, for the room and the person:
the error of a and b, and its change from frame to frame (flicker), each also as a ratio to the
teacher's own, and mean ΔE00 at the true lightness. `--sheet` shows frames of the first kind: the
film, the teacher's, the colored ones, the truth. Needs numpy, Pillow, scikit-image, FFmpeg and
COLMAP (or its Python module).
"""

from __future__ import annotations

import argparse
import json
import shutil
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
from PIL import Image
from skimage.color import deltaE_ciede2000

ROOT = Path(__file__).parent.parent
SIZE = (324, 216)
FOCAL = 300.0
FRAMES = 48
RATE = 12
# The room: x to the right, y down, z ahead; the camera begins near its origin.
LOW = np.array([-4.0, -2.0, -3.0])
HIGH = np.array([4.0, 1.2, 8.0])
# Meters of wall that a texture covers: fewer would alias at the far end.
TEXTURE = 7.0
# The person: distance, half width and half height in meters, and where the feet are.
PERSON = {"z": 5.0, "half": (0.45, 0.8), "feet": 1.2}
GRAIN = 0.015
# Casts and blotches of the teacher, one sigma in a and b.
CAST, BLOTCH = 3.0, 4.0


def textures() -> list[np.ndarray]:
    """Seven square photos, in linear order of names."""
    paths = sorted((ROOT / "assets/demo/images").iterdir())[:7]
    square = [Image.open(path).convert("RGB").resize((256, 256)) for path in paths]
    return [np.asarray(image, np.float64) / 255 for image in square]


def sampled(texture: np.ndarray, u: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Bilinear, mirrored beyond the borders."""
    side = texture.shape[0] - 1
    u, v = [side * np.abs((x + 1) % 2 - 1) for x in (u, v)]
    i, j = [np.minimum(x.astype(int), side - 1) for x in (u, v)]
    a, b = (u - i)[..., None], (v - j)[..., None]
    rows = [(1 - a) * texture[j + k, i] + a * texture[j + k, i + 1] for k in (0, 1)]
    return (1 - b) * rows[0] + b * rows[1]


def pose(kind: str, share: float) -> tuple[np.ndarray, float]:
    """Center and turn to the right in radians, at a share of the shot."""
    if kind == "moves":
        return np.array([2.4 * share - 1.2, 0.0, 0.5 * share]), np.radians(4 - 8 * share)
    turned = np.radians(18 * share - 9) if kind == "turns" else 0.0
    return np.zeros(3), turned


def rendered(kind: str, frame: int, walls: list[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """True color of each pixel, and where the person is."""
    width, height = SIZE
    share = frame / (FRAMES - 1)
    center, turned = pose(kind, share)
    x, y = np.meshgrid(np.arange(width) + 0.5 - width / 2, np.arange(height) + 0.5 - height / 2)
    sine, cosine = np.sin(turned), np.cos(turned)
    ray = np.stack([x, y, np.full_like(x, FOCAL)], -1) / FOCAL
    ray = np.stack(
        [cosine * ray[..., 0] + sine * ray[..., 2], ray[..., 1], cosine * ray[..., 2] - sine * ray[..., 0]], -1
    )
    with np.errstate(divide="ignore"):
        reach = np.where(ray > 0, (HIGH - center) / ray, (LOW - center) / ray)
    axis = reach.argmin(-1)
    at = center + ray * reach.min(-1)[..., None]
    color = np.zeros((height, width, 3))
    for which in range(6):
        wall, side = which % 3, which // 3
        here = (axis == wall) & ((np.take_along_axis(ray, axis[..., None], -1)[..., 0] > 0) == bool(side))
        u, v = [k for k in range(3) if k != wall]
        color[here] = sampled(walls[which], at[here][:, u] / TEXTURE, at[here][:, v] / TEXTURE)
    # A person, who sways.
    t = (PERSON["z"] - center[2]) / ray[..., 2]
    half, tall = PERSON["half"]
    seen = center + ray * t[..., None]
    u = (seen[..., 0] - (3.2 * share - 1.6)) / half
    v = (seen[..., 1] - PERSON["feet"] + tall) / tall
    body = np.abs(u - 0.1 * np.sin(8 * np.pi * share) * (v - 1)) < 0.75 - 0.45 * (v < -0.55)
    person = body & (np.abs(v) < 1) & (t > 0) & (t < reach.min(-1))
    color[person] = 0.15 + 0.6 * sampled(walls[6], 0.3 * u + 0.5, 0.3 * v + 0.5)[person]
    return color, person


def linear(rgb: np.ndarray) -> np.ndarray:
    return np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)


TO_XYZ = np.array(
    [[0.4124564, 0.3575761, 0.1804375], [0.2126729, 0.7151522, 0.0721750], [0.0193339, 0.1191920, 0.9503041]]
)
WHITE = np.array([0.95047, 1.0, 1.08883])


def lab(rgb: np.ndarray) -> np.ndarray:
    xyz = linear(rgb) @ TO_XYZ.T / WHITE
    f = np.where(xyz > 216 / 24389, np.cbrt(xyz), (24389 / 27 * xyz + 16) / 116)
    return np.stack([116 * f[..., 1] - 16, 500 * (f[..., 0] - f[..., 1]), 200 * (f[..., 1] - f[..., 2])], -1)


def shown(values: np.ndarray) -> np.ndarray:
    """Encoded sRGB of CIELAB."""
    y = (values[..., 0] + 16) / 116
    f = np.stack([y + values[..., 1] / 500, y, y - values[..., 2] / 200], -1)
    xyz = WHITE * np.where(f**3 > 216 / 24389, f**3, (116 * f - 16) * 27 / 24389)
    rgb = np.clip(xyz @ np.linalg.inv(TO_XYZ).T, 0, 1)
    return np.where(rgb <= 0.0031308, 12.92 * rgb, 1.055 * rgb ** (1 / 2.4) - 0.055)


def save(path: Path, rgb: np.ndarray) -> None:
    Image.fromarray(np.round(255 * rgb).astype(np.uint8)).save(path)


def make(kind: str, work: Path) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """The film, the teacher's folder; true CIELAB, and masks of the person."""
    random = np.random.default_rng(7)
    walls = textures()
    teacher = work / "teacher"
    teacher.mkdir(parents=True)
    truth, people, raw = [], [], b""
    for frame in range(FRAMES):
        color, person = rendered(kind, frame, walls)
        true = lab(color)
        gray = shown(np.stack([true[..., 0], *[np.zeros_like(true[..., 0])] * 2], -1))[..., 0]
        gray = np.clip(gray + GRAIN * random.normal(size=gray.shape), 0, 1)
        raw += np.round(255 * gray).astype(np.uint8).tobytes()
        cast = CAST * random.normal(size=2)
        coarse = Image.fromarray((BLOTCH * random.normal(size=(3, 4))).astype(np.float32))
        blotch = np.asarray(coarse.resize(SIZE, Image.Resampling.BICUBIC), np.float64)
        taught = true.copy()
        taught[..., 1:] += cast + blotch[..., None]
        save(teacher / f"{frame + 1:06}.png", shown(taught))
        truth.append(true)
        people.append(person)
    subprocess.run(
        ["ffmpeg", "-v", "error", "-y", "-f", "rawvideo", "-pix_fmt", "gray", "-video_size", "%dx%d" % SIZE]
        + ["-framerate", str(RATE), "-i", "pipe:0", "-c:v", "ffv1", str(work / "film.mkv")],
        input=raw,
        check=True,
    )
    return truth, people


def colors(folder: Path) -> list[np.ndarray]:
    """a and b of a folder's pictures, over three by three pixels: eight bits round each."""
    found = []
    for path in sorted(folder.glob("*.png")):
        ab = lab(np.asarray(Image.open(path).convert("RGB"), np.float64) / 255)[..., 1:]
        for axis in (0, 1):
            ab = (np.roll(ab, 1, axis) + ab + np.roll(ab, -1, axis)) / 3
        found.append(ab)
    return found


def measured(found: list[np.ndarray], truth: list[np.ndarray], people: list[np.ndarray]) -> dict:
    """Root mean squares, and mean ΔE00, over the room and the person."""
    wrong = [a - b[..., 1:] for a, b in zip(found, truth, strict=True)]
    seen = [deltaE_ciede2000(np.dstack([b[..., 0], a]), b) for a, b in zip(found, truth)]
    result = {}
    for name, inside in (("room", False), ("person", True)):
        squares = [(w**2).sum(-1)[p == inside] for w, p in zip(wrong, people)]
        shown = [s[p == inside] for s, p in zip(seen, people)]
        # The person is not where it was: what counts is the error that comes and goes.
        same = [(p == inside) & (q == inside) for p, q in zip(people, people[1:])]
        changes = [((w - v) ** 2).sum(-1)[s] for v, w, s in zip(wrong, wrong[1:], same)]
        result[name] = {
            "error": float(np.sqrt(np.concatenate(squares).mean())),
            "de00": float(np.concatenate(shown).mean()),
            "flicker": float(np.sqrt(np.concatenate(changes).mean())),
        }
    return result


def sheet(work: Path, truth: list[np.ndarray], path: Path) -> None:
    """Frames in columns; rows: film, teacher, colored, truth."""
    rows = []
    for row in ("film", "teacher", "colored", "truth"):
        frames = []
        for frame in np.linspace(2, FRAMES - 3, 4).astype(int):
            if row == "truth":
                frames.append(np.round(255 * shown(truth[frame])).astype(np.uint8))
                continue
            folder = {"film": "house/frames"}.get(row, row)
            picture = sorted((work / folder).glob("*.png"))[frame]
            frames.append(np.asarray(Image.open(picture).convert("RGB")))
        rows.append(np.hstack(frames))
    Image.fromarray(np.vstack(rows)).save(path, quality=88)


def check(kind: str, arguments) -> dict:
    work = arguments.work / kind
    shutil.rmtree(work, ignore_errors=True)
    truth, people = make(kind, work)
    program = str(arguments.program.resolve())
    run = ["-o", str(work / "run")]
    teacher = ["--teacher", str(work / "teacher")]
    seconds = {}
    steps = {
        "prepare": [str(work / "film.mkv"), "-o", str(work / "house"), "--json"],
        "fit": [str(work / "house"), *run, "--preset", arguments.preset],
        "colorize": [str(work / "run"), *teacher],
        "frames": [str(work / "run"), *teacher, "-o", str(work / "colored")],
    }
    camera = None
    for step, options in steps.items():
        begun = time.monotonic()
        done = subprocess.run([program, step, *options], capture_output=True, text=True)
        seconds[step] = round(time.monotonic() - begun, 1)
        if done.returncode:
            sys.exit(f"{kind}: {step}: {done.stderr.strip().splitlines()[-1]}")
        if step == "prepare":
            camera = json.loads(done.stdout)["motion"]["camera"]
    if arguments.sheet and kind == arguments.kinds[0]:
        sheet(work, truth, arguments.sheet)
    blurred = [sum(np.roll(t, k, 0) for k in (-1, 0, 1)) / 3 for t in truth]
    blurred = [sum(np.roll(t, k, 1) for k in (-1, 0, 1)) / 3 for t in blurred]
    ours = measured(colors(work / "colored"), blurred, people)
    its = measured(colors(work / "teacher"), blurred, people)
    return {"kind": kind, "camera": camera, "seconds": seconds, "colored": ours, "teacher": its}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--program", type=Path, default=ROOT / "target/release/gs-chroma")
    parser.add_argument("--work", type=Path, default=ROOT / "target/shots")
    parser.add_argument("--kinds", nargs="+", default=["moves", "turns", "stands"])
    parser.add_argument("--preset", default="draft")
    parser.add_argument("--sheet", type=Path)
    arguments = parser.parse_args()
    print("| shot | found | part | error | of the teacher's | flicker | of the teacher's | ΔE00 |")
    print("|---|---|---|--:|--:|--:|--:|--:|")
    for kind in arguments.kinds:
        found = check(kind, arguments)
        for part in ("room", "person"):
            ours, its = found["colored"][part], found["teacher"][part]
            cells = [f"{ours[k]:.2f} | {ours[k] / its[k]:.2f}" for k in ("error", "flicker")]
            print(f"| {kind} | {found['camera']} | {part} | {cells[0]} | {cells[1]} | {ours['de00']:.2f} |", flush=True)
        print(f"{kind}: {found['seconds']}", file=sys.stderr)


if __name__ == "__main__":
    main()
