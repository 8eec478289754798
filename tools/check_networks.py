#!/usr/bin/env python3
"""Colors scenes by a real network, measures them, and prints Markdown tables with bounds.

    cargo build --release && python3 tools/check_networks.py -o target/networks

The bundled scene and those below DATA (default $SCENES or scenes), each fitted once and not again
while its run is there, colored by the network in DATA/teacher-places or by `--teacher FILE.onnx`.
What is not there is skipped with a word. `--svg FILE` draws the loss after every round, `--stage-2`
compares fewer and more rounds than by default, SH degrees, sizes of the network's input and solvers,
as pictures of all views. Beside each run lie its contact sheet and eval/index.html, to be looked at.
Needs numpy, Pillow, scikit-image, matplotlib.
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
# Options of `colorize` that are compared; sizes are those of a network that sees 224 pixels. The
# first has the most rounds.
STAGE_2 = {
    "48 rounds at most": "--rounds 48",
    "default": "",
    "6 rounds": "--rounds 6",
    "3 rounds": "--rounds 3",
    "1 round": "--rounds 1",
    "SH degree 1": "--sh-degree 1",
    "SH degree 2": "--sh-degree 2",
    "teacher at 112 px": "--teacher-size 112",
    "teacher at 336 px": "--teacher-size 336",
    "Adam, as the paper": "--solver adam",
}
STAGE_2_HEAD = ["scene", "`colorize`", "rounds", "seconds: all, teacher, solving, bake", "loss"]
STAGE_2_HEAD += ["views agree, ours / teacher", "colorfulness", "ΔE00 to the most rounds, mean of all views"]
STAGE_2_HEAD += ["held-out ΔE00"]


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


def compare(program: str, scene: str, out: Path, teacher: str, flags: list[str]) -> None:
    """Rows of the second table: gray, and every way to color."""
    most = None
    for place, (name, options) in enumerate(STAGE_2.items()):
        copy = out / f"stage-2-{place}"
        shutil.rmtree(copy, ignore_errors=True)
        copy.mkdir()
        for file in ("luma.ply", "report.json", "log.csv"):
            shutil.copy(out / "run" / file, copy)
        asked = [program, "colorize", str(copy), "--teacher", teacher, *shlex.split(options), *flags]
        chroma = json.loads(run([*asked, "--json"])[0])["chroma"]
        asked = [program, "eval", str(copy), "--teacher", teacher, "--frames", "2", "--json"]
        between = by_method(json.loads(run(asked)[0])["between"]["consistency"])
        views = pictures(program, copy, copy / "views", [])
        most = most or views
        apart, seconds = far(views, most), chroma["seconds"]
        parts = [seconds["teacher"], seconds["distill"], seconds["bake"]]
        found = chroma["pictures"]
        cells = [scene, name, str(chroma["iterations"])]
        cells.append(f"{sum(parts):.1f}: " + ", ".join(f"{part:.1f}" for part in parts))
        cells += [f"{chroma['loss']:.4f}", judged(ratio(between["exported"], between["teacher"], "error"), True)]
        cells += [f"{found['colorfulness']:.1f}", judged(apart, apart <= NEAR or name != "default")]
        line([*cells, f"{found['delta_e']['mean']:.2f}"])
    gray = pictures(program, out / "run", out / "gray", ["--luma"])
    line([scene, "gray", *[""] * 5, judged(far(gray, most), True), ""])


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
    parser.add_argument("--stage-2", action="store_true", help="print the second table instead")
    parser.add_argument("--svg", type=Path, help="where to draw the loss after every round")
    arguments = parser.parse_args()
    program, flags = arguments.program, shlex.split(arguments.colorize)
    teacher = arguments.teacher or arguments.data / "teacher-places" / "places-resnet18.onnx"
    if not teacher.is_file():
        print(f"{teacher} is not there: skipped", file=sys.stderr)
        return 0
    head = STAGE_2_HEAD if arguments.stage_2 else HEAD
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
        if arguments.stage_2:
            compare(program, scene, out, str(teacher), flags)
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
