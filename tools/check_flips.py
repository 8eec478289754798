#!/usr/bin/env python3
"""Compares what the plan chose with each single effect flipped, and prints Markdown.

    cargo build --release --bins --examples && python3 tools/check_flips.py -o target/flips

The bundled scene, the scenes below DATA (default $SCENES or scenes; skipped with a word where
missing), few photos in an arc, an object before a plain backdrop, and every variant that
make_variants makes of the bundled scene. A run as planned tells which effects are on; then every
effect is flipped by itself, all others as planned. What a flip gains is the mean over the seeds
of held-out PSNR after each photo's own gain and offset. Flips that lose with the first seed are
not tried with the others. Those that gain more than BOUND are tried with the seeds of `--again`,
too, and all count: the best of five flips by three seeds flatters. A scene fails where a flip
gains more than BOUND and more than twice its standard error. The last row is the mean over the
scenes on which the plan leaves an effect off, ± its error over scenes, of the first seed alone:
every flip has it. Results are kept in OUTPUT/flips.json: a second call goes on where the first was
stopped.
"""

from __future__ import annotations

import argparse
import itertools
import json
import os
import shlex
import shutil
import statistics
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from threading import Lock

from check_effects import VARIANTS, first_line, members

# Flips of `lens` and `masks` would measure other pixels.
EFFECTS = ["exposure", "robust", "antialias", "background", "luma-degree"]
SCENES = ["fern-llff", "brighton-drone", "banana-object", "caliterra-drone", "tiny-banana", "tiny-brighton"]

# More that is made: of a scene, a variant.
ALSO_MADE = [("bundled", "arc"), ("banana-object", "backdrop"), ("brighton-drone", "arc")]

# What a flip may gain, in dB.
BOUND = 0.1


class Failure(Exception):
    """A command that failed, in one line."""


def fit(options: argparse.Namespace, scene: Path, seed: int, flags: list[str]) -> dict:
    """The report of one run."""
    out = options.output / f"run-{scene.name}"
    shutil.rmtree(out, ignore_errors=True)
    command = [options.program, "fit", str(scene), "-o", str(out), "--json", "--seed", str(seed)]
    command += [*shlex.split(options.fit), *flags]
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    if done.returncode != 0:
        raise Failure(f"{scene.name}: {first_line(done.stderr)}")
    return json.loads(done.stdout)


def measured(report: dict) -> float:
    return report["luma"]["held_out"]["corrected_psnr"]


def flags(chosen: dict[str, bool], degree: int) -> list[str]:
    """What makes `fit` simulate these effects, luma in harmonics of `degree`."""
    words = []
    for name, on in chosen.items():
        if name == "luma-degree" and on:
            words += ["--sh-degree", str(degree)]
        else:
            words += ["--with" if on else "--without", name]
    return words


def scene_results(options: argparse.Namespace, scene: Path, known: dict, save) -> dict:
    """PSNR of every seed, as planned and with every flip."""
    first = str(options.seeds[0])
    if "plan" not in known:
        report = fit(options, scene, options.seeds[0], [])
        effects = [one for one in report["effects"] if one["name"] in EFFECTS]
        known["plan"] = {one["name"]: bool(one["on"]) for one in effects}
        known["trials"] = {one["name"]: one["trial"] for one in effects if one.get("trial") is not None}
        known["degree"] = report["luma"]["settings"]["sh_degree"]
        known["runs"] = {"planned": {first: measured(report)}}
        save()
    runs = known["runs"]
    for name in ["planned", *known["plan"]]:
        chosen = {one: on != (one == name) for one, on in known["plan"].items()}
        words = flags(chosen, known["degree"] or 1)
        found = runs.setdefault(name, {})
        for seed in map(str, options.seeds):
            if seed not in found:
                found[seed] = measured(fit(options, scene, int(seed), words))
                save()
            if name != "planned" and seed == first and found[seed] < runs["planned"][seed]:
                break
        if name != "planned" and statistics.mean(gains(runs, name)) > BOUND:
            both = {"planned": flags(known["plan"], known["degree"] or 1), name: words}
            for seed, (one, flips) in itertools.product(map(str, options.again), both.items()):
                if seed not in runs[one]:
                    runs[one][seed] = measured(fit(options, scene, int(seed), flips))
                    save()
    return known


def gains(runs: dict, flip: str) -> list[float]:
    """What a flip gains with every seed that it was tried with."""
    return [psnr - runs["planned"][seed] for seed, psnr in runs[flip].items() if seed in runs["planned"]]


