"""Makes a COLMAP folder of a drone's survey of any size, to see what `partition` takes.

    python3 tools/make_large_survey.py OUT --photos 20000 --points 2000000

Cameras stand in a grid above flat ground and look straight down; every point has a track of the
nine cameras around it. The model is binary, as COLMAP
writes it. Photos are hard links to one small gray picture in a folder for each thousand of them;
`partition` does not look at them. Needs NumPy and Pillow of `tools/requirements.txt`.
"""

from __future__ import annotations

import argparse
import math
import os
import struct
from pathlib import Path

import numpy as np
from PIL import Image

SIZE = (4000, 3000)  # Of the cameras; the picture has the same shape.
PICTURE = (400, 300)
FOCAL = 3000.0
HEIGHT = 100.0  # Of the cameras above the ground, in world units.
STEP = 25.0  # Between neighbors: each camera shows 133 × 100 of the ground.
SEED = 7
TRACK = np.array([(row, column) for row in (-1, 0, 1) for column in (-1, 0, 1)])

POINT = np.dtype(
    [
        ("id", "<u8"),
        ("position", "<f8", 3),
        ("color", "u1", 3),
        ("error", "<f8"),
        ("length", "<u8"),
        ("track", "<u4", (len(TRACK), 2)),
    ]
)
OBSERVATION = np.dtype([("pixel", "<f8", 2), ("point", "<u8")])


def name_of(index: int) -> str:
    return f"{index // 1000:03}/{index:06}.png"


def write_photos(folder: Path, count: int) -> None:
    """One picture, and links to it."""
    first = folder / name_of(0)
    for thousand in range(math.ceil(count / 1000)):
        (folder / name_of(1000 * thousand)).parent.mkdir(parents=True, exist_ok=True)
    Image.new("L", PICTURE, 128).save(first)
    for index in range(1, count):
        path = folder / name_of(index)
        path.unlink(missing_ok=True)
        os.link(first, path)


def write_model(folder: Path, photos: int, count: int) -> None:
    """Writes cameras.bin, images.bin and points3D.bin."""
    folder.mkdir(parents=True, exist_ok=True)
    columns = math.ceil(math.sqrt(photos))
    rows = math.ceil(photos / columns)
    width, height = SIZE
    with (folder / "cameras.bin").open("wb") as file:
        file.write(struct.pack("<Q", 1))
        file.write(struct.pack("<IiQQ4d", 1, 1, width, height, FOCAL, FOCAL, width / 2, height / 2))

    numbers = np.random.default_rng(SEED)
    extent = np.array([rows - 1, columns - 1]) * STEP
    ground = numbers.random((count, 2)) * extent
    depth = HEIGHT - numbers.random(count)
    near = np.clip(np.rint(ground / STEP).astype(int), 1, [rows - 2, columns - 2])
    around = near[:, None, :] + TRACK[None]
    image = around[..., 0] * columns + around[..., 1]
    image = np.minimum(image, photos - 1)
    places = np.stack([image // columns, image % columns], axis=-1) * STEP
    # x along the columns and y along the rows: cameras without rotation look along z, down.
    offsets = (ground[:, None, :] - places)[..., ::-1]
    pixels = offsets / depth[:, None, None] * FOCAL + np.array([width, height]) / 2

    flat = image.ravel()
    order = np.argsort(flat, kind="stable")
    starts = np.searchsorted(flat[order], np.arange(photos + 1))
    index = np.empty(len(flat), dtype="<u4")
    index[order] = np.arange(len(flat)) - np.repeat(starts[:-1], np.diff(starts))

    points = np.zeros(count, dtype=POINT)
    points["id"] = np.arange(1, count + 1)
    points["position"][:, :2] = ground[:, ::-1]
    points["position"][:, 2] = depth
    points["color"] = numbers.integers(0, 256, (count, 1))
    points["error"] = 0.5
    points["length"] = len(TRACK)
    points["track"][..., 0] = image + 1
    points["track"][..., 1] = index.reshape(image.shape)
    with (folder / "points3D.bin").open("wb") as file:
        file.write(struct.pack("<Q", count))
        points.tofile(file)

    seen = np.zeros(len(flat), dtype=OBSERVATION)
    seen["pixel"] = pixels.reshape(-1, 2)[order]
    seen["point"] = np.repeat(np.arange(1, count + 1), len(TRACK))[order]
    with (folder / "images.bin").open("wb") as file:
        file.write(struct.pack("<Q", photos))
        for view in range(photos):
            row, column = divmod(view, columns)
            pose = (1.0, 0.0, 0.0, 0.0, -column * STEP, -row * STEP, 0.0)
            file.write(struct.pack("<I7dI", view + 1, *pose, 1))
            file.write(name_of(view).encode() + b"\0")
            own = seen[starts[view] : starts[view + 1]]
            file.write(struct.pack("<Q", len(own)))
            own.tofile(file)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("out", type=Path, help="the COLMAP folder to write")
    parser.add_argument("--photos", type=int, default=20_000, help="at least nine")
    parser.add_argument("--points", type=int, default=2_000_000)
    arguments = parser.parse_args()
    write_photos(arguments.out / "images", arguments.photos)
    write_model(arguments.out / "sparse/0", arguments.photos, arguments.points)


if __name__ == "__main__":
    main()
