#!/usr/bin/env python3
"""What setting a wrong color right takes: strokes, clicks and seconds on the page, and what changes.

    cargo build --release && python3 tools/check_painting.py -o target/painting [fern garden film]

Three scenes that a real network (places-resnet18 below DATA) colors wrongly: the fern of fern-llff,
the pumpkins of the bundled garden, and the fox in a gray, flickering film of the photos in DATA/fox.
Each is fitted as a draft, colored by the network, and by the true colors as reference; strokes are
drawn on one photo by tools/viewers/strokes.mjs, 2 s for a color, 1.5 s for a stroke, in the mean
true color beneath them, and saved. The table has seconds until all has settled, and the mean
CIEDE2000 of exported pictures, in outlines by hand, in the painted photo and two others: of the
thing before and after to the reference, and what has changed in things beside it and around it, by
distance in pixels of the photo. Needs numpy, Pillow, scikit-image, scipy, Node and Chromium; the
film COLMAP and ffmpeg.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import subprocess
import sys
from dataclasses import dataclass, field
from pathlib import Path

import check_strokes
import lab
import numpy as np
from PIL import Image, ImageDraw
from scipy.ndimage import distance_transform_edt
from skimage.color import deltaE_ciede2000

TOOLS = Path(__file__).parent
FRAMES = 23
FRAME_SIZE = (360, 640)


RINGS = [(3, 6), (6, 12), (12, 24)]
Points = list[tuple[int, int]]


@dataclass
class Scene:
    """Places in pixels of photos of a size; strokes are on one photo, all of one thing."""

    size: tuple[int, int]
    painted: str
    brush: int
    strokes: list[Points]
    # Outlines by photo: of the thing, and of what is beside it.
    thing: dict[str, list[Points]]
    beside: dict[str, dict[str, Points]]
    # Strokes that keep the network's colors, once a color has gone too far.
    keeps: list[Points] = field(default_factory=list)
    # Outlines by photo from which on others begin, where these are not those of the thing.
    whole: dict[str, list[Points]] = field(default_factory=dict)
    fit: list[str] = field(default_factory=list)


def fern() -> Scene:
    outlines = check_strokes.OUTLINES
    beside = ["planter", "wall", "floor"]
    return Scene(
        check_strokes.SIZE,
        check_strokes.PAINTED,
        check_strokes.BRUSH,
        [
            [(165, 232), (225, 212), (275, 228)],
            [(390, 360), (430, 130)],
            [(480, 290), (600, 282)],
            [(330, 365), (250, 385), (195, 450)],
            [(540, 370), (640, 385), (700, 430)],
            check_strokes.STROKES["trunk"],
        ],
        {name: [things["fern"], things["trunk"]] for name, things in outlines.items()},
        {name: {thing: things[thing] for thing in beside} for name, things in outlines.items()},
        fit=["--max-side", "400", "--max-splats", "20000"],
    )


SCENES = {
    "fern": fern(),
    "garden": Scene(
        (324, 216),
        "garden_02",
        5,
        [[(190, 190), (250, 192)], [(266, 194), (306, 194)], [(84, 74), (114, 74)]],
        {
            "garden_02": [
                [(186, 183), (200, 169), (218, 166), (240, 169), (252, 181), (254, 200), (243, 214), (198, 214), (186, 200)],
                [(263, 190), (273, 179), (300, 179), (312, 192), (308, 207), (290, 213), (270, 207)],
                [(81, 73), (88, 63), (108, 63), (116, 73), (111, 85), (87, 85)],
            ],
            "garden_05": [
                [(251, 142), (260, 130), (277, 126), (296, 130), (306, 145), (305, 158), (295, 166), (265, 167), (252, 157)],
                [(61, 85), (70, 72), (95, 72), (104, 85), (97, 98), (68, 98)],
            ],
            "garden_08": [
                [(240, 176), (250, 164), (268, 158), (286, 162), (297, 174), (296, 192), (284, 205), (252, 205), (240, 194)],
                [(55, 88), (64, 73), (90, 73), (98, 86), (91, 100), (62, 100)],
            ],
        },
        {
            "garden_02": {"table": [(45, 104), (90, 91), (95, 104)], "grass": [(85, 145), (170, 150), (175, 200), (85, 200)]},
            "garden_05": {"table": [(55, 103), (98, 103), (140, 122), (98, 134)], "grass": [(196, 152), (237, 152), (237, 193), (200, 190)]},
            "garden_08": {"table": [(55, 110), (105, 110), (118, 145), (55, 155)], "grass": [(155, 180), (225, 165), (228, 197), (160, 205)]},
        },
    ),
    "film": Scene(
        FRAME_SIZE,
        "000011",
        11,
        [[(112, 140), (130, 200), (180, 205), (235, 200), (248, 140)], [(182, 215), (182, 268)], [(247, 275), (243, 330)], [(145, 350), (205, 350), (195, 400)]],
        {
            "000004": [[(215, 100), (250, 130), (300, 135), (285, 170), (275, 210), (255, 250), (190, 230), (150, 240), (140, 300), (125, 360), (112, 330), (120, 260), (150, 190), (190, 150)], [(190, 270), (250, 285), (240, 340), (190, 380), (170, 370), (172, 320)]],
            "000011": [[(95, 120), (130, 165), (182, 168), (225, 160), (258, 105), (250, 200), (240, 250), (195, 270), (165, 265), (120, 245), (100, 200)], [(135, 335), (215, 335), (215, 400), (190, 415), (145, 390)]],
            "000017": [[(95, 165), (130, 195), (180, 180), (215, 120), (240, 150), (240, 200), (250, 260), (262, 310), (240, 330), (190, 300), (130, 290), (110, 270), (115, 220)], [(150, 360), (220, 350), (250, 420), (240, 450), (200, 455), (155, 420)]],
        },
        {
            "000004": {"shield": [(80, 320), (104, 330), (106, 400), (85, 400)]},
            "000011": {"shield": [(90, 290), (106, 300), (106, 400), (90, 390)]},
            "000017": {"shield": [(282, 290), (310, 295), (312, 400), (296, 420)]},
        },
        keeps=[[(280, 150), (278, 250)]],
        whole={
            "000004": [[(200, 130), (205, 85), (235, 42), (258, 60), (262, 130), (300, 135), (335, 108), (322, 170), (357, 255), (345, 285), (280, 285), (235, 380), (160, 457), (110, 425), (68, 395), (68, 230), (110, 215), (140, 235), (150, 180)]],
            "000011": [[(75, 80), (120, 125), (135, 160), (225, 155), (262, 83), (272, 110), (262, 190), (262, 250), (268, 270), (266, 400), (230, 440), (178, 468), (130, 442), (84, 405), (81, 268), (92, 240), (88, 150)]],
            "000017": [[(78, 143), (130, 170), (185, 155), (222, 100), (242, 140), (242, 200), (255, 270), (312, 283), (322, 410), (290, 482), (222, 520), (170, 470), (145, 430), (140, 360), (95, 347), (86, 320), (108, 270), (106, 200)]],
        },
    ),
}


def outlined(outlines: list[Points], size: tuple[int, int], scene: Scene) -> np.ndarray:
    """Pixels of a picture inside of outlines."""
    mask = Image.new("L", scene.size)
    for points in outlines:
        ImageDraw.Draw(mask).polygon(points, fill=255)
    return np.asarray(mask.resize(size, Image.Resampling.BOX)) > 127


def color_beneath(photo: Path, points: Points, scene: Scene) -> list[float]:
    """The mean true color under a stroke, in CIELAB, as a person reads it off: in steps of 2."""
    mask = Image.new("L", scene.size)
    ImageDraw.Draw(mask).line(points, fill=255, width=scene.brush)
    picture = Image.open(photo).convert("RGB").resize(scene.size, Image.Resampling.BOX)
    under = lab.rgb_to_lab(np.asarray(picture) / 255)[np.asarray(mask) > 0]
    return [float(2 * round(value / 2)) for value in under.mean(axis=0)]


def film(data: Path, out: Path) -> tuple[Path, Path]:
    """A film of the fox's first photos with its poses, and the photos named like its frames."""
    truth, house = out / "truth", out / "house"
    truth.mkdir(parents=True, exist_ok=True)
    for k, photo in enumerate(sorted((data / "fox/images").iterdir())[:FRAMES]):
        Image.open(photo).resize(FRAME_SIZE, Image.Resampling.BOX).save(truth / f"{k + 1:06}.png")
    if not (house / "sparse").is_dir():
        make = [sys.executable, str(TOOLS / "make_film.py"), "--photos", str(truth), "--silent"]
        subprocess.run([*make, "-o", str(out / "film.mp4")], check=True)
        run("prepare", out / "film.mp4", "-o", house, "--per-second", 5)
    return house, truth


