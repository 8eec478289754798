"""Makes a COLMAP folder of many photos, to see what memory and time a large capture takes.

    python3 tools/make_large_capture.py --photos 300 --size 1600x1200 OUT [--teacher OUT2] [--points N]

Photos are the bundled garden's, enlarged and in gray; there are no more than 14 different
ones, and each further photo is a hard link to one of them. Cameras stand on an arc around a
ball of points, with tracks. Poses and photos have nothing to do with each other: what is
trained on such a folder looks like nothing, and takes the room and the time of a real one.
`--teacher` writes the same photos in color, under the same names. Needs Pillow of
`tools/requirements.txt`.
"""

from __future__ import annotations

import argparse
import math
import os
import random
from pathlib import Path

from PIL import Image

BUNDLED = Path(__file__).parent.parent / "assets/demo/images"
DISTANCE = 4.0  # Of the cameras from the middle of the points, which lie within 1 of it.
ARC = 1.5 * math.pi
NEIGHBORS = 12  # Views of a point's track, one after the other on the arc.
POINTS_MIN = 3000
QUALITY = 90
SEED = 5


def enlarged(path: Path, size: tuple[int, int]) -> Image.Image:
    """The largest part of a photo with the aspect ratio of `size`, brought to it."""
    photo = Image.open(path).convert("RGB")
    share = min(photo.width / size[0], photo.height / size[1])
    width, height = share * size[0], share * size[1]
    left, top = (photo.width - width) / 2, (photo.height - height) / 2
    box = (left, top, left + width, top + height)
    return photo.resize(size, Image.Resampling.BICUBIC, box=box)


def write_photos(folder: Path, count: int, size: tuple[int, int], mode: str) -> None:
    """Writes `photo_0000.jpg` and so on; from the 15th on they are links to the first."""
    folder.mkdir(parents=True, exist_ok=True)
    bundled = sorted(BUNDLED.iterdir())
    for index in range(count):
        path = folder / name_of(index)
        path.unlink(missing_ok=True)
        if index < len(bundled):
            enlarged(bundled[index], size).convert(mode).save(path, quality=QUALITY)
        else:
            os.link(folder / name_of(index % len(bundled)), path)


def name_of(index: int) -> str:
    return f"photo_{index:04}.jpg"


def pose(angle: float) -> tuple[list[float], list[list[float]]]:
    """Quaternion, w first, and rotation of a camera on the arc that looks at its middle."""
    # About the y axis: at the angle 0 the camera stands at z = -DISTANCE and looks along z.
    sine, cosine = math.sin(angle), math.cos(angle)
    rotation = [[cosine, 0.0, sine], [0.0, 1.0, 0.0], [-sine, 0.0, cosine]]
    return [math.cos(angle / 2), 0.0, math.sin(angle / 2), 0.0], rotation


def in_ball(numbers: random.Random) -> list[float]:
    while True:
        place = [numbers.uniform(-1.0, 1.0) for _ in range(3)]
        if sum(c * c for c in place) <= 1.0:
            return place


def write_model(folder: Path, count: int, size: tuple[int, int], points: int) -> None:
    """Writes cameras, poses, points and tracks as COLMAP's text files."""
    folder.mkdir(parents=True, exist_ok=True)
    width, height = size
    focal = float(max(size))
    (folder / "cameras.txt").write_text(
        f"1 PINHOLE {width} {height} {focal} {focal} {width / 2} {height / 2}\n"
    )
    numbers = random.Random(SEED)
    angles = [ARC * index / count for index in range(count)]
    poses = [pose(angle) for angle in angles]
    seen: list[list[str]] = [[] for _ in range(count)]
    lines = []
    for point in range(1, points + 1):
        place = in_ball(numbers)
        first = numbers.randrange(max(1, count - NEIGHBORS + 1))
        track = []
        for view in range(first, min(first + NEIGHBORS, count)):
            x, y, z = (sum(a * b for a, b in zip(row, place)) for row in poses[view][1])
            u = width / 2 + focal * x / (z + DISTANCE)
            v = height / 2 + focal * y / (z + DISTANCE)
            if 0 <= u < width and 0 <= v < height:
                track.append(f"{view + 1} {len(seen[view])}")
                seen[view].append(f"{u:.3f} {v:.3f} {point}")
        position = " ".join(f"{c:.6f}" for c in place)
        gray = numbers.randrange(256)
        lines.append(f"{point} {position} {gray} {gray} {gray} 0.5 {' '.join(track)}\n")
    (folder / "points3D.txt").write_text("".join(lines))
    with (folder / "images.txt").open("w") as images:
        for view, (quaternion, _) in enumerate(poses):
            turned = " ".join(f"{c:.9f}" for c in quaternion)
            images.write(f"{view + 1} {turned} 0 0 {DISTANCE} 1 {name_of(view)}\n")
            images.write(" ".join(seen[view]) + "\n")


def size_of(text: str) -> tuple[int, int]:
    width, _, height = text.partition("x")
    return int(width), int(height)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("out", type=Path, help="the COLMAP folder to write")
    parser.add_argument("--photos", type=int, default=300)
    parser.add_argument("--size", type=size_of, default=(1600, 1200), metavar="WxH")
    parser.add_argument("--points", type=int, help="four for each photo, 3000 at least")
    parser.add_argument("--color", action="store_true", help="photos in color, not in gray")
    parser.add_argument("--teacher", type=Path, help="also write the photos in color here")
    arguments = parser.parse_args()
    mode = "RGB" if arguments.color else "L"
    write_photos(arguments.out / "images", arguments.photos, arguments.size, mode)
    points = arguments.points or max(POINTS_MIN, 4 * arguments.photos)
    write_model(arguments.out / "sparse/0", arguments.photos, arguments.size, points)
    if arguments.teacher:
        write_photos(arguments.teacher, arguments.photos, arguments.size, "RGB")


if __name__ == "__main__":
    main()
