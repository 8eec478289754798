#!/usr/bin/env python3
"""Runs `info` and `plan` on scenes that contradict themselves and on sound ones, and other
commands on files and names that are easily mistaken, and prints what was said of each as
Markdown.

    cargo build --release && python3 tools/check_soundness.py CASES [--sound SCENES]

CASES holds `_base`, a sound COLMAP folder with a text model, and cases beside it, each a folder
that is spoilt in one way. What is one edit away from `_base` is made from it in a temporary
folder; cases whose photos are changed need Pillow. SCENES holds sound COLMAP folders. What is
missing is skipped.
"""

from __future__ import annotations

import argparse
import json
import shutil
import subprocess
import sys
import tempfile
import unicodedata
from collections.abc import Callable
from pathlib import Path

# Folders of CASES that are scenes.
FOLDERS = [
    "_base",
    "model-contradicts-itself/camera-to-world",
    "observations-at-other-scale/scene",
    "photos-of-another-model/turned",
    "most-photos-unused/scene",
    "thumbnail-first/scene",
    "alpha-ignored/scene",
]
# Cameras files of CASES to be put into `_base`.
CAMERAS = [f"unused-camera/{name}" for name in ("diverged", "zero-focal", "unknown-model")]


def intrinsics(edit: Callable[[list[float]], list[float]]) -> Callable[[Path], None]:
    """Changes fx, fy, cx, cy of every camera."""

    def spoil(scene: Path) -> None:
        path = scene / "sparse/0/cameras.txt"
        lines = []
        for line in path.read_text().splitlines():
            if not line.startswith("#"):
                fields = line.split()
                values = edit([float(value) for value in fields[4:]])
                line = " ".join(fields[:4] + [repr(value) for value in values])
            lines.append(line)
        path.write_text("\n".join(lines) + "\n")

    return spoil


def open_gl(scene: Path) -> None:
    """Turns y and z of every camera around."""
    path = scene / "sparse/0/images.txt"
    lines, image = [], True
    for line in path.read_text().splitlines():
        if line.startswith("#"):
            lines.append(line)
            continue
        if image:
            fields = line.split()
            w, x, y, z, tx, ty, tz = map(float, fields[1:8])
            # Half a turn about x, then the pose.
            pose = (-x, w, -z, y, tx, -ty, -tz)
            line = " ".join([fields[0], *map(repr, pose), *fields[8:]])
        image = not image
        lines.append(line)
    path.write_text("\n".join(lines) + "\n")


def photos(edit: Callable) -> Callable[[Path], None]:
    """Changes every photo."""

    def spoil(scene: Path) -> None:
        from PIL import Image

        for path in sorted((scene / "images").iterdir()):
            with Image.open(path) as photo:
                changed = edit(photo.copy())
            changed.save(path, quality=95)

    return spoil


def cropped(share: float) -> Callable[[Path], None]:
    """Cuts a share of each side's length away and enlarges what is left."""

    def edit(photo):
        width, height = photo.size
        dx, dy = round(width * share / 2), round(height * share / 2)
        return photo.crop((dx, dy, width - dx, height - dy)).resize((width, height))

    return photos(edit)


def mirrored(photo):
    return photo.transpose(0)


def renumbered(scene: Path) -> None:
    """Gives each photo the next one's name."""
    paths = sorted((scene / "images").iterdir())
    contents = [path.read_bytes() for path in paths]
    for path, content in zip(paths, contents[1:] + contents[:1]):
        path.write_bytes(content)


def one_turned(scene: Path) -> None:
    from PIL import Image

    path = sorted((scene / "images").iterdir())[5]
    with Image.open(path) as photo:
        turned = photo.rotate(180)
    turned.save(path, quality=95)


def untracked(scene: Path) -> None:
    """Removes all observations."""
    path = scene / "sparse/0/points3D.txt"
    lines = [line if line.startswith("#") else " ".join(line.split()[:8]) for line in path.read_text().splitlines()]
    path.write_text("\n".join(lines) + "\n")


