#!/usr/bin/env python3
"""Kills workers of tools/cluster at random moments, and compares the blocks' bytes.

    PYTHON tools/check_cluster.py [COLMAP_DIR] [--tries N] [--blocks N] [--seed N]

PYTHON has the packages of tools/cluster/requirements.txt. The job is done once undisturbed; then
each try does it again from its coarse model on, kills one worker that trains a block (SIGKILL, at
a random moment) and waits for the end. Ray has to start the block again, on its checkpoint, and
every block has to end with the same bytes. Prints a table, and exits with 1 where one does not.
Linux.
"""

import argparse
import hashlib
import json
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
PROGRAM = ROOT / "target/release/gs-chroma"
FIT = "--max-side 120 --iterations 400 --checkpoint 0.002"
LONGEST = 540.0  # Seconds of one job.


def command(scene, job, blocks):
    """The command line of a whole job."""
    return [
        sys.executable,
        str(ROOT / "tools/cluster/run.py"),
        str(scene),
        str(job),
        "--program",
        str(PROGRAM),
        "--partition",
        f"--blocks {blocks} --max-splats 4000",
        "--coarse",
        "--max-side 120 --iterations 100",
        "--fit",
        FIT,
        "--every",
        "0.2",
    ]


def digests(job):
    """SHA-256 of every block's Gaussians."""
    blocks = sorted(job.glob("block-*/luma.ply"))
    return {path.parent.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in blocks}


def running(job):
    """Blocks that are trained at the moment, and the processes of their workers."""
    try:
        rows = json.loads((job / "logs/board.json").read_text())
    except (OSError, json.JSONDecodeError):
        return {}
    return {
        name: row["worker"]
        for name, row in rows.items()
        if name.startswith("block-") and row["state"] == "running"
    }


def kill_one(job, process, dice, longest):
    """Waits for a random moment and kills a worker; its block and the moment, or None."""
    while process.poll() is None and not running(job):
        time.sleep(0.05)
    moment = dice.uniform(0.0, longest)
    time.sleep(moment)
    while process.poll() is None:
        workers = running(job)
        if workers:
            name = dice.choice(sorted(workers))
            try:
                os.kill(workers[name], signal.SIGKILL)
            except ProcessLookupError:
                continue
            return name, moment
        time.sleep(0.05)
    return None


def starts(job, name):
    """How often a block was started, in both rounds."""
    log = job / f"logs/{name}.log"
    return log.read_text().count("$ ") if log.is_file() else 0


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scene", nargs="?", type=Path, default=ROOT / "assets/demo")
    parser.add_argument("--tries", type=int, default=10)
    parser.add_argument("--blocks", type=int, default=2)
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    dice = random.Random(arguments.seed)
    with tempfile.TemporaryDirectory() as place:
        whole = Path(place, "whole")
        begun = time.monotonic()
        done = subprocess.run(command(arguments.scene, whole, arguments.blocks), timeout=LONGEST)
        if done.returncode != 0:
            sys.exit("the job fails undisturbed")
        seconds = time.monotonic() - begun
        rows = json.loads((whole / "logs/board.json").read_text())
        training = min(row["seconds"] for name, row in rows.items() if name.startswith("block-"))
        wanted = digests(whole)
        print(f"undisturbed: {seconds:.0f} s, {len(wanted)} blocks")
        print("| try | killed | after, s | starts of the block | seconds | same bytes |")
        print("|---|---|---|---|---|---|")
        wrong = 0
        for number in range(1, arguments.tries + 1):
            job = Path(place, f"try-{number}")
            shutil.copytree(whole, job, ignore=shutil.ignore_patterns("logs", "first", "merged"))
            for block in wanted:
                for path in (job / block).iterdir():
                    if path.name != "block.json":
                        path.unlink()
            begun = time.monotonic()
            process = subprocess.Popen(
                command(arguments.scene, job, arguments.blocks),
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
            )
            killed = kill_one(job, process, dice, 0.9 * training)
            code = process.wait(LONGEST)
            seconds = time.monotonic() - begun
            same = code == 0 and digests(job) == wanted
            wrong += not same
            name, moment = killed or ("none", 0.0)
            tries = starts(job, name)
            word = "yes" if same else "NO"
            print(f"| {number} | {name} | {moment:.1f} | {tries} | {seconds:.0f} | {word} |", flush=True)
            shutil.rmtree(job)
    sys.exit(1 if wrong else 0)


if __name__ == "__main__":
    main()