def run(*words) -> None:
    subprocess.run([PROGRAM, *map(str, words)], check=True)


def pictures(folder: Path, scene: Scene) -> dict[str, np.ndarray]:
    """The exported pictures of a run in CIELAB."""
    run("render", folder, "--views", "all", "-o", folder / "views")
    paths = {name: next((folder / "views").glob(f"{name}*.png")) for name in scene.thing}
    return {name: lab.rgb_to_lab(np.asarray(Image.open(path).convert("RGB")) / 255) for name, path in paths.items()}


def paint(folder: Path, scene: Scene, truth: Path) -> dict:
    """Paints on a run by the mouse, and saves; what the script says."""
    photo = next(truth.glob(f"{scene.painted}.*"))
    shares = lambda points: [[x / scene.size[0], y / scene.size[1]] for x, y in points]
    strokes = [
        {"photo": scene.painted, "size": scene.brush, "points": shares(points), "lab": color_beneath(photo, points, scene)}
        for points in scene.strokes
    ]
    strokes += [{"photo": scene.painted, "size": scene.brush, "points": shares(points)} for points in scene.keeps]
    listed = folder / "strokes.json"
    listed.write_text(json.dumps(strokes))
    server = subprocess.Popen(
        [PROGRAM, "view", str(folder), "--paint", "--no-open"], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    )
    try:
        url = next(line.split()[0] for line in server.stdout if line.startswith("http"))
        script = ["node", str(TOOLS / "viewers/strokes.mjs"), url, str(listed), "--out", str(folder / "page.png")]
        return json.loads(subprocess.run(script, check=True, stdout=subprocess.PIPE).stdout)
    finally:
        server.terminate()
        server.wait()