def composed_names(cases: Path) -> Callable[[Path], None]:
    """Composed names in the model, decomposed ones on the disk."""

    def spoil(scene: Path) -> None:
        model = cases / "names/nfc-images.txt"
        shutil.copy(model, scene / "sparse/0/images.txt")
        names = [line.split()[-1] for line in model.read_text().splitlines() if line.endswith(".jpg")]
        for name in names:
            photo = scene / "images" / name[name.index("garden") :]
            photo.rename(photo.with_name(unicodedata.normalize("NFD", name)))

    return spoil


def with_files(cases: Path) -> dict[str, Callable[[Path], object]]:
    """Scenes that get a file of CASES."""

    def first_photo(name: str) -> Callable[[Path], object]:
        return lambda scene: shutil.copy(cases / "messages" / name, scene / "images/garden_00.jpg")

    return {
        "masks-partly-found": lambda scene: shutil.copytree(cases / "masks-partly-found/masks", scene / "masks"),
        "names: composed and decomposed": composed_names(cases),
        "names: byte order mark": lambda scene: shutil.copy(
            cases / "names/bom-cameras.txt", scene / "sparse/0/cameras.txt"
        ),
        "messages: 12-bit JPEG": first_photo("twelve-bits.jpg"),
        "messages: BigTIFF": first_photo("big.tif"),
    }


# Of each case its commands; those before the last prepare it. CASES and OUT stand for folders.
DRAFT = "--preset draft --iterations 60 --max-splats 3000"
COMMANDS = {
    "ply-infinite-opacity": ["info CASES/ply-infinite-opacity/opaque.ply"],
    "ply-of-others: two scales": ["info CASES/ply-of-others/two-scales.ply"],
    "ply-of-others: colors of 8 bits": ["info CASES/ply-of-others/uchar-colours.ply"],
    "ply-of-others: count too small": ["info CASES/ply-of-others/count-too-small.ply"],
    "messages: points as --init": [f"fit CASES/_base {DRAFT} --init CASES/messages/points.ply -o OUT/points"],
    "ply-of-another-frame: render": [
        "render CASES/ply-of-another-frame/turned-and-scaled.ply --colmap CASES/_base -o OUT/frame"
    ],
    "ply-of-another-frame: fit --init": [
        f"fit CASES/_base {DRAFT} --init CASES/ply-of-another-frame/turned-and-scaled.ply -o OUT/init"
    ],
    "render-overwrites": [
        f"fit CASES/render-overwrites/scene {DRAFT} -o OUT/shots",
        "render OUT/shots --views all -o OUT/shot-pictures",
    ],
    "teacher-same-stem: 7 painted": ["colorize OUT/shots --rounds 1 --teacher CASES/teacher-same-stem/painted"],
    "teacher-same-stem: all photos": ["colorize OUT/shots --rounds 1 --teacher CASES/render-overwrites/scene/images"],
    "export-georeferenced": [
        f"fit CASES/export-georeferenced/scene {DRAFT} -o OUT/utm",
        "export OUT/utm -o OUT/utm.ply",
        "render OUT/utm.ply --colmap CASES/export-georeferenced/scene -o OUT/utm-pictures",
    ],
    "export-georeferenced: COLMAP's": ["export OUT/utm --colmap-coordinates -o OUT/coarse.ply"],
    "half-float-ply": ["info CASES/half-float-ply/half.ply"],
    "ply-filter-3d": ["render CASES/ply-filter-3d/filter3d.ply --colmap CASES/_base --views test -o OUT/filtered"],
    "spz-axes-extension": ["render CASES/spz-axes-extension/rub.spz --colmap CASES/_base --views test -o OUT/rub"],
    "other-splat-formats: .lcc": ["info CASES/other-splat-formats/a.lcc"],
    "other-splat-formats: .rad": ["export CASES/other-splat-formats/a.rad -o OUT/a.ply"],
    "other-splat-formats: lod-meta.json": ["render CASES/other-splat-formats/lod-meta.json -o OUT/lod"],
    "other-splat-formats: missing file": ["info CASES/other-splat-formats/nothere.ply"],
    "rig-poses-stale: half a degree": ["info CASES/rig-poses-stale/half-degree"],
    "external-weights-cache": [
        f"fit CASES/_base {DRAFT} -o OUT/base",
        "colorize OUT/base --rounds 1 --teacher CASES/external-weights-cache/a/net.onnx",
        "colorize OUT/base --rounds 1 --teacher CASES/external-weights-cache/b/net.onnx",
    ],
    "teacher-ab-unit-range": ["colorize OUT/base --rounds 1 --teacher CASES/teacher-ab-unit-range/gan.onnx"],
    "colored-images-in-wide-gamut: sRGB": [
        "colorize OUT/base --rounds 2 --teacher CASES/colored-images-in-wide-gamut/srgb"
    ],
    "colored-images-in-wide-gamut: Adobe RGB": [
        "colorize OUT/base --rounds 2 --teacher CASES/colored-images-in-wide-gamut/adobe"
    ],
    "frames-other-extension": ["frames OUT/base -o OUT/colored.avi"],
    "frames-orientation": [
        f"fit CASES/frames-orientation/capture {DRAFT} -o OUT/turned",
        "colorize OUT/turned --rounds 1 --teacher assets/teacher/demo-teacher.onnx",
        "frames OUT/turned -o OUT/turned-frames",
    ],
}

