#!/usr/bin/env python3
"""Colors real scenes by three teachers, measures them, and prints Markdown tables with bounds.

    cargo build --release && python3 tools/check_color.py -o target/color

Each scene is a COLMAP folder of color photos below DATA (default $SCENES or scenes); scenes that are
not there are skipped with a word. A scene is fitted once (and not again while its run is there),
then colored and evaluated with each teacher: the photos themselves (oracle), the photos made
unsteady by unsteady_teacher.py, and the bundled network. Needs numpy and Pillow.

`--colorize="--sh-degree 1"` hands flags to `gs-chroma colorize`, `--eval="--lpips lpips.onnx"` to `eval`.
`--ablation` prints another table:
each part of the solver off, or its degree raised, with the unsteady teacher.
"""

from __future__ import annotations

import argparse
import json
import os
import shlex
import subprocess
import sys
import time
from pathlib import Path

TOOLS = Path(__file__).parent
# Scene and cap on Gaussians, small enough for two cores.
SCENES = {"fern-llff": 20_000, "brighton-drone": 20_000, "banana-object": 20_000}
TEACHERS = ["oracle", "unsteady", "network"]
SIDE = 320

# Bounds on ratios, as printed in the head of the table.
AGREEMENT = 1 / 4
TO_RGB_SPLATS = 0.6
TO_TEACHER = 0.4
COLORFULNESS = 0.05
TO_PER_FRAME = 1 / 2
BAKE = (1.0, 3.0)

# What `--ablation` tries: a name and colorize's flags.
VARIANTS = {
    "as it is": "",
    "small answers": "",
    "small answers, guided off": "--upsample bilinear",
    "robust off": "--robust off",
    "correction off": "--correct-views off",
    "robust and correction off": "--robust off --correct-views off",
    "fill off": "--fill off",
    "8 rounds at most": "--rounds 8",
    "degree 1": "--sh-degree 1",
    "degree 2": "--sh-degree 2",
    "degree 3": "--sh-degree 3",
    "Adam, 150 iterations": "--solver adam --until {until}",
}

# Answers of this side have to be enlarged, as a network's have to be.
SMALL_SIDE = SIDE // 4

HEAD = [
    "scene",
    "teacher",
    "views agree, ours / teacher (≤ 0.25)",
    "held-out a/b error: ours",
    "/ teacher's (≤ 0.4)",
    "/ RGB splats' (≤ 0.6)",
    "colorfulness / teacher's (± 5 %)",
    "/ photos'",
    "path Δ = 30 / per frame (≤ 0.5)",
    "held-out ΔE00: ours, RGB splats",
    "bake mean, 95 % (≤ 1, ≤ 3)",
    "colorize",
]


def run(command: list[str]) -> tuple[str, float]:
    """What a command prints, and its wall seconds."""
    begun = time.monotonic()
    done = subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True)
    return done.stdout, time.monotonic() - begun


def fitted(program: str, scene: Path, out: Path, iterations: int) -> None:
    """Fits a scene, unless that was done before."""
    if not (out / "luma.ply").is_file():
        run(
            [program, "fit", str(scene), "-o", str(out), "--preset", "draft"]
            + ["--max-side", str(SIDE), "--max-splats", str(SCENES[scene.name])]
            + ["--iterations", str(iterations)]
        )


def by_method(scores: list[dict]) -> dict[str, dict]:
    """Scores by the name of their method."""
    return {score["method"]: score for score in scores}


def judged(value: float | None, good: bool, digits: int = 3) -> str:
    """A figure, bold where it misses its bound."""
    if value is None:
        return "–"
    return f"{value:.{digits}f}" if good else f"**{value:.{digits}f}**"


def ratio(ours: dict | None, other: dict | None, key: str) -> float | None:
    """Ours to another's, where both are there."""
    if not ours or not other or ours[key] is None or not other[key]:
        return None
    return ours[key] / other[key]


def bounded(value: float | None, bound: float) -> str:
    """A ratio with its bound."""
    return judged(value, value is None or value <= bound)


def row(scene: str, teacher: str, method: str, found: dict, seconds: float) -> list[str]:
    """A row of the table; `method` is `exported` or `native`."""
    pictures = by_method(found["pictures"])
    between = by_method(found["between"]["consistency"])
    far = by_method([c for c in found["path"]["consistency"] if c["delta"] == 30])
    ours = pictures[method]
    rgb = pictures.get("rgb_splats")
    cells = [scene, teacher]
    # The oracle never contradicts itself: to be as steady as it is no achievement.
    unsteady = teacher != "oracle"
    own = ratio(between.get(method), between.get("teacher"), "error")
    cells.append(bounded(own, AGREEMENT) if unsteady else judged(own, True))
    cells.append(judged(ours["ab_error"], True, 2))
    # A network's taste is not the truth; an unsteady oracle's errors are known.
    known = teacher == "unsteady"
    to_teacher = ratio(ours, pictures.get("teacher"), "ab_error") if unsteady else None
    cells.append(bounded(to_teacher, TO_TEACHER) if known else judged(to_teacher, True))
    to_rgb = ratio(ours, rgb, "ab_error")
    cells.append(bounded(to_rgb, TO_RGB_SPLATS) if known else judged(to_rgb, True))
    # Both of the held-out views, which may be less or more colorful than the others.
    colorful = ratio(ours, pictures.get("teacher"), "colorfulness")
    cells.append(judged(colorful, colorful is None or abs(colorful - 1) <= COLORFULNESS))
    # An unsteady teacher's whims are colorful too: what the scene has is in the photos.
    cells.append(judged(ratio(ours, pictures.get("photo"), "colorfulness"), True))
    cells.append(bounded(ratio(far.get(method), far.get("per_frame"), "error"), TO_PER_FRAME))
    mine = ours["delta_e"]["mean"]
    theirs = rgb["delta_e"]["mean"] if rgb else None
    no_worse = teacher != "oracle" or theirs is None or mine <= theirs
    cells.append(f"{judged(mine, no_worse, 2)}, {judged(theirs, True, 2)}")
    bake = found["bake"]
    cells.append(
        f"{judged(bake['mean'], bake['mean'] <= BAKE[0], 2)},"
        f" {judged(bake['percentile_95'], bake['percentile_95'] <= BAKE[1], 2)}"
    )
    cells.append(f"{seconds:.0f} s")
    return cells


