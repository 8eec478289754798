#!/usr/bin/env python3
"""What one stroke on each thing colors: the fern, its trunk, the wall and the floor of fern-llff.

    cargo build --release && python3 tools/check_strokes.py -o target/strokes

The scene is a COLMAP folder of color photos below DATA (default $SCENES or scenes), fitted with
`--fit` unless `--run` names a fitted run, and colored four times: by a real network without strokes, with
strokes that count where they are painted (`--grow-hints off`), with strokes that grow, and by
the photos themselves. All strokes are on one photo; their color is the mean of the true ones
beneath. The things' outlines are drawn by hand in three photos, one of them the painted one, the
others held out. Against the picture with the photos' colors in the things, and the network's
elsewhere, the table has the mean CIEDE2000 of the exported pictures: in each thing, and in
things beside them that nobody painted. A second table has the halo: what strokes change around
the plant, by distance from what is green in the photo. Needs numpy, Pillow, scikit-image, scipy.
"""

from __future__ import annotations

import argparse
import os
import shlex
import shutil
import subprocess
from pathlib import Path

import lab
import numpy as np
from PIL import Image, ImageDraw
from scipy.ndimage import distance_transform_edt
from skimage.color import deltaE_ciede2000

SIZE = (800, 600)
PAINTED = "IMG_4030"
BRUSH = 9

# Places in pixels of the photos.
STROKES = {
    "fern": [(160, 230), (270, 225), (390, 360), (430, 130), (400, 350), (620, 285)],
    "trunk": [(388, 402), (382, 440), (376, 466)],
    "wall": [(735, 240), (790, 300)],
    "floor": [(600, 500), (680, 560), (770, 540)],
}
OUTLINES = {
    "IMG_4030": {
        "fern": [(300, 355), (230, 330), (330, 260), (320, 205), (400, 150), (440, 150), (470, 220), (460, 300), (620, 285), (630, 340), (430, 355), (395, 395)],
        "trunk": [(374, 398), (404, 398), (398, 466), (364, 466)],
        "wall": [(725, 210), (800, 210), (800, 350), (735, 350)],
        "floor": [(540, 590), (620, 450), (690, 450), (730, 500), (800, 500), (800, 590)],
        "planter": [(210, 505), (500, 495), (500, 590), (190, 590)],
        "ceiling": [(680, 20), (800, 20), (800, 150), (680, 150)],
        "panel": [(510, 450), (585, 450), (585, 520), (510, 520)],
    },
    "IMG_4034": {
        "fern": [(380, 340), (260, 300), (300, 240), (270, 205), (400, 190), (430, 130), (480, 150), (490, 250), (600, 270), (690, 290), (690, 310), (480, 330), (400, 370)],
        "trunk": [(374, 382), (412, 382), (404, 450), (368, 450)],
        "wall": [(700, 215), (728, 215), (728, 335), (710, 335), (708, 280), (690, 250)],
        "floor": [(540, 560), (600, 430), (690, 430), (740, 450), (800, 430), (800, 590), (600, 590)],
        "planter": [(285, 490), (510, 475), (510, 560), (285, 590)],
        "ceiling": [(680, 20), (800, 20), (800, 150), (680, 150)],
        "panel": [(490, 430), (548, 430), (548, 490), (490, 490)],
    },
    "IMG_4042": {
        "fern": [(370, 340), (240, 290), (320, 240), (330, 180), (400, 130), (440, 120), (470, 180), (480, 280), (650, 240), (660, 290), (480, 320), (400, 360)],
        "trunk": [(378, 390), (414, 390), (408, 456), (372, 456)],
        "wall": [(740, 215), (800, 215), (800, 365), (750, 365), (738, 295)],
        "floor": [(545, 590), (620, 440), (700, 450), (740, 450), (800, 460), (800, 590)],
        "planter": [(215, 480), (515, 475), (515, 570), (215, 590)],
        "ceiling": [(680, 20), (800, 20), (800, 150), (680, 150)],
        "panel": [(515, 445), (590, 445), (590, 515), (515, 515)],
    },
}


# Distances in pixels of the photo, a* of what is green, and the rectangle that the plant is in.
AROUND = [(0, 3), (3, 6), (6, 12), (12, 24)]
GREEN = -6.0
PLANT = (60, 40, 760, 590)


def drawn(points: list[tuple[int, int]], size: tuple[int, int], stroke: bool) -> np.ndarray:
    """Which pixels a stroke or an outline covers."""
    mask = Image.new("L", SIZE)
    draw = ImageDraw.Draw(mask)
    if stroke:
        draw.line(points, fill=255, width=BRUSH, joint="curve")
    else:
        draw.polygon(points, fill=255)
    return np.asarray(mask.resize(size, Image.Resampling.BOX)) > 127


