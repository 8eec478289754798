#!/usr/bin/env python3
"""Kills `fit` and `colorize` at random moments, goes on, and compares the bytes.

    tools/check_kills.py [--kills N] [--seed N] [COLMAP_DIR]

Each training is killed (SIGKILL) two to four times and resumed with `fit --resume`; each coloring
is killed twice and resumed with `colorize --resume`. Whatever the moment, the next command must be able to go on, and
the files must end with the bytes of runs that nobody killed. Prints a table, and exits with 1
where a byte differs or a command fails. Linux and macOS.
"""

import argparse
import hashlib
import random
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
PROGRAM = ROOT / "target/release/gs-chroma"
TEACHER = ROOT / "assets/teacher/demo-teacher.onnx"

# Enough for some two seconds.
FIT = ["--preset", "draft", "--max-side", "160", "--iterations", "400", "--checkpoint", "0.0001"]


def run(*arguments):
    """What a command says; it has to succeed."""
    done = subprocess.run([PROGRAM, *arguments], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        sys.exit(f"{' '.join(map(str, arguments))}: {done.stderr.strip()}")
    return done


def killed(seconds, *arguments):
    """Runs a command and kills it after so many seconds; whether it was still there."""
    process = subprocess.Popen(
        [PROGRAM, *arguments], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    try:
        process.wait(seconds)
        return False
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()
        return True


def digest(path):
    """SHA-256 of a file."""
    return hashlib.sha256(path.read_bytes()).hexdigest()


def timed(*arguments):
    """Seconds of a command."""
    begun = time.monotonic()
    run(*arguments)
    return time.monotonic() - begun


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scene", nargs="?", type=Path, default=ROOT / "assets/demo")
    parser.add_argument("--kills", type=int, default=50)
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    if not PROGRAM.exists():
        sys.exit("target/release/gs-chroma is missing: run `cargo build --release` first")
    dice = random.Random(arguments.seed)
    with tempfile.TemporaryDirectory() as place:
        whole, part = Path(place, "whole"), Path(place, "part")
        fit = ["fit", arguments.scene, *FIT, "-o"]
        fitting = timed(*fit, whole)
        coloring = timed("colorize", whole, "--teacher", TEACHER)
        wanted = [digest(whole / name) for name in ("luma.ply", "color.ply", "chroma.npy")]
        kills, rounds, resumed, different = 0, 0, 0, 0
        while kills < arguments.kills:
            rounds += 1
            for _ in range(dice.randint(2, 4)):
                more = ["--resume"] if (part / "checkpoint").exists() else []
                resumed += bool(more)
                kills += killed(dice.uniform(0.0, 1.05 * fitting), *fit, part, *more)
            if (part / "checkpoint").exists() or not (part / "report.json").exists():
                run(*fit, part, "--resume")
            color = ["colorize", part, "--teacher", TEACHER, "--checkpoint", "0.0001"]
            for _ in range(2):
                more = ["--resume"] if (part / "checkpoint-color").exists() else []
                resumed += bool(more)
                kills += killed(dice.uniform(0.0, 1.05 * coloring), *color, *more)
            run(*color, "--resume")
            found = [digest(part / name) for name in ("luma.ply", "color.ply", "chroma.npy")]
            different += found != wanted
            left = [path.name for path in part.iterdir() if path.name.startswith((".tmp", ".next"))]
            left += [path.name for path in part.glob("checkpoint*")]
            if left:
                sys.exit(f"left behind: {left}")
        print("| kills | runs | resumed | runs with other bytes |")
        print("|---:|---:|---:|---:|")
        print(f"| {kills} | {rounds} | {resumed} | {different} |")
        sys.exit(1 if different else 0)


if __name__ == "__main__":
    main()
