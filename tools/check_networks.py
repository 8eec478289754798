#!/usr/bin/env python3
"""Colors scenes by a real network, measures them, and prints Markdown tables with bounds.

    cargo build --release && python3 tools/check_networks.py -o target/networks

The bundled scene and those below DATA (default $SCENES or scenes), each fitted once and not again
while its run is there, colored by the network in DATA/teacher-places or by `--teacher FILE.onnx`.
What is not there is skipped with a word. `--svg FILE` draws the loss after every round, `--rounds`
compares fewer and more rounds than by default, as pictures of all views. Beside each run lie its
contact sheet and eval/index.html, to be looked at. Needs numpy, Pillow, scikit-image, matplotlib.
"""

from __future__ import annotations

import argparse
import csv
import json
import os
import shlex
import shutil
import sys
from pathlib import Path

import numpy as np
from check_color import bounded, by_method, judged, line, ratio, run
from PIL import Image
from skimage.color import deltaE_ciede2000, rgb2lab

ROOT = Path(__file__).parent.parent
BUNDLED = ROOT / "assets" / "demo"
SCENES = ["fern-llff", "brighton-drone", "caliterra-drone"]

# Bounds, as printed in the head of the table.
AGREEMENT = 0.25
TO_PER_FRAME = 0.25
COLORFULNESS = 0.05
NEAR = 0.1
BAKE = (1.0, 3.0)

HEAD = [
    "scene",
    "views agree, ours / teacher (≤ 0.25)",
    "path / per frame: Δ = 1",
    "10",
    "30 (≤ 0.25)",
    "colorfulness, ours / teacher's (± 5 %)",
    "held-out a/b error, ours / teacher's",
    "bake mean, 95 % (≤ 1, ≤ 3)",
    "rounds",
    "seconds: teacher, solving, bake, measuring",
]
ROUNDS = [2, 48]
ROUNDS_HEAD = ["scene", "rounds", "last moved colors by", "loss"]
ROUNDS_HEAD += ["ΔE00 to the most rounds, mean of all views", "held-out ΔE00"]


def fitted(program: str, scene: Path, out: Path, flags: list[str]) -> None:
    """Fits a scene, unless that was done before."""
    if not (out / "luma.ply").is_file():
        run([program, "fit", str(scene), "-o", str(out), *flags])


def row(scene: str, found: dict, chroma: dict) -> list[str]:
    """A row of the first table, of the exported file."""
    pictures = by_method(found["pictures"])
    ours, teacher = pictures["exported"], pictures["teacher"]
    between = by_method(found["between"]["consistency"])
    cells = [scene, bounded(ratio(between["exported"], between["teacher"], "error"), AGREEMENT)]
    for delta in (1, 10, 30):
        there = by_method([c for c in found["path"]["consistency"] if c["delta"] == delta])
        value = ratio(there.get("exported"), there.get("per_frame"), "error")
        cells.append(bounded(value, TO_PER_FRAME) if delta == 30 else judged(value, True))
    colorful = ours["colorfulness"] / teacher["colorfulness"]
    cells.append(
        f"{ours['colorfulness']:.1f} / {teacher['colorfulness']:.1f},"
        f" {judged(colorful, abs(colorful - 1) <= COLORFULNESS, 2)}"
    )
    cells.append(f"{ours['ab_error']:.2f} / {teacher['ab_error']:.2f}")
    bake = found["bake"]
    cells.append(
        f"{judged(bake['mean'], bake['mean'] <= BAKE[0], 2)},"
        f" {judged(bake['percentile_95'], bake['percentile_95'] <= BAKE[1], 2)}"
    )
    cells.append(str(chroma["iterations"]))
    seconds = chroma["seconds"]
    cells.append(", ".join(f"{seconds[k]:.1f}" for k in ("teacher", "distill", "bake", "measure")))
    return cells