def row(options: argparse.Namespace, name: str, found: dict) -> tuple[str, list[str]]:
    """A row of the table, and what gains more than it may."""
    on = [effect for effect, is_on in found["plan"].items() if is_on]
    planned = [found["runs"]["planned"][str(seed)] for seed in options.seeds]
    cells, failures = [], []
    for effect in EFFECTS:
        if effect not in found["plan"]:
            cells.append("")
            continue
        each = gains(found["runs"], effect)
        gain = statistics.mean(each)
        error = statistics.stdev(each) / len(each) ** 0.5 if len(each) > 1 else 0.0
        worse = gain > BOUND and gain > 2 * error
        word = f"{gain:+.2f}" + (f" ± {error:.2f}" if len(each) > 1 else "")
        cells.append(f"**{word}**" if worse else word)
        if worse:
            failures.append(f"{name}: flipping {effect} gains {gain:.2f} dB")
    spread = f"{statistics.mean(planned):.2f} ({min(planned):.2f}–{max(planned):.2f})"
    return f"| {name} | {', '.join(on) or 'none'} | {spread} | {' | '.join(cells)} |", failures


def mean_row(options: argparse.Namespace, found: list[dict]) -> str:
    """What adding an effect gains on an average scene."""
    first = str(options.seeds[0])
    cells = []
    for effect in EFFECTS:
        off = [one["runs"] for one in found if not one["plan"].get(effect, True)]
        each = [runs[effect][first] - runs["planned"][first] for runs in off]
        error = statistics.stdev(each) / len(each) ** 0.5 if len(each) > 1 else 0.0
        cells.append(f"{statistics.mean(each):+.2f} ± {error:.2f} ({len(each)})" if len(each) > 1 else "")
    return f"| mean where off, seed {first} | | | {' | '.join(cells)} |"


def main() -> int:
    """Makes, fits, prints."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--data", type=Path, default=Path(os.environ.get("SCENES", "scenes")))
    parser.add_argument("-o", "--output", type=Path, default=Path("target/flips"))
    parser.add_argument("--program", default="target/release/gs-chroma")
    parser.add_argument("--maker", default="target/release/examples/make_variants")
    parser.add_argument("--scenes", nargs="*", help="only these names")
    parser.add_argument("--also", nargs="*", type=Path, default=[], help="more COLMAP folders")
    parser.add_argument("--jobs", type=int, default=1, help="scenes at a time")
    parser.add_argument("--seeds", type=int, nargs="+", default=[0, 1, 2])
    parser.add_argument("--again", type=int, nargs="+", default=[3, 4, 5], help="seeds for gains beyond the bound")
    parser.add_argument(
        "--fit", default="--preset balanced --iterations 2400 --max-side 160 --max-splats 4000",
        help="flags for fit, as one word",
    )  # fmt: skip
    options = parser.parse_args()
    options.output.mkdir(parents=True, exist_ok=True)
    bundled = Path("assets/demo")
    scenes = {"bundled": bundled} | {name: options.data / name for name in SCENES}
    scenes |= {folder.name: folder for folder in options.also}
    made = {f"{name}-{variant}": (scenes[name], variant) for name, variant in ALSO_MADE}
    made |= {name: (bundled, name) for name, _ in members([name for name, _ in VARIANTS])}
    scenes |= {name: options.output / name for name in made}
    if options.scenes:
        scenes = {name: folder for name, folder in scenes.items() if name in options.scenes}
    kept = options.output / "flips.json"
    results = json.loads(kept.read_text()) if kept.is_file() else {}
    # Other flags measure something else.
    if results.get("fit") != options.fit:
        results = {"fit": options.fit, "scenes": {}}

    before, lock = json.loads(json.dumps(results["scenes"])), Lock()

    def save(name: str, known: dict) -> None:
        own = json.loads(json.dumps(known))
        beside = kept.with_suffix(".part")
        with lock:
            results["scenes"][name] = own
            beside.write_text(json.dumps(results, indent=1) + "\n")
            beside.replace(kept)

    def flipped(name: str, folder: Path) -> dict | Failure | None:
        """What a scene gave, or why nothing; None where it is missing."""
        if name in made and not folder.is_dir():
            source, variant = made[name]
            if source.is_dir():
                subprocess.run([options.maker, source, variant, folder], check=True, stdout=sys.stderr)
        if not folder.is_dir():
            return None
        try:
            known = dict(before.get(name, {}))
            return scene_results(options, folder, known, lambda: save(name, known))
        except Failure as failure:
            return failure

    print(f"| scene | on as planned | dB as planned | {' | '.join(EFFECTS)} |")
    print(f"|---|---|{'--:|' * (len(EFFECTS) + 1)}")
    failures, rows = [], []
    with ThreadPoolExecutor(options.jobs) as pool:
        for name, found in zip(scenes, pool.map(flipped, scenes, scenes.values())):
            if found is None:
                print(f"skipped: no {scenes[name]}", file=sys.stderr)
            elif isinstance(found, Failure):
                failures.append(str(found))
            else:
                line, worse = row(options, name, found)
                failures += worse
                rows.append(found)
                print(line, flush=True)
    if len(rows) > 1:
        print(mean_row(options, rows))
    for failure in failures:
        print(failure, file=sys.stderr)
    return int(bool(failures))


if __name__ == "__main__":
    sys.exit(main())
