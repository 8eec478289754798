#!/usr/bin/env python3
"""What an effect gains on every photo of a scene, each held out once, and prints Markdown.

    cargo build --release && python3 tools/check_folds.py $SCENES/tiny-brighton background

`fit` holds out every eighth photo by name: of twelve photos two, which say little. Here names are
turned around eight times, so that every photo is held out, and the scene is fitted with the
effect and without it, otherwise as planned. Instead of an effect, `--without=FLAG` asks what the
scene loses by a flag of `fit`, such as `--without=--no-fill-gaps`, and `--against` what this build
of the program gains over another. `--variant` makes a variant of each copy: one that leaves
held-out photos clean, such as dust, leaves each photo clean once. Gains are of PSNR as viewers show
the scene, and after the photo's own gain and offset. Copies of the scene are written to a
temporary folder.
"""

from __future__ import annotations

import argparse
import itertools
import json
import shlex
import shutil
import statistics
import subprocess
import tempfile
from pathlib import Path

# `fit` holds out every eighth.
FOLDS = 8


def turned(scene: Path, copy: Path, first: int) -> None:
    """A copy of a scene whose names sort with this photo first; names keep their length."""
    shutil.rmtree(copy, ignore_errors=True)
    shutil.copytree(scene, copy)
    names = sorted(photo.name for photo in (scene / "images").iterdir())
    renamed = {name: ("AB"[i < first]) + name[1:] for i, name in enumerate(names)}
    if len(set(renamed.values())) < len(names):
        raise SystemExit(f"{scene}: photos whose names differ in the first letter only")
    for old, new in renamed.items():
        (copy / "images" / old).rename(copy / "images" / new)
    for model in [*copy.rglob("images.bin"), *copy.rglob("images.txt")]:
        listed = model.read_bytes()
        for old, new in renamed.items():
            listed = listed.replace(old.encode(), new.encode())
        model.write_bytes(listed)


def held_out(program: str, scene: Path, flags: list[str]) -> dict[str, list[float]]:
    """PSNR of the photos held out, as shown and corrected, by the rest of their names."""
    out = scene.with_name("run")
    shutil.rmtree(out, ignore_errors=True)
    command = [program, "fit", str(scene), "-o", str(out), "--json", *flags]
    done = subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True)
    views = json.loads(done.stdout)["luma"]["held_out_views"]
    return {view["name"][1:]: [view["psnr"], view["corrected_psnr"]] for view in views}


def mean_gain(gains: list[list[float]]) -> list[float]:
    """The mean of both PSNRs' gains."""
    return [statistics.mean(each) for each in zip(*gains, strict=True)]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scene", type=Path)
    parser.add_argument("effect", nargs="?")
    parser.add_argument("--without", metavar="FLAG", help="instead of an effect: a flag that leaves something out")
    parser.add_argument("--against", metavar="PROGRAM", help="instead of an effect: another build of the program")
    parser.add_argument("--variant", help="of make_variants, made of each copy")
    parser.add_argument("--maker", default="target/release/examples/make_variants")
    parser.add_argument("--program", default="target/release/gs-chroma")
    parser.add_argument("--seeds", type=int, nargs="+", default=[0])
    parser.add_argument(
        "--fit", default="--preset balanced --iterations 2400 --max-side 160 --max-splats 4000",
        help="flags for fit, as one word",
    )  # fmt: skip
    options = parser.parse_args()
    if sum(asked is not None for asked in (options.effect, options.without, options.against)) != 1:
        parser.error("an effect, --without or --against")
    ways = [(options.program, flags) for flags in (["--with", options.effect], ["--without", options.effect])]
    if options.without:
        ways = [(options.program, []), (options.program, [options.without])]
    if options.against:
        ways = [(options.program, []), (options.against, [])]
    if not options.scene.is_dir():
        print(f"skipped: no {options.scene}")
        return
    gains: dict[str, list[list[float]]] = {}
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder) / options.scene.name
        for fold, seed in itertools.product(range(FOLDS), options.seeds):
            turned(options.scene, copy, fold)
            scene = copy
            if options.variant:
                scene = copy.with_name(options.variant)
                shutil.rmtree(scene, ignore_errors=True)
                subprocess.run([options.maker, copy, options.variant, scene], check=True, stdout=subprocess.DEVNULL)
            flags = [*shlex.split(options.fit), "--seed", str(seed)]
            on, off = (held_out(program, scene, [*flags, *way]) for program, way in ways)
            for name in on:
                gains.setdefault(name, []).append([a - b for a, b in zip(on[name], off[name], strict=True)])
    print("| photo, first letter left out | as shown, dB | corrected |\n|---|--:|--:|")
    for name, each in sorted(gains.items()):
        shown, corrected = mean_gain(each)
        print(f"| {name} | {shown:+.2f} | {corrected:+.2f} |")
    means = zip(*map(mean_gain, gains.values()), strict=True)
    cells = [f"{statistics.mean(each):+.2f} ± {statistics.stdev(each) / len(each) ** 0.5:.2f}" for each in means]
    print(f"| mean | {' | '.join(cells)} |")


if __name__ == "__main__":
    main()
