#!/usr/bin/env python3
"""Fits, colors and measures scenes, and prints ChromaDistill's tables for them in Markdown.

    cargo build --release && python3 tools/check_paper.py assets/demo --max-side 100

Each SCENE is a COLMAP folder of color photos. Its run is kept in OUTPUT and used again. E is the
paper's error: the squared difference of chroma over the visible pixels, summed over a and b, which
are mapped to [0, 1], short range 10 frames and long range 30. The paper does not state its scale:
compare ratios to RGB splats, its "colorize, then train". `--multi-scale` adds the paper's recipe
with and without coarser scales, 15,000 iterations each.
"""

from __future__ import annotations

import argparse
import json
import shlex
import sys
from pathlib import Path

from check_color import by_method, line, ratio, run

ROOT = Path(__file__).parent.parent
RANGES = {"short": 10, "long": 30}
CODE = ["chromadistill-code", "chromadistill-rgb"]
SCALES = ["chromadistill-paper", "chromadistill-one-scale"]
BASELINE = "rgb_splats"
NAMES = {
    "exported": "ours",
    BASELINE: "RGB splats",
    "per_frame": "frame by frame",
    "chromadistill_code": "ChromaDistill's code",
    "chromadistill_rgb": "the code in RGB",
    "chromadistill_paper": "ChromaDistill's paper",
    "chromadistill_one_scale": "the paper at one scale",
}
ABLATIONS = [
    ("Lab", "chromadistill_code", "RGB", "chromadistill_rgb"),
    ("three scales", "chromadistill_paper", "one", "chromadistill_one_scale"),
]


def figure(value: float | None, digits: int) -> str:
    """A figure; a dash where there is none."""
    return "–" if value is None else f"{value:.{digits}f}"


def table(title: str, head: list[str], rows: list[list[str]]) -> None:
    """A titled table."""
    print(f"\n## {title}\n")
    for cells in [head, ["---"] * len(head), *rows]:
        line(cells)


def ranges(found: dict) -> dict[str, dict[str, dict]]:
    """Scores along the path, by range and method."""
    scores = found["path"]["consistency"]
    return {
        name: by_method([score for score in scores if score["delta"] == delta])
        for name, delta in RANGES.items()
    }


def squared(score: dict | None) -> float | None:
    """The paper's error: `eval` divides by the channels, too."""
    return None if score is None or score["error"] is None else 2 * score["error"]


def consistency(scene: str, found: dict) -> list[list[str]]:
    """Rows of the paper's Tables 1 and 2."""
    far, rows = ranges(found), []
    for method, name in NAMES.items():
        scores = [far[r].get(method) for r in RANGES]
        if not any(scores):
            continue
        cells = [figure(squared(score), 8) for score in scores]
        for r, score in zip(RANGES, scores):
            cells.append(figure(ratio(score, far[r].get(BASELINE), "error"), 2))
        cells += [figure(score and score["rms"], 2) for score in scores]
        rows.append([scene, name, *cells])
    return rows


def gray(scene: str, found: dict) -> list[list[str]]:
    """Rows of the gray picture before and after coloring."""
    luma = found["luma"]
    cells = [figure(luma["psnr"], 2), figure(luma["ssim"], 3), figure(luma["lpips"], 3)]
    rows = [[scene, "before", *cells, figure(luma["sharpness"], 0)]]
    for method, picture in by_method(found["pictures"]).items():
        if method in NAMES:
            cells = [figure(picture["gray_psnr"], 2), "–", "–", figure(picture["sharpness"], 0)]
            rows.append([scene, NAMES[method], *cells])
    return rows


def ablations(scene: str, found: dict) -> list[list[str]]:
    """Rows of a part of the recipe, and of the recipe without it."""
    far, pictures, rows = ranges(found), by_method(found["pictures"]), []
    for with_it, method, without, other in ABLATIONS:
        if method in pictures and other in pictures:
            for name, of in [(with_it, method), (without, other)]:
                errors = [figure(squared(far[r].get(of)), 8) for r in RANGES]
                picture = pictures[of]
                colors = [figure(picture["colorfulness"], 1), figure(picture["ab_error"], 2)]
                rows.append([scene, name, *errors, *colors])
    return rows


