"""COLMAP's sparse models: read as binary or text, written as binary, the one form that all programs read.

Format: <https://colmap.github.io/format.html>. Observations are kept: where points lie in photos tells
gs-chroma which effects there are; others need none.
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
    """A photo: pose (quaternion and translation), the number of its camera, name, and what points lie
    where in it: x and y in pixels, and the point's number."""

    pose: tuple[float, ...]
    camera: int
    name: str
    seen: tuple[tuple[float, float, int], ...]

    def scaled(self, x: float, y: float) -> Shot:
        return self._replace(seen=tuple((u * x, v * y, point) for u, v, point in self.seen))


@dataclass
class Model:
    """What the three files of a model say."""

    cameras: dict[int, Camera] = field(default_factory=dict)
    shots: list[Shot] = field(default_factory=list)
    # The points' numbers, positions and colors.
    points: list[int] = field(default_factory=list)
    positions: list[tuple[float, ...]] = field(default_factory=list)
    colors: list[tuple[int, ...]] = field(default_factory=list)

    def write(self, folder: Path) -> None:
        folder.mkdir(parents=True)

        def save(name: str, records: list[bytes]) -> None:
            (folder / name).write_bytes(struct.pack("<Q", len(records)) + b"".join(records))

        save("cameras.bin", [struct.pack("<IiQQ4d", n, PINHOLE, *camera) for n, camera in self.cameras.items()])
        tracks: dict[int, list[tuple[int, int]]] = {point: [] for point in self.points}
        for n, shot in enumerate(self.shots, 1):
            for k, (_, _, point) in enumerate(shot.seen):
                if point not in tracks:
                    raise Problem(f"{shot.name} observes point {point}, which the model lacks")
                tracks[point].append((n, k))

        def records(layout: str, values: Sequence[tuple[Any, ...]]) -> bytes:
            return struct.pack("<Q", len(values)) + b"".join(struct.pack("<" + layout, *one) for one in values)

        save("images.bin", [
            struct.pack("<I7dI", n, *shot.pose, shot.camera) + shot.name.encode() + b"\0" + records("2dQ", shot.seen)
            for n, shot in enumerate(self.shots, 1)
        ])  # fmt: skip
        save("points3D.bin", [
            struct.pack("<Q3d3Bd", point, *position, *color, 0.0) + records("2I", tracks[point])
            for point, position, color in zip(self.points, self.positions, self.colors, strict=True)
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
        name = file.name()
        # -1 is no point.
        seen = [found for found in (file.take("2dq") for _ in range(file.count())) if found[2] >= 0]
        model.shots.append(Shot(tuple(pose), camera, name, tuple(seen)))
    file = Binary(folder / "points3D.bin")
    for _ in range(file.count()):
        point, x, y, z, red, green, blue, _ = file.take("Q3d3Bd")
        model.points.append(point)
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
    # Every second line holds the observations, and may be empty.
    images = rows("images.txt")
    for row, seen in zip(images[::2], [*images[1::2], ""]):
        if not row.strip():
            continue
        _, *pose, camera, name = row.split(maxsplit=9)
        values = seen.split()
        found = ((float(x), float(y), int(point)) for x, y, point in zip(*[iter(values)] * 3, strict=True))
        seen_points = tuple(one for one in found if one[2] >= 0)
        model.shots.append(Shot(tuple(float(v) for v in pose), int(camera), name.strip(), seen_points))
    for row in filter(str.strip, rows("points3D.txt")):
        values = row.split()
        model.points.append(int(values[0]))
        model.positions.append(tuple(float(v) for v in values[1:4]))
        model.colors.append(tuple(int(v) for v in values[4:7]))
    return model
