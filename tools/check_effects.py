#!/usr/bin/env python3
"""Runs `plan` and `fit` on pairs of scenes and prints what came out as Markdown.

Each pair is made from SCENE by the example make_variants: one calls for an effect, its
control just does not. `plan` should switch the effect on for the one and off for the
other; `fit --with` and `fit --without` tell whether that was right. Quality is the PSNR
of held-out photos, which stay clean where the others are spoilt. Run it on an idle machine.

    cargo build --release --bins --examples && python3 tools/check_effects.py -o target/effects
"""

from __future__ import annotations

import argparse
import json
import shlex
import shutil
import statistics
import subprocess
import sys
import time
from dataclasses import dataclass, field
from pathlib import Path

# What make_variants makes, and the effect that it calls for: none does for a format, which
# is only fitted.
VARIANTS = [
    ("barrel", "lens"),
    ("fisheye", "lens"),
    ("exposure", "exposure"),
    ("distances", "antialias"),
    ("dust", "robust"),
    ("sky", "background"),
    ("masked", "masks"),
    ("gloss", "luma-degree"),
    ("sixteen", None),
    ("infrared-tiff", None),
    ("heavy-dust", "robust"),
    ("flicker", "exposure"),
]
# Others have one. Heavy dust shares that of dust, flicker that of exposure.
NO_CONTROL = ["infrared-tiff", "heavy-dust", "flicker"]

# These stay as the plan has them while another effect is in question; the others are
# off, for one may do the work of another.
INNOCENT = ["lens", "masks"]

# Of draft the degree is 0, whatever the evidence.
PLAN_PRESET = "balanced"


@dataclass
class Fits:
    """What fits with the same flags and different seeds gave."""

    psnr: list[float] = field(default_factory=list)
    seconds: list[float] = field(default_factory=list)
    memory: list[float] = field(default_factory=list)  # MiB
    failure: str = ""


def run(command: list[str]) -> tuple[subprocess.CompletedProcess[str], float]:
    """A finished command, and its wall seconds."""
    begun = time.monotonic()
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    return done, time.monotonic() - begun


def first_line(text: str) -> str:
    """The line that says what went wrong."""
    lines = [line for line in text.splitlines() if line.startswith("error")]
    return (lines or text.splitlines() or ["no words"])[0]


def planned(program: str, folder: Path, effect: str) -> tuple[str, str, list[str]]:
    """The plan's choice, its evidence against the threshold, and flags against other effects."""
    done, _ = run([program, "plan", str(folder), "--json", "--preset", PLAN_PRESET])
    if done.returncode != 0:
        return "–", first_line(done.stderr), []
    effects = json.loads(done.stdout)["effects"]
    found = [one for one in effects if one["name"] == effect]
    if not found:
        return "–", "not in the plan", []
    others = [one["name"] for one in effects if one["name"] not in (effect, *INNOCENT)]
    without = [flag for name in others for flag in ("--without", name)]
    one = found[0]
    numbers = [f"{one[key]:.3g}" if isinstance(one.get(key), (int, float)) else str(one.get(key))
               for key in ("evidence", "threshold")]  # fmt: skip
    on = one["on"]
    return ("on" if on is True else "off" if on is False else str(on)), " / ".join(numbers), without


def fits(options: argparse.Namespace, folder: Path, flags: list[str]) -> Fits:
    """Fits the scene with every seed."""
    made = Fits()
    for seed in options.seeds:
        out = options.output / "run"
        shutil.rmtree(out, ignore_errors=True)
        command = [options.program, "fit", str(folder), "-o", str(out), "--json"]
        command += ["--preset", "draft", "--iterations", str(options.iterations)]
        command += ["--seed", str(seed), *shlex.split(options.fit), *flags]
        done, seconds = run(command)
        if done.returncode != 0:
            made.failure = first_line(done.stderr)
            return made
        luma = json.loads(done.stdout)["luma"]
        made.psnr.append(luma["held_out"]["psnr"])
        made.seconds.append(seconds)
        made.memory.append((luma.get("peak_host_memory") or 0) / 2**20)
    return made