def seconds(scene: str, report: dict, found: dict) -> list[list[str]]:
    """Rows of wall seconds, and of passes over a view at full size."""
    luma, chroma = report["luma"], report["chroma"]
    cells = [figure(luma["seconds"]["all"], 1), str(luma["iterations"]), "–"]
    rows = [[scene, "fit", *cells]]
    cells = [figure(chroma["seconds"]["all"], 1), str(chroma["iterations"])]
    rows.append([scene, "colorize", *cells, figure(chroma["passes"], 0)])
    for peer in found["peers"]:
        cells = [figure(peer["seconds"], 1), str(peer["iterations"]), figure(peer["passes"], 0)]
        rows.append([scene, NAMES[peer["method"]], *cells])
    return rows


def measured(arguments: argparse.Namespace, scene: Path) -> tuple[dict, dict]:
    """The report of a colored scene, and its evaluation."""
    program, out = arguments.program, arguments.output / scene.name
    paper = ["--as-paper"] if arguments.as_paper else []
    if not (out / "luma.ply").is_file():
        side = ["--max-side", str(arguments.max_side)] if arguments.max_side else []
        fit = [program, "fit", str(scene), "-o", str(out), *side, *paper]
        run(fit + shlex.split(arguments.fit))
    asked = [str(out), "--teacher", str(arguments.teacher), *shlex.split(arguments.network)]
    report = json.loads(run([program, "colorize", *asked, *paper, "--json"])[0])
    recipes = CODE + (SCALES if arguments.multi_scale else [])
    asked += [word for recipe in recipes for word in ("--recipe", recipe)]
    asked += ["--lpips", str(arguments.lpips)] if arguments.lpips else []
    frames = ["--frames", str(arguments.frames), "--baselines", "--json"]
    return report, json.loads(run([program, "eval", *asked, *frames])[0])


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scenes", nargs="+", type=Path, metavar="SCENE")
    parser.add_argument("-o", "--output", type=Path, default=Path("target/paper"))
    parser.add_argument("--program", default="target/release/gs-chroma")
    parser.add_argument("--teacher", default=ROOT / "assets" / "teacher" / "demo-teacher.onnx")
    parser.add_argument("--network", default="", help="flags of the teacher, as one word")
    parser.add_argument("--max-side", type=int, help="of the photos, in pixels")
    parser.add_argument("--as-paper", action="store_true", help="the paper's own schedule")
    parser.add_argument("--fit", default="", help="more flags for fit, as one word")
    parser.add_argument("--multi-scale", action="store_true", help="the ablation of scales, too")
    parser.add_argument("--frames", type=int, default=60)
    parser.add_argument("--lpips", type=Path, help="network of `eval --lpips`")
    arguments = parser.parse_args()
    found = {scene.name: measured(arguments, scene) for scene in arguments.scenes}
    error = [f"E, {name} ({delta} frames)" for name, delta in RANGES.items()]
    head = [*error, "/ RGB splats, short", "long", "rms, short", "long"]
    rows = [row for name, (_, of) in found.items() for row in consistency(name, of)]
    table("Consistency", ["scene", "colored by", *head], rows)
    rows = [row for name, (_, of) in found.items() for row in gray(name, of)]
    table("Gray", ["scene", "colored by", "PSNR, dB", "SSIM", "LPIPS", "sharpness"], rows)
    rows = [row for name, (_, of) in found.items() for row in ablations(name, of)]
    table("Ablations", ["scene", "recipe", *error, "colorfulness", "a/b error"], rows)
    rows = [row for name, (report, of) in found.items() for row in seconds(name, report, of)]
    table("Seconds", ["scene", "step", "seconds", "iterations", "passes over a view"], rows)
    return 0


if __name__ == "__main__":
    sys.exit(main())