# Cases of films, which need FFmpeg and COLMAP; FILM stands for the film's prepared folder.
FILMS = {
    "apac-sound": ("phone.mov", "frames OUT/film -o OUT/out.mp4"),
    "sound-before-pictures": ("late.mkv", "frames OUT/film -o OUT/out.mp4"),
    "frames-other-rate": ("../sound-before-pictures/late.mkv", "frames OUT/film -o OUT/out.mp4 --fps 10"),
    "hdr-film": ("pq.mp4", None),
    "mpegts-first-frames: .mts": ("camcorder.mts", None),
    "mpegts-first-frames: .ts": ("recording.ts", None),
    "film-360": ("pano360.mp4", None),
}
for _name, (_film, _frames) in FILMS.items():
    _folder = f"OUT/{_name.replace(': .', '-')}"
    _commands = [f"prepare CASES/{_name.split(':')[0]}/{_film} -o {_folder}"]
    if _frames:
        _commands += [
            f"fit {_folder} {DRAFT} -o OUT/film",
            "colorize OUT/film --rounds 1 --teacher assets/teacher/demo-teacher.onnx",
            _frames,
        ]
    COMMANDS[_name] = _commands


def both(*edits: Callable[[Path], None]) -> Callable[[Path], None]:
    def spoil(scene: Path) -> None:
        for edit in edits:
            edit(scene)

    return spoil