def cell(runs: list[Fits], values: list[list[float]], digits: int) -> str:
    """Medians side by side; with more than one seed, the range of each behind it."""
    words = []
    for one, numbers in zip(runs, values):
        if one.failure:
            words.append("fails")
            continue
        word = f"{statistics.median(numbers):.{digits}f}"
        if len(numbers) > 1:
            word += f" ({min(numbers):.{digits}f}–{max(numbers):.{digits}f})"
        words.append(word)
    return " / ".join(words)


def members(wanted: list[str]) -> list[tuple[str, str | None]]:
    """Every scene to make, with the effect in question."""
    pairs = [(name, effect) for name, effect in VARIANTS if not wanted or name in wanted]
    controls = {name: [] if name in NO_CONTROL else [f"{name}-control"] for name, _ in pairs}
    return [(one, effect) for name, effect in pairs for one in [name, *controls[name]]]


def main() -> int:
    """Makes, plans, fits, prints."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scene", nargs="?", type=Path, default=Path("assets/demo"))
    parser.add_argument("-o", "--output", type=Path, default=Path("target/effects"))
    parser.add_argument("--program", default="target/release/gs-chroma")
    parser.add_argument("--maker", default="target/release/examples/make_variants")
    parser.add_argument("--variants", nargs="*", default=[], help="only these, with controls")
    parser.add_argument(
        "--also", nargs=2, action="append", default=[], metavar=("FOLDER", "EFFECT"),
        help="a COLMAP folder that is there and calls for an effect",
    )  # fmt: skip
    parser.add_argument("--iterations", type=int, default=500)
    parser.add_argument("--seeds", type=int, nargs="+", default=[0])
    parser.add_argument("--fit", default="", help="more flags for fit, as one word")
    parser.add_argument("--plan-only", action="store_true", help="do not fit")
    options = parser.parse_args()
    known = [name for name, _ in VARIANTS]
    if unknown := set(options.variants) - set(known):
        parser.error(f"no variant is called {', '.join(sorted(unknown))}; there are {', '.join(known)}")
    options.output.mkdir(parents=True, exist_ok=True)
    print("| scene | effect | plan | evidence / threshold | PSNR with / without | seconds with / without | host MiB with / without |")
    print("|---|---|---|---|---|---|---|")
    failures = []
    scenes = [(name, effect, options.output / name) for name, effect in members(options.variants)]
    for name, _, folder in scenes:
        shutil.rmtree(folder, ignore_errors=True)
        done, _ = run([options.maker, str(options.scene), name, str(folder)])
        if done.returncode != 0:
            print(done.stderr, file=sys.stderr, end="")
            return 1
    scenes += [(Path(folder).name, effect, Path(folder)) for folder, effect in options.also]
    for name, effect, folder in scenes:
        choice, evidence, without = "", "", []
        if effect:
            choice, evidence, without = planned(options.program, folder, effect)
        if effect and choice != ("off" if name.endswith("-control") else "on"):
            failures.append(f"{name}: {effect} is {choice} in the plan ({evidence})")
        flags = [[flag, effect, *without] for flag in ("--with", "--without")] if effect else [[]]
        runs = [] if options.plan_only else [fits(options, folder, one) for one in flags]
        failures += [f"{name}: {one.failure}" for one in runs if one.failure]
        print(
            f"| {name} | {effect or ''} | {choice} | {evidence}"
            f" | {cell(runs, [one.psnr for one in runs], 2)}"
            f" | {cell(runs, [one.seconds for one in runs], 1)}"
            f" | {cell(runs, [one.memory for one in runs], 0)} |",
            flush=True,
        )
    for failure in failures:
        print(failure, file=sys.stderr)
    return int(bool(failures))


if __name__ == "__main__":
    sys.exit(main())
