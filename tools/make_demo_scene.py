"""Renders the garden, recovers its cameras with COLMAP, and writes the small demo capture.

    python tools/make_demo_scene.py --work target/demo --out assets/demo

Needs `tools/requirements.txt`. Large renders and the SfM model stay in the work folder and are
used again by a later run; the capture (small JPEGs, sparse/0) goes to the out folder.
"""

from __future__ import annotations

import argparse
import json
import shutil
import time
from pathlib import Path

from PIL import Image

from demo_scene import cameras

RENDER_SIZE = (960, 640)
RENDER_SAMPLES = 8
SHIPPED_WIDTH = 324  # 324 x 216 keeps 3:2 exactly, so one focal length serves both axes.
JPEG_QUALITY = 92


def render(folder: Path) -> None:
    """Renders the demo views to `folder`, each one once."""
    from demo_scene import layout, stage  # Blender takes seconds to import.

    stage.build(layout.demo_layout())
    stage.settings(*RENDER_SIZE, RENDER_SAMPLES)
    stage.shoot(cameras.demo_cameras(), folder)


def ship(renders: Path, folder: Path, width: int) -> None:
    """Writes every render as a small JPEG (Lanczos, 4:4:4)."""
    folder.mkdir(parents=True, exist_ok=True)
    for old in folder.glob("*.jpg"):
        old.unlink()
    for path in sorted(renders.glob("*.png")):
        picture = Image.open(path).convert("RGB")
        height = round(picture.height * width / picture.width)
        small = picture.resize((width, height), Image.Resampling.LANCZOS)
        small.save(folder / f"{path.stem}.jpg", quality=JPEG_QUALITY, subsampling=0)


def main() -> None:
    """Runs render, SfM, shrink and check in turn."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--work", type=Path, required=True, help="folder for renders and SfM")
    parser.add_argument("--out", type=Path, default=Path("assets/demo"), help="capture to write")
    parser.add_argument("--width", type=int, default=SHIPPED_WIDTH, help="width of shipped photos")
    parser.add_argument("--only-render", action="store_true", help="stop after the large renders")
    options = parser.parse_args()

    start = time.monotonic()
    renders = options.work / "renders"
    wanted = {camera.name for camera in cameras.demo_cameras()}
    if {path.stem for path in renders.glob("*.png")} != wanted:
        render(renders)
    if options.only_render:
        return
    rendered = time.monotonic()
    ship(renders, options.out / "images", options.width)

    # Only now: pycolmap and Pillow each bring a zlib, and Pillow after pycolmap can crash.
    from demo_scene import sfm

    model = sfm.reconstruct(renders, options.work)
    facts = sfm.compare(model, cameras.demo_cameras(), RENDER_SIZE[0])
    sparse = options.out / "sparse" / "0"
    shutil.rmtree(sparse, ignore_errors=True)
    facts |= sfm.write_small(model, sparse, options.width, options.out / "images")
    facts["seconds"] = {
        "render": round(rendered - start), "sfm": round(time.monotonic() - rendered)
    }  # fmt: skip
    (options.work / "facts.json").write_text(json.dumps(facts, indent=1) + "\n")
    print(json.dumps(facts, indent=1))


if __name__ == "__main__":
    main()