EDITS = {
    "OpenGL axes": open_gl,
    "intrinsics × 4": intrinsics(lambda values: [4 * value for value in values]),
    "focal length × 1.5": intrinsics(lambda v: [1.5 * v[0], 1.5 * v[1], v[2], v[3]]),
    "principal point 0, 0": intrinsics(lambda v: [v[0], v[1], 0.0, 0.0]),
    "photos mirrored": photos(mirrored),
    "photos renumbered": renumbered,
    "photos cropped by 1 %": cropped(0.012),
    "photos cropped by 10 %": cropped(0.1),
    "photos cropped by 25 %": cropped(0.25),
    "one photo turned": one_turned,
    "photos a third as large": photos(lambda photo: photo.resize([side // 3 for side in photo.size])),
    "no observations": untracked,
    "no observations, OpenGL axes": both(untracked, open_gl),
}


def said(done: subprocess.CompletedProcess[str], folder: Path) -> list[str]:
    """Errors and warnings, without the folder's own path."""
    lines = [line for line in done.stderr.splitlines() if line.startswith(("error: ", "warning: "))]
    return [line.replace(f"{folder}/", "").replace(str(folder), "scene") for line in lines]


def number(value: float | None) -> str:
    return "–" if value is None else f"{value:.2f}"


def row(program: str, name: str, folder: Path) -> str:
    """What was said of a scene."""
    info = subprocess.run([program, "info", folder, "--json"], capture_output=True, text=True)
    command = [program, "plan", folder, "--json", "--preset", "draft", "--with", "exposure"]
    plan = subprocess.run(command, capture_output=True, text=True)
    error = json.loads(info.stdout)["reprojection_error"] if info.returncode == 0 else None
    soundness = json.loads(plan.stdout)["soundness"] if plan.returncode == 0 else {}
    lowest, median = (soundness.get(f"{which}_correlation") for which in ("lowest", "median"))
    figures = f"{number(error)} | {number(lowest)} | {number(median)}"
    outcome = "<br>".join(said(plan, folder)) or "nothing"
    return f"| {name} | {figures} | {plan.returncode} | {outcome} |"


def command_row(program: str, name: str, commands: list[str], cases: Path, out: Path) -> str:
    """What the last of some commands said; of pictures, how many there are."""
    for command in commands:
        words = [word.replace("CASES", str(cases)).replace("OUT", str(out)) for word in command.split()]
        done = subprocess.run([program, *words], capture_output=True, text=True)
    lines = [line for line in done.stderr.splitlines() if line.startswith(("error: ", "warning: "))]
    lines += [line for line in done.stdout.splitlines() if line.startswith(("wrote ", "its ", "colored ", "splats: "))]
    text = "<br>".join(lines).replace(f"{cases}/", "").replace(f"{out}/", "")
    if words[0] == "render" and Path(words[-1]).is_dir():
        text += f" ({sum(1 for _ in Path(words[-1]).rglob('*.png'))} files)"
    return f"| {name} | {done.returncode} | {text} |"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("cases", type=Path, help="folder of cases")
    parser.add_argument("--sound", type=Path, help="folder of sound scenes")
    parser.add_argument("--program", default="target/release/gs-chroma")
    arguments = parser.parse_args()
    base = arguments.cases / "_base"
    print("| scene | reprojection error, px | correlation, lowest | median | exit | `plan` says |")
    print("|---|---|---|---|---|---|")

    def show(name: str, folder: Path) -> None:
        print(row(arguments.program, name, folder), flush=True)

    def skip(name: str, why: str) -> None:
        print(f"| {name} | skipped: {why} | | | | |", flush=True)

    for scene in sorted(arguments.sound.iterdir()) if arguments.sound else []:
        if (scene / "images").is_dir():
            show(scene.name, scene)
    for name in FOLDERS:
        folder = arguments.cases / name
        show(name, folder) if folder.is_dir() else skip(name, "missing")
    with tempfile.TemporaryDirectory() as temporary:

        def make(name: str, spoil: Callable[[Path], object]) -> None:
            if not base.is_dir():
                return skip(name, "_base is missing")
            scene = Path(temporary) / "scene"
            shutil.rmtree(scene, ignore_errors=True)
            shutil.copytree(base, scene)
            try:
                spoil(scene)
            except (FileNotFoundError, ImportError) as error:
                return skip(name, str(error))
            show(name, scene)

        for name in CAMERAS:
            file = arguments.cases / name / "cameras.txt"
            make(name, lambda scene: shutil.copy(file, scene / "sparse/0/cameras.txt"))
        for name, spoil in (EDITS | with_files(arguments.cases)).items():
            make(name, spoil)
        print("\n| case | exit | what is said |\n|---|---|---|")
        for name, commands in COMMANDS.items():
            if not (arguments.cases / name.split(":")[0]).is_dir():
                print(f"| {name} | skipped: missing | |", flush=True)
                continue
            out = Path(temporary)
            print(command_row(arguments.program, name, commands, arguments.cases, out), flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
