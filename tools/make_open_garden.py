"""Opens the demo's garden to a sky where its wall is and writes it as a COLMAP folder.

    python tools/make_open_garden.py --out target/open-garden

Rays into the garden that `make_demo_scene.py` photographs tell which pixels of `assets/demo` show
the wall or its ivy, so all photos agree about what is sky. Its gray depends on the direction
alone, as of what is very far. Points on the wall are gone. Needs bpy, numpy, Pillow and pycolmap
of `tools/requirements.txt`.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import bpy
import numpy as np
import pycolmap
from demo_scene import cameras, layout, stage
from demo_scene.cameras import Camera
from demo_scene.meshes import Array
from mathutils import Vector
from PIL import Image

RAYS = 2  # A pixel's, along each side: silhouettes are soft.
JPEG_QUALITY = 95
WALL = {"brick", "mortar", "ivy"}  # Objects are named after their material.


def clouds(direction: Array) -> Array:
    """The gray of directions, `[..., 3]`: waves of some 20 to 60 degrees."""
    x, y, z = np.moveaxis(direction, -1, 0)
    waves = np.sin(7 * x + 2 * y) + np.cos(9 * y - 4 * z) + np.sin(15 * z + 6 * x)
    return 165 + 22 * waves


def directions(camera: Camera, width: int, height: int) -> Array:
    """Unit rays of `RAYS` by `RAYS` places a pixel in world axes, `[height, width, rays, 3]`."""
    focal = cameras.focal_pixels(width)
    within = (np.arange(RAYS) + 0.5) / RAYS
    down, right = np.meshgrid(within, within, indexing="ij")
    x = np.arange(width)[None, :, None] + right.ravel() - width / 2
    y = np.arange(height)[:, None, None] + down.ravel() - height / 2
    x, y = np.broadcast_arrays(x, y)
    rays = np.stack([x / focal, y / focal, np.ones_like(x)], axis=-1) @ camera.rotation
    return rays / np.linalg.norm(rays, axis=-1, keepdims=True)


def share_of_wall(camera: Camera, rays: Array) -> Array:
    """How much of each pixel shows the wall, `[height, width]`."""
    scene, graph = bpy.context.scene, bpy.context.evaluated_depsgraph_get()
    origin = Vector(camera.center)
    hits = np.zeros(rays.shape[:-1])
    for place in np.ndindex(hits.shape):
        hit, _, _, _, item, _ = scene.ray_cast(graph, origin, Vector(rays[place]))
        hits[place] = hit and item.name.split(".")[0] in WALL
    return hits.mean(axis=-1)


def main() -> None:
    """Casts rays, paints and writes."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--demo", type=Path, default=Path("assets/demo"), help="capture to open")
    parser.add_argument("--out", type=Path, required=True, help="COLMAP folder to write")
    options = parser.parse_args()
    images, model = options.out / "images", options.out / "sparse" / "0"
    for folder in (images, model):
        folder.mkdir(parents=True, exist_ok=True)
    stage.build(layout.demo_layout())
    shares = {}
    for camera in cameras.demo_cameras():
        name = f"{camera.name}.jpg"
        photo = np.asarray(Image.open(options.demo / "images" / name).convert("RGB"))
        rays = directions(camera, photo.shape[1], photo.shape[0])
        share = share_of_wall(camera, rays)
        sky = np.repeat(clouds(rays).mean(axis=-1)[..., None], 3, axis=-1)
        shares[name] = share
        painted = share[..., None] * sky + (1 - share[..., None]) * photo
        picture = Image.fromarray(np.clip(painted + 0.5, 0, 255).astype(np.uint8))
        picture.save(images / name, quality=JPEG_QUALITY, subsampling=0)
    scene = pycolmap.Reconstruction(options.demo / "sparse" / "0")
    for number, point in list(scene.points3D.items()):
        on_wall = []
        for seen in point.track.elements:
            image = scene.images[seen.image_id]
            x, y = image.points2D[seen.point2D_idx].xy
            share = shares[image.name]
            on_wall.append(share[min(int(y), len(share) - 1), min(int(x), len(share[0]) - 1)])
        if np.mean(on_wall) > 0.5:
            scene.delete_point3D(number)
    scene.write(model)
    sky = float(np.mean([share.mean() for share in shares.values()]))
    print(f"{options.out}: {len(shares)} views, {len(scene.points3D)} points, {100 * sky:.0f} % sky")


if __name__ == "__main__":
    main()