def losses(run_folder: Path) -> list[float]:
    """The loss of each round of `colorize`, as its log has it."""
    report = json.loads((run_folder / "report.json").read_text())
    last = report["luma"]["iterations"]
    with (run_folder / "log.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    return [float(r["loss"]) for r in rows if int(r["iteration"]) > last]


def pictures(program: str, run_folder: Path, out: Path, flags: list[str]) -> dict[str, np.ndarray]:
    """CIELAB pictures of all views, by name."""
    run([program, "render", str(run_folder), "--views", "all", "-o", str(out), *flags])
    return {
        p.name: rgb2lab(np.asarray(Image.open(p).convert("RGB"), np.float64) / 255)
        for p in sorted(out.glob("*.png"))
    }


def far(one: dict[str, np.ndarray], other: dict[str, np.ndarray]) -> float:
    """Mean color difference over all pixels of all views."""
    each = [deltaE_ciede2000(one[name], other[name]).mean() for name in one]
    return float(np.mean(each))


def compare_rounds(program: str, scene: str, out: Path, teacher: str, flags: list[str]) -> None:
    """Rows of the second table: gray, few rounds, as many as by default, many rounds."""
    found = {"gray": (pictures(program, out / "run", out / "gray", ["--luma"]), None)}
    for rounds in [ROUNDS[0], None, ROUNDS[1]]:
        copy = out / f"rounds-{rounds or 'default'}"
        shutil.rmtree(copy, ignore_errors=True)
        copy.mkdir()
        for name in ("luma.ply", "report.json", "log.csv"):
            shutil.copy(out / "run" / name, copy)
        limit = ["--rounds", str(rounds)] if rounds else []
        asked = [program, "colorize", str(copy), "--teacher", teacher, *limit, *flags, "--json"]
        chroma = json.loads(run(asked)[0])["chroma"]
        name = f"{chroma['iterations']}{'' if rounds else ' (default)'}"
        found[name] = (pictures(program, copy, copy / "views", []), chroma)
    most, _ = list(found.values())[-1]
    for name, (views, chroma) in found.items():
        apart = far(views, most)
        cells = [scene, name]
        if chroma is None:
            cells += ["", ""]
        else:
            cells += [f"{chroma['moved']:.2f}", f"{chroma['loss']:.4f}"]
        cells.append(judged(apart, apart <= NEAR or "default" not in name))
        cells.append("" if chroma is None else f"{chroma['pictures']['delta_e']['mean']:.2f}")
        line(cells)


def draw(curves: dict[str, list[float]], path: Path) -> None:
    """The loss of every round, a curve for each scene."""
    import matplotlib

    matplotlib.use("Agg")
    matplotlib.rcParams.update({"svg.fonttype": "none", "svg.hashsalt": "gs-chroma", "font.size": 9})
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(figsize=(5.5, 3.2), layout="constrained")
    for scene, curve in curves.items():
        axes.plot(range(1, len(curve) + 1), curve, marker="o", markersize=3, label=scene)
    axes.set(xlabel="round", ylabel="loss, CIELAB units", yscale="log")
    axes.set_yticks([0.4, 0.6, 1, 2, 4], labels=["0.4", "0.6", "1", "2", "4"])
    axes.minorticks_off()
    axes.grid(alpha=0.3, which="both")
    axes.legend(frameon=False)
    figure.savefig(path, metadata={"Date": None})


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-o", "--output", type=Path, default=Path("target/networks"))
    parser.add_argument("--data", type=Path, default=Path(os.environ.get("SCENES", "scenes")))
    parser.add_argument("--program", default="target/release/gs-chroma")
    parser.add_argument("--teacher", type=Path, help="[default: the network in DATA/teacher-places]")
    parser.add_argument("--fit", default="--preset draft --max-side 320 --seed 0", help="flags, as one word")
    parser.add_argument("--colorize", default="", help="more flags for colorize, as one word")
    parser.add_argument("--frames", type=int, default=60)
    parser.add_argument("--scenes", nargs="*", default=[BUNDLED.name, *SCENES])
    parser.add_argument("--rounds", action="store_true", help="print the second table instead")
    parser.add_argument("--svg", type=Path, help="where to draw the loss after every round")
    arguments = parser.parse_args()
    program, flags = arguments.program, shlex.split(arguments.colorize)
    teacher = arguments.teacher or arguments.data / "teacher-places" / "places-resnet18.onnx"
    if not teacher.is_file():
        print(f"{teacher} is not there: skipped", file=sys.stderr)
        return 0
    head = ROUNDS_HEAD if arguments.rounds else HEAD
    line(head)
    line(["---"] * len(head))
    curves = {}
    for scene in arguments.scenes:
        folder = BUNDLED if scene == BUNDLED.name else arguments.data / scene
        if not folder.is_dir():
            print(f"{folder} is not there: skipped", file=sys.stderr)
            continue
        out = arguments.output / scene
        fitted(program, folder, out / "run", shlex.split(arguments.fit))
        if arguments.rounds:
            compare_rounds(program, scene, out, str(teacher), flags)
            continue
        asked = [str(out / "run"), "--teacher", str(teacher)]
        chroma = json.loads(run([program, "colorize", *asked, *flags, "--json"])[0])["chroma"]
        measure = ["--baselines", "--frames", str(arguments.frames), "--json"]
        found = json.loads(run([program, "eval", *asked, *measure])[0])
        curves[scene] = losses(out / "run")
        line(row(scene, found, chroma))
    if arguments.svg and curves:
        draw(curves, arguments.svg)
    return 0


if __name__ == "__main__":
    sys.exit(main())
