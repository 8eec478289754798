"""Renders the demo's garden through a fisheye of 140 degrees and writes it as a COLMAP folder.

    python tools/make_wide_fisheye.py --out target/variants/wide-fisheye

The lens is OPENCV_FISHEYE without coefficients: a pixel's distance from the center is
proportional to the angle. Poses are the renderer's; points are where rays meet the garden,
seen by every view from which nothing hides them. Needs bpy, numpy and Pillow of
`tools/requirements.txt`.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import bpy
import numpy as np
from demo_scene import cameras, layout, stage
from demo_scene.cameras import Camera
from demo_scene.meshes import Array
from mathutils import Vector
from PIL import Image

SAMPLES = 8
FIELD = np.radians(140.0)  # Over the picture's diagonal.
SIDE = 400  # Of the square picture, in pixels.
CIRCLE = 568  # Blender's fisheye fills a circle, black beyond; the picture is a square in it.
FOCAL = CIRCLE / FIELD  # Pixels a radian.
RAYS = 350  # Places drawn from each view.
FARTHEST = 30.0  # Meters; the lawn goes on, and tells nothing.
SLACK = 0.005  # Part of the distance by which a ray may miss a place that it sees.
MIN_TRACK = 3
SEED = 5


def set_lens() -> None:
    """Turns the tripod's lens into the fisheye and renders the square in its circle alone."""
    scene = bpy.context.scene
    lens = scene.camera.data
    lens.type = "PANO"
    lens.panorama_type = "FISHEYE_EQUIDISTANT"
    lens.fisheye_fov = FIELD
    margin = (CIRCLE - SIDE) / 2 / CIRCLE
    scene.render.use_border = scene.render.use_crop_to_border = True
    scene.render.border_min_x = scene.render.border_min_y = margin
    scene.render.border_max_x = scene.render.border_max_y = 1 - margin


def ray(pixel: Array) -> Array:
    """The unit ray of a pixel in camera axes."""
    offset = pixel - SIDE / 2
    distance = float(np.hypot(*offset))
    angle = distance / FOCAL
    side = offset * (np.sin(angle) / max(distance, 1e-12))
    return np.array([side[0], side[1], np.cos(angle)])


def pixel_of(camera: Camera, place: Array) -> Array | None:
    """Where a view has a place, if it is in the picture."""
    x, y, z = camera.rotation @ (place - camera.center)
    aside = float(np.hypot(x, y))
    pixel = FOCAL * np.arctan2(aside, z) * np.array([x, y]) / max(aside, 1e-12) + SIDE / 2
    return pixel if (0 < pixel).all() and (pixel < SIDE).all() else None


def first_hit(origin: Array, direction: Array) -> Array | None:
    """Where a ray meets the garden."""
    scene = bpy.context.scene
    graph = bpy.context.evaluated_depsgraph_get()
    hit, place, *_ = scene.ray_cast(graph, Vector(origin), Vector(direction), distance=FARTHEST)
    return np.array(place) if hit else None


def sees(camera: Camera, place: Array) -> Array | None:
    """The pixel of a place if the view sees it."""
    pixel = pixel_of(camera, place)
    if pixel is None:
        return None
    way = place - camera.center
    distance = float(np.linalg.norm(way))
    hit = first_hit(camera.center, way / distance)
    near = hit is not None and np.linalg.norm(hit - place) < SLACK * distance
    return pixel if near else None


def survey(views: list[Camera]) -> list[tuple[Array, dict[int, Array]]]:
    """Places with the pixels of all views that see them."""
    rng = np.random.default_rng(SEED)
    found = []
    for camera in views:
        for pixel in rng.uniform(0, SIDE, (RAYS, 2)):
            place = first_hit(camera.center, camera.rotation.T @ ray(pixel))
            if place is None:
                continue
            track = {index: sees(view, place) for index, view in enumerate(views)}
            track = {index: pixel for index, pixel in track.items() if pixel is not None}
            if len(track) >= MIN_TRACK:
                found.append((place, track))
    return found


def quaternion(rotation: Array) -> list[float]:
    """w x y z of a rotation matrix."""
    from mathutils import Matrix

    return list(Matrix(rotation.tolist()).to_quaternion())


def write_model(views: list[Camera], points: list[tuple[Array, dict[int, Array]]], out: Path) -> None:
    """Writes cameras.txt, images.txt and points3D.txt; colors are the photos'."""
    folder = out / "sparse" / "0"
    folder.mkdir(parents=True, exist_ok=True)
    numbers = [FOCAL, FOCAL, SIDE / 2, SIDE / 2, 0, 0, 0, 0]
    words = " ".join(map(str, numbers))
    (folder / "cameras.txt").write_text(f"1 OPENCV_FISHEYE {SIDE} {SIDE} {words}\n")
    photos = [np.asarray(Image.open(out / "images" / f"{v.name}.png").convert("RGB")) for v in views]
    seen: list[list[str]] = [[] for _ in views]
    lines = []
    for number, (place, track) in enumerate(points, start=1):
        view, (x, y) = next(iter(track.items()))
        words = [number, *place, *photos[view][int(y), int(x)], 0]
        for index, pixel in track.items():
            words += [index + 1, len(seen[index])]
            seen[index].append(f"{pixel[0]} {pixel[1]} {number}")
        lines.append(" ".join(map(str, words)) + "\n")
    (folder / "points3D.txt").write_text("".join(lines))
    lines = []
    for index, view in enumerate(views):
        shift = -view.rotation @ view.center
        words = [index + 1, *quaternion(view.rotation), *shift, 1, f"{view.name}.png"]
        lines.append(" ".join(map(str, words)) + "\n" + " ".join(seen[index]) + "\n")
    (folder / "images.txt").write_text("".join(lines))


def main() -> None:
    """Renders, surveys and writes."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, required=True, help="COLMAP folder to write")
    out = parser.parse_args().out
    views = cameras.demo_cameras()
    stage.build(layout.demo_layout())
    stage.settings(CIRCLE, CIRCLE, SAMPLES)
    stage.shoot(views, out / "images", set_lens)
    points = survey(views)
    write_model(views, points, out)
    print(f"{out}: {len(views)} views, {len(points)} points")


if __name__ == "__main__":
    main()
