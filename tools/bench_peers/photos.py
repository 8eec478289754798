"""The gray photos that all programs get."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike
from PIL import Image

from bench_peers.colmap import Camera, Model, Shot, read_model
from bench_peers.command import Problem
from lab import RGB_TO_XYZ, decode, encode

# Every how many photos by name one is held out: the habit of all programs.
HOLDOUT_STEP = 8

# Which photos are held out: every eighth, or the first and the last by name, the ends of an arc, beyond
# which no photo that is trained on looks.
HELD = ("eighth", "ends")

# A photo's aspect may differ from its camera's by so much, as in gs-chroma.
ASPECT_SLACK = 0.01


def to_gray(rgb: ArrayLike) -> np.ndarray:
    """8-bit gray with the L* of 8-bit colors, as the program makes it: equal L* is equal luminance."""
    return np.rint(255 * encode(decode(np.asarray(rgb) / 255) @ RGB_TO_XYZ[1])).astype(np.uint8)


def held_indices(count: int, held: str) -> set[int]:
    """Which of so many photos by name are held out."""
    return {0, count - 1} if held == "ends" else set(range(0, count, HOLDOUT_STEP))


def copy_gray(colmap: Path, gray: Path, side: int, held: str) -> list[str]:
    """Writes the COLMAP folders `all`, `train` and `held` below `gray`; gives the held-out photos' names.

    Photos are scaled to the size of their camera, and the camera before that to the longer side:
    a program that takes the camera's size for the photo's, or the other way round, is right too.
    """
    model = read_model(colmap)
    cameras: dict[int, Camera] = {}
    shots: list[Shot] = []

    def new_name(shot: Shot) -> str:
        return str(Path(shot.name).with_suffix(".png"))

    for shot in sorted(model.shots, key=new_name):
        with Image.open(colmap / "images" / shot.name) as file:
            photo = file.convert("RGB")
        camera = model.cameras[shot.camera]
        if abs(photo.width / photo.height * camera.height / camera.width - 1) > ASPECT_SLACK:
            raise Problem(f"{shot.name} has another aspect than its camera")
        fitted = cameras.setdefault(shot.camera, camera.fitted(min(side, max(photo.size))))
        small = photo.resize((fitted.width, fitted.height), Image.Resampling.LANCZOS)
        shot = shot._replace(name=new_name(shot))
        shot = shot.scaled(fitted.width / camera.width, fitted.height / camera.height)
        path = gray / "all" / "images" / shot.name
        path.parent.mkdir(parents=True, exist_ok=True)
        # Three equal channels: not every program reads a file of one.
        Image.fromarray(to_gray(small)).convert("RGB").save(path)
        shots.append(shot)

    indices = held_indices(len(shots), held)
    held_out = [shot for i, shot in enumerate(shots) if i in indices]
    train = [shot for i, shot in enumerate(shots) if i not in indices]
    for name, some in (("train", train), ("held", held_out)):
        for shot in some:
            path = gray / name / "images" / shot.name
            path.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(gray / "all" / "images" / shot.name, path)
    colors = [(int(v),) * 3 for v in to_gray(model.colors)]
    for name, some in (("all", shots), ("train", train), ("held", held_out)):
        Model(cameras, some, model.points, model.positions, colors).write(gray / name / "sparse" / "0")
    return [shot.name for shot in held_out]