def delta(a: dict, b: dict, regions: dict[str, np.ndarray]) -> float:
    """Mean CIEDE2000 between pictures in a region of each, all pixels alike."""
    return float(np.concatenate([deltaE_ciede2000(a[name][mask], b[name][mask]) for name, mask in regions.items()]).mean())


def rings(name: str, scene: Scene, size: tuple[int, int], photos: Path, kind: str) -> list[np.ndarray]:
    """Pixels around the thing by distance."""
    if kind == "fern":
        far = check_strokes.from_the_plant(photos / f"{name}.jpg", size)
    else:
        far = distance_transform_edt(~outlined((scene.whole or scene.thing)[name], size, scene)) * scene.size[0] / size[0]
    return [(far > a) & (far <= b) for a, b in RINGS]


def measured(kind: str, args: argparse.Namespace) -> list[str]:
    """A row of the table."""
    scene, out = SCENES[kind], args.out / kind
    if kind == "film":
        source, truth = film(args.data, out)
    else:
        source = args.data / "fern-llff" if kind == "fern" else TOOLS.parent / "assets/demo"
        truth = source / "images"
    fitted = out / "fitted"
    if not (fitted / "luma.ply").is_file():
        run("fit", source, "-o", fitted, "--preset", "draft", *scene.fit)
    found = {}
    for way, teacher in (("reference", truth), ("before", args.network)):
        folder = out / way
        if not (folder / "color.ply").is_file():
            shutil.copytree(fitted, folder, dirs_exist_ok=True)
            run("colorize", folder, "--teacher", teacher)
        found[way] = pictures(folder, scene)
    shutil.rmtree(out / "after", ignore_errors=True)
    shutil.copytree(out / "before", out / "after")
    said = paint(out / "after", scene, truth)
    found["after"] = pictures(out / "after", scene)
    size = found["after"][scene.painted].shape[1::-1]
    inside = {name: outlined(outlines, size, scene) for name, outlines in scene.thing.items()}
    row = [kind, said["strokes"], said["clicks"], f"{said['painted_s']:.0f}", f"{said['settled_s']:.0f}"]
    row += [f"{delta(found[way], found['reference'], inside):.1f}" for way in ("before", "after")]
    beside = []
    for thing in scene.beside[scene.painted]:
        masks = {name: outlined([things[thing]], size, scene) for name, things in scene.beside.items()}
        beside.append(f"{thing} {delta(found['after'], found['before'], masks):.1f}")
    row.append(", ".join(beside))
    around = {name: rings(name, scene, size, truth, kind) for name in scene.thing}
    for k in range(len(RINGS)):
        changed = delta(found["after"], found["before"], {name: masks[k] for name, masks in around.items()})
        row.append(f"{changed:.1f}")
    return [str(value) for value in row]


def main() -> None:
    global PROGRAM
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("scenes", nargs="*", choices=list(SCENES))
    parser.add_argument("--program", default="target/release/gs-chroma")
    parser.add_argument("--data", type=Path, default=Path(os.environ.get("SCENES", "scenes")))
    parser.add_argument("--network", type=Path, help="default: places-resnet18 below DATA")
    parser.add_argument("-o", "--out", type=Path, default=Path("target/painting"))
    args = parser.parse_args()
    PROGRAM = args.program
    args.network = args.network or args.data / "teacher-places/places-resnet18.onnx"
    if not args.network.is_file():
        print(f"{args.network} is not there: skipped")
        return
    rows = [measured(kind, args) for kind in args.scenes or SCENES]
    heads = ["scene", "strokes", "clicks", "s, drawn", "s, settled", "ΔE00 before", "after", "beside"]
    heads += [f"{a}–{b} px" for a, b in RINGS]
    for row in (heads, ["---"] * len(heads), *rows):
        print("| " + " | ".join(row) + " |")


if __name__ == "__main__":
    main()
