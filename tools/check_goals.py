#!/usr/bin/env python3
"""Runs `fit` with time limits, PSNR targets and a flat curve as the end, and prints as
Markdown how well it kept its word.

    cargo build --release && python3 tools/check_goals.py SCENE … -o target/goals

Scenes are COLMAP folders. Targets are given as shares of what the preset reaches, so that
one list does for all scenes.
"""

from __future__ import annotations

import argparse
import json
import shutil
import subprocess
import sys
import time
from pathlib import Path


def fit(program: str, scene: Path, run: Path, options: list[str]) -> tuple[dict, float, str]:
    """The report, wall seconds, and the error if there was one."""
    shutil.rmtree(run, ignore_errors=True)
    begun = time.monotonic()
    command = [program, "fit", str(scene), "-o", str(run), *options]
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    seconds = time.monotonic() - begun
    errors = [line for line in done.stderr.splitlines() if line.startswith("error")]
    report = run / "report.json"
    return (json.loads(report.read_text()) if report.exists() else {}), seconds, "".join(errors)


def psnr(report: dict) -> float:
    held_out = (report.get("luma") or {}).get("held_out") or {}
    return held_out.get("psnr", float("nan"))


def work(report: dict) -> str:
    """What was done, for a cell."""
    if not report:
        return "–"
    luma = report["luma"]
    side = report["capture"]["max_side"]
    return f"{luma['iterations']:,} iterations, {luma['splats']:,} Gaussians, {side} px"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scenes", nargs="+", type=Path)
    parser.add_argument("-o", "--output", type=Path, required=True)
    parser.add_argument("--program", default="target/release/gs-chroma")
    parser.add_argument("--limits", default="1,2,4", help="minutes")
    parser.add_argument("--targets", default="0.9,1.02", help="shares of the preset's PSNR")
    parser.add_argument("--preset", default="draft")
    parser.add_argument("--flat", default="0.1,0.3", help="dB")
    parser.add_argument("--measure-side", help="pixels at which all are measured, to compare them")
    arguments = parser.parse_args()
    shares = [float(share) for share in arguments.targets.split(",") if share]
    limits = [float(limit) for limit in arguments.limits.split(",") if limit]
    flats = [float(flat) for flat in arguments.flat.split(",") if flat]
    side = ["--measure-side", arguments.measure_side] if arguments.measure_side else []

    print("| scene | asked for | done | s | held-out PSNR | kept |")
    print("|---|---|---|--:|--:|---|")

    def row(scene: Path, asked: str, options: list[str], kept) -> dict:
        report, seconds, error = fit(
            arguments.program, scene, arguments.output / scene.name, [*options, *side]
        )
        said = kept(report, seconds) if not error else error
        cells = [scene.name, asked, work(report), f"{seconds:.0f}", f"{psnr(report):.2f}", said]
        print("| " + " | ".join(cells) + " |", flush=True)
        return report

    for scene in arguments.scenes:
        preset = ["--preset", arguments.preset]
        base = {}
        if shares or flats:
            base = row(scene, f"`{' '.join(preset)}`", preset, lambda report, seconds: "")
        for limit in limits:
            row(
                scene,
                f"`--time-limit {limit:g}`",
                ["--time-limit", f"{limit:g}"],
                lambda report, seconds: f"{100 * seconds / (60 * limit):.0f} % of the time",
            )
        for share in shares:
            target = round(share * psnr(base), 2)
            row(
                scene,
                f"`--target-psnr {target}`",
                ["--target-psnr", str(target), "--preset", arguments.preset],
                lambda report, seconds: f"{psnr(report) - target:+.2f} dB",
            )
        for flat in flats:
            row(
                scene,
                f"`--stop-when-flat={flat:g}`",
                [f"--stop-when-flat={flat:g}", *preset],
                lambda report, seconds: "",
            )
    return 0


if __name__ == "__main__":
    sys.exit(main())