def line(cells: list[str]) -> None:
    """A line of a Markdown table, at once: the next takes minutes."""
    print("| " + " | ".join(cells) + " |", flush=True)


def unsteady(photos: Path, out: Path, side: int, seed: int) -> Path:
    """The folder of an unsteady teacher, made if it is not there."""
    if seed:
        out = out.with_name(f"{out.name}-{seed}")
    if not out.is_dir():
        script = [sys.executable, str(TOOLS / "unsteady_teacher.py"), str(photos)]
        run([*script, "-o", str(out), "--max-side", str(side), "--seed", str(seed)])
    return out


def ablation(
    program: str, scene: str, photos: Path, out: Path, wanted: list[str], seed: int
) -> None:
    """A row for each variant (that is wanted, if any is), of the exported file."""
    for name, flags in VARIANTS.items():
        if wanted and name not in wanted:
            continue
        if name.startswith("small answers"):
            teacher = str(unsteady(photos, out / "unsteady-small", SMALL_SIDE, seed))
        else:
            teacher = str(unsteady(photos, out / "unsteady", SIDE, seed))
        luma = json.loads((out / "run" / "report.json").read_text())["luma"]
        flags = flags.format(until=luma["iterations"] + 150)
        asked = [str(out / "run"), "--teacher", teacher]
        report, _ = run([program, "colorize", *asked, *shlex.split(flags), "--json"])
        found = json.loads(run([program, "eval", *asked, "--frames", "2", "--json"])[0])
        ours = by_method(found["pictures"])["exported"]
        between = by_method(found["between"]["consistency"])["exported"]
        chroma = json.loads(report)["chroma"]
        figures = [f"{between['rms']:.2f}", f"{ours['ab_error']:.2f}"]
        figures += [f"{ours['delta_e']['mean']:.2f}", f"{ours['colorfulness']:.1f}"]
        line([scene, name, *figures, f"{chroma['passes']:.0f}", f"{chroma['seconds']['distill']:.0f}"])


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-o", "--output", type=Path, default=Path("target/color"))
    parser.add_argument("--data", type=Path, default=Path(os.environ.get("SCENES", "scenes")))
    parser.add_argument("--program", default="target/release/gs-chroma")
    parser.add_argument("--network", default="assets/teacher/demo-teacher.onnx")
    parser.add_argument("--iterations", type=int, default=1000, help="of fit")
    parser.add_argument("--colorize", default="", help="more flags for colorize, as one word")
    parser.add_argument("--eval", default="", help="more flags for eval, as one word")
    parser.add_argument("--method", choices=["exported", "native"], default="exported")
    parser.add_argument("--frames", type=int, default=60)
    parser.add_argument("--scenes", nargs="*", default=list(SCENES), choices=list(SCENES))
    parser.add_argument("--teachers", nargs="*", default=TEACHERS, choices=TEACHERS)
    parser.add_argument("--seed", type=int, default=0, help="of the unsteady teacher")
    parser.add_argument("--ablation", action="store_true")
    parser.add_argument("--variants", nargs="*", default=[], choices=list(VARIANTS))
    arguments = parser.parse_args()
    program = arguments.program
    head = HEAD
    if arguments.ablation:
        head = ["scene", "variant", "views differ by", "held-out a/b error", "ΔE00"]
        head += ["colorfulness", "view passes", "seconds"]
        arguments.teachers = ["unsteady"]
    line(head)
    line(["---"] * len(head))
    for scene in arguments.scenes:
        folder = arguments.data / scene
        if not folder.is_dir():
            print(f"{folder} is not there: skipped", file=sys.stderr)
            continue
        out = arguments.output / scene
        fitted(program, folder, out / "run", arguments.iterations)
        photos = folder / "images"
        if arguments.ablation:
            ablation(program, scene, photos, out, arguments.variants, arguments.seed)
            continue
        for teacher in arguments.teachers:
            match teacher:
                case "oracle":
                    path = photos
                case "unsteady":
                    path = unsteady(photos, out / "unsteady", SIDE, arguments.seed)
                case _:
                    path = arguments.network
            asked = [str(out / "run"), "--teacher", str(path)]
            colorize = [program, "colorize", *asked, *shlex.split(arguments.colorize)]
            _, seconds = run(colorize)
            measure = [program, "eval", *asked, "--baselines", "--json", *shlex.split(arguments.eval)]
            found, _ = run([*measure, "--frames", str(arguments.frames)])
            draw = f"-{arguments.seed}" if teacher == "unsteady" and arguments.seed else ""
            (out / f"eval-{teacher}{draw}.json").write_text(found)
            line(row(scene, teacher, arguments.method, json.loads(found), seconds))
    return 0


if __name__ == "__main__":
    sys.exit(main())