def paint(photos: Path, folder: Path) -> None:
    """Writes the strokes as a transparent layer of the photo's size."""
    photo = np.asarray(Image.open(photos / f"{PAINTED}.jpg").convert("RGB"))
    layer = np.zeros((*photo.shape[:2], 4), np.uint8)
    for points in STROKES.values():
        mask = drawn(points, SIZE, stroke=True)
        layer[mask] = [*photo[mask].mean(axis=0).round(), 255]
    folder.mkdir(parents=True, exist_ok=True)
    Image.fromarray(layer).save(folder / f"{PAINTED}.png")


def colored(program: str, run: Path, out: Path, flags: list[str]) -> dict[str, np.ndarray]:
    """Colors a copy of a run; gives the pictures of all views in CIELAB."""
    shutil.rmtree(out, ignore_errors=True)
    shutil.copytree(run, out)
    subprocess.run([program, "colorize", str(out), *flags], check=True)
    subprocess.run([program, "render", str(out), "--views", "all", "-o", str(out / "views")], check=True)
    pictures = {}
    for name in OUTLINES:
        picture = Image.open(next((out / "views").glob(f"{name}*.png"))).convert("RGB")
        pictures[name] = lab.rgb_to_lab(np.asarray(picture) / 255.0)
    return pictures


def from_the_plant(photo: Path, size: tuple[int, int]) -> np.ndarray:
    """How far each pixel of a picture is from what is green, in pixels of the photo."""
    picture = Image.open(photo).convert("RGB").resize(size, Image.Resampling.BOX)
    scale = size[0] / SIZE[0]
    left, top, right, bottom = (round(scale * v) for v in PLANT)
    inside = np.zeros(size[::-1], bool)
    inside[top:bottom, left:right] = True
    green = inside & (lab.rgb_to_lab(np.asarray(picture) / 255.0)[..., 1] < GREEN)
    return distance_transform_edt(~green) / scale


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--program", default="target/release/gs-chroma")
    parser.add_argument("--data", type=Path, default=Path(os.environ.get("SCENES", "scenes")))
    parser.add_argument("--run", type=Path, help="a fitted run of fern-llff")
    parser.add_argument("--fit", default="--preset draft --max-side 800 --max-splats 40000", help="flags, as one word")
    parser.add_argument("--network", type=Path, help="default: places-resnet18 below DATA")
    parser.add_argument("-o", "--out", type=Path, default=Path("target/strokes"))
    parser.add_argument("--only-strokes", action="store_true", help="color anew with growing strokes only")
    args = parser.parse_args()
    scene = args.data / "fern-llff"
    network = args.network or args.data / "teacher-places/places-resnet18.onnx"
    if not (scene.is_dir() and network.is_file()):
        print(f"{scene} or {network} is not there: skipped")
        return
    run, hints = args.run or args.out / "run", args.out / "hints"
    if not (run / "luma.ply").is_file():
        fit = [args.program, "fit", str(scene), "-o", str(run), *shlex.split(args.fit)]
        subprocess.run(fit, check=True)
    paint(scene / "images", hints)
    taught = ["--teacher", str(network)]
    ways = {
        "network alone": taught,
        "photos' colors": ["--teacher", str(scene / "images")],
        "strokes as painted": [*taught, "--hints", str(hints), "--grow-hints", "off"],
        "strokes grow": [*taught, "--hints", str(hints)],
    }
    found = {}
    for way, flags in ways.items():
        out = args.out / way.replace(" ", "-").replace("'", "")
        kept = args.out / f"{out.name}.npz"
        if not (args.only_strokes and way != "strokes grow" and kept.is_file()):
            np.savez(kept, **colored(args.program, run, out, flags))
        found[way] = dict(np.load(kept))
    things = list(OUTLINES[PAINTED])
    print("| ΔE00 | " + " | ".join(things) + " |\n" + "|---" * (1 + len(things)) + "|")
    for way, pictures in found.items():
        row = []
        for thing in things:
            wanted = found["photos' colors" if thing in STROKES else "network alone"]
            errors = []
            for name, picture in pictures.items():
                size = picture.shape[1::-1]
                mask = drawn(OUTLINES[name][thing], size, stroke=False)
                errors.append(deltaE_ciede2000(picture[mask], wanted[name][mask]).mean())
            row.append(f"{np.mean(errors):.1f}")
        print(f"| {way} | " + " | ".join(row) + " |")
    print("\n| ΔE00 to the network alone | in the plant | " + " | ".join(f"{a}–{b} px" for a, b in AROUND) + " |")
    print("|---" * (2 + len(AROUND)) + "|")
    for way in ("strokes as painted", "strokes grow"):
        changes = [[] for _ in range(1 + len(AROUND))]
        for name, picture in found[way].items():
            far = from_the_plant(scene / "images" / f"{name}.jpg", picture.shape[1::-1])
            changed = deltaE_ciede2000(picture, found["network alone"][name])
            rings = [far == 0, *((far > a) & (far <= b) for a, b in AROUND)]
            for change, ring in zip(changes, rings):
                change.append(changed[ring].mean())
        print(f"| {way} | " + " | ".join(f"{np.mean(change):.1f}" for change in changes) + " |")


if __name__ == "__main__":
    main()
