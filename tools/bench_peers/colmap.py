"""COLMAP's sparse models: read as binary or text, written as binary, the one form that all programs read.

Format: <https://colmap.github.io/format.html>. 2D observations are left out: no trainer needs them.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

from bench_peers.command import Problem

# COLMAP's camera models by number, as far as gs-chroma takes them: name and count of parameters.
KINDS = [("SIMPLE_PINHOLE", 3), ("PINHOLE", 4)]
PINHOLE = 1


class Camera(NamedTuple):
    """A PINHOLE camera in COLMAP's order."""

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float

    @classmethod
    def of(cls, width: int, height: int, values: Sequence[float]) -> Camera:
        """From the parameters of either kind; the simple one has one focal length."""
        return cls(width, height, values[0], values[-3], values[-2], values[-1])

    def fitted(self, longer: int) -> Camera:
        """The same view with a longer side of so many pixels."""
        scale = longer / max(self.width, self.height)
        width, height = max(1, round(self.width * scale)), max(1, round(self.height * scale))
        x, y = width / self.width, height / self.height
        return Camera(width, height, self.fx * x, self.fy * y, self.cx * x, self.cy * y)


class Shot(NamedTuple):
    """A photo's pose (quaternion and translation), the number of its camera, and its name."""

    pose: tuple[float, ...]
    camera: int
    name: str


@dataclass
class Model:
    """What the three files of a model say."""

    cameras: dict[int, Camera] = field(default_factory=dict)
    shots: list[Shot] = field(default_factory=list)
    positions: list[tuple[float, ...]] = field(default_factory=list)
    colors: list[tuple[int, ...]] = field(default_factory=list)

    def write(self, folder: Path) -> None:
        folder.mkdir(parents=True)

        def save(name: str, records: list[bytes]) -> None:
            (folder / name).write_bytes(struct.pack("<Q", len(records)) + b"".join(records))

        save("cameras.bin", [struct.pack("<IiQQ4d", n, PINHOLE, *camera) for n, camera in self.cameras.items()])
        nothing_seen = struct.pack("<Q", 0)
        save("images.bin", [
            struct.pack("<I7dI", n, *shot.pose, shot.camera) + shot.name.encode() + b"\0" + nothing_seen
            for n, shot in enumerate(self.shots, 1)
        ])  # fmt: skip
        save("points3D.bin", [
            struct.pack("<Q3d3Bd", n, *position, *color, 0.0) + nothing_seen
            for n, (position, color) in enumerate(zip(self.positions, self.colors, strict=True), 1)
        ])  # fmt: skip


def read_model(colmap: Path) -> Model:
    """From sparse/0, sparse or the folder itself, binary before text, as gs-chroma looks for it."""
    for folder in (colmap / "sparse" / "0", colmap / "sparse", colmap):
        for name, read in (("cameras.bin", read_binary), ("cameras.txt", read_text)):
            if (folder / name).is_file():
                try:
                    return read(folder)
                except (ValueError, IndexError, struct.error):
                    raise Problem(f"the COLMAP model in {folder} is damaged") from None
    raise Problem(f"{colmap} holds no COLMAP model")


class Binary:
    """Takes values from a little-endian file, one after the other."""

    def __init__(self, path: Path) -> None:
        self.data, self.at = path.read_bytes(), 0

    def take(self, layout: str) -> tuple[Any, ...]:
        values = struct.unpack_from("<" + layout, self.data, self.at)
        self.at += struct.calcsize("<" + layout)
        return values

    def count(self) -> int:
        return self.take("Q")[0]

    def skip(self, size: int) -> None:
        """A count, and so many things of a size."""
        count = self.count()
        self.at += size * count

    def name(self) -> str:
        """Up to the next zero byte."""
        end = self.data.index(b"\0", self.at)
        text, self.at = self.data[self.at : end].decode(), end + 1
        return text


def read_binary(folder: Path) -> Model:
    model = Model()
    file = Binary(folder / "cameras.bin")
    for _ in range(file.count()):
        number, kind, width, height = file.take("IiQQ")
        if not 0 <= kind < len(KINDS):
            raise Problem(f"camera {number} is no pinhole; run COLMAP's image_undistorter")
        model.cameras[number] = Camera.of(width, height, file.take(f"{KINDS[kind][1]}d"))
    file = Binary(folder / "images.bin")
    for _ in range(file.count()):
        _, *pose, camera = file.take("I7dI")
        model.shots.append(Shot(tuple(pose), camera, file.name()))
        file.skip(24)
    file = Binary(folder / "points3D.bin")
    for _ in range(file.count()):
        _, x, y, z, red, green, blue, _ = file.take("Q3d3Bd")
        model.positions.append((x, y, z))
        model.colors.append((red, green, blue))
        file.skip(8)
    return model


def read_text(folder: Path) -> Model:
    def rows(name: str) -> list[str]:
        return [row for row in (folder / name).read_text().splitlines() if not row.startswith("#")]

    model = Model()
    for row in filter(str.strip, rows("cameras.txt")):
        number, kind, width, height, *values = row.split()
        if (kind, len(values)) not in KINDS:
            raise Problem(f"camera {number} is no pinhole; run COLMAP's image_undistorter")
        model.cameras[int(number)] = Camera.of(int(width), int(height), [float(v) for v in values])
    # Every second line holds the 2D observations, and may be empty.
    for row in filter(str.strip, rows("images.txt")[::2]):
        _, *pose, camera, name = row.split(maxsplit=9)
        model.shots.append(Shot(tuple(float(v) for v in pose), int(camera), name.strip()))
    for row in filter(str.strip, rows("points3D.txt")):
        values = row.split()
        model.positions.append(tuple(float(v) for v in values[1:4]))
        model.colors.append(tuple(int(v) for v in values[4:7]))
    return model
