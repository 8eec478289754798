#!/usr/bin/env python3
"""Trains a large scene in blocks on Ray: partition, coarse model, blocks, merge, colors.

    python3 tools/cluster/run.py COLMAP_DIR JOB --partition "--blocks 4" --fit "--preset balanced"

Without --address Ray is started on this machine and ends with the command. COLMAP_DIR and JOB are
folders that all machines see under the same path, or URLs of fsspec's. Called again with the same
JOB it goes on: what is trained stays. docs/large-scenes.md has the rest.
"""

from __future__ import annotations

import argparse
import json
import shlex
import sys
import time
from pathlib import Path

import ray
from ray.exceptions import RayError, RayTaskError

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tools"))

from cluster import work as tasks  # noqa: E402
from cluster.program import Ended  # noqa: E402
from cluster.storage import Store  # noqa: E402
from cluster.work import COARSE, FIRST, LOGS, MERGED, Work  # noqa: E402

HOST_BYTES = 512 << 20  # Of a worker, beside what a block takes on the device.
TELL_SECONDS = 1.0


@ray.remote(num_cpus=0)
class Board:
    """What every task is doing."""

    def __init__(self):
        self.rows: dict[str, dict] = {}

    def begin(self, name: str) -> None:
        row = self.rows.setdefault(name, {"tries": 0, "begun": time.time()})
        row.update(state="starting", tries=row["tries"] + 1, line="")

    def tell(self, name: str, fields: dict) -> None:
        self.rows[name].update(fields)

    def end(self, name: str) -> None:
        row = self.rows[name]
        row.update(state="done", seconds=time.time() - row["begun"])

    def read(self) -> dict[str, dict]:
        return self.rows


def task(work: Work, stage: str, name: str, board) -> None:
    """One stage of the work, as a Ray task."""
    ray.get(board.begin.remote(name))
    told = 0.0

    def tell(**fields) -> None:
        nonlocal told
        # A bar is drawn more often than anybody looks.
        if "state" in fields or time.monotonic() - told > TELL_SECONDS:
            told = time.monotonic()
            board.tell.remote(name, fields)

    if stage in ("fit", "settle"):
        getattr(tasks, stage)(work, name, tell)
    else:
        getattr(tasks, stage)(work, tell)
    ray.get(board.end.remote(name))


def table(rows: dict[str, dict], blocks: list[str]) -> str:
    """One line a block."""
    lines = [f"{'block':<12} {'state':<9} {'tries':>5} {'seconds':>8}  progress"]
    for name in blocks:
        row = rows.get(name, {"state": "waiting", "tries": 0})
        began = row.get("begun", time.time())
        seconds = row.get("seconds", time.time() - began)
        state, tries = row["state"], row["tries"]
        line = row.get("line", "")[:70] if state == "running" else ""
        lines.append(f"{name:<12} {state:<9} {tries:>5} {seconds:>8.1f}  {line}".rstrip())
    return "\n".join(lines)


class Driver:
    """Starts tasks, watches them and prints how far they are."""

    def __init__(self, arguments: argparse.Namespace, work: Work):
        self.arguments, self.work = arguments, work
        self.board = Board.remote()
        self.remote = ray.remote(task)

    def start(self, stage: str, name: str, memory: int):
        """Starts a task with its share of a machine."""
        asked = self.arguments
        return self.remote.options(
            name=name,
            num_cpus=asked.cpus,
            num_gpus=asked.gpus,
            memory=(asked.memory << 20) if asked.memory else memory,
            max_retries=asked.retries,
            retry_exceptions=[Ended],
        ).remote(self.work, stage, name, self.board)

    def finish(self, started: dict) -> list[str]:
        """Waits for tasks; the names of those that failed."""
        failed, shown = [], None
        waiting = dict(started)
        while waiting:
            done, _ = ray.wait(list(waiting.values()), timeout=self.arguments.every)
            rows = ray.get(self.board.read.remote())
            for name in [name for name, ref in waiting.items() if ref in done]:
                ref = waiting.pop(name)
                try:
                    ray.get(ref)
                except RayError as error:
                    cause = error.cause if isinstance(error, RayTaskError) else error
                    print(f"{name} failed: {cause}", file=sys.stderr)
                    failed.append(name)
                    rows.setdefault(name, {"tries": 0})["state"] = "failed"
            self.keep(rows)
            now = table(rows, list(started))
            if now != shown:
                print(f"\n{now}", flush=True)
                shown = now
        return failed

    def keep(self, rows: dict[str, dict]) -> None:
        """Lets others see what is going on."""
        if "://" not in self.work.job and Path(self.work.job).is_dir():
            path = Path(self.work.job) / LOGS / "board.json"
            path.parent.mkdir(exist_ok=True)
            part = path.with_suffix(".part")
            part.write_text(json.dumps(rows, indent=2) + "\n")
            part.replace(path)

    def run(self) -> list[str]:
        """All stages; the names of the tasks that failed."""
        failed = self.finish({"partition": self.start("partition", "partition", HOST_BYTES)})
        if failed:
            return failed
        store = Store(self.work.job, Path(self.work.scratch))
        store.fetch(["job.json"])
        job = json.loads((store.local / "job.json").read_text())
        room = job["coarse"]["memory"] + HOST_BYTES
        failed = self.finish({COARSE: self.start("fit", COARSE, room)})
        failed = failed or self.blocks("fit", job)
        if not self.arguments.one_round:
            failed = failed or self.finish({FIRST: self.start("first", FIRST, room)})
            failed = failed or self.blocks("settle", job)
        return failed or self.finish({MERGED: self.start("merge", MERGED, room)})

    def blocks(self, stage: str, job: dict) -> list[str]:
        """One stage of all blocks; the names of those that failed."""
        blocks = {}
        # The longest first: the others fill what is left.
        for block in sorted(job["blocks"], key=lambda block: -block["estimate"]["time"]):
            room = block["estimate"]["memory"] + HOST_BYTES
            blocks[block["name"]] = self.start(stage, block["name"], room)
        return self.finish(dict(sorted(blocks.items())))


def parsed() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("capture", help="COLMAP folder, or its URL")
    parser.add_argument("job", help="job folder to write or to go on with, or its URL")
    for stage in ["partition", "coarse", "fit", "colorize"]:
        text = "of the coarse model's `fit`" if stage == "coarse" else f"of `{stage}`"
        parser.add_argument(f"--{stage}", default="", metavar="OPTIONS", help=f"options {text}")
    parser.add_argument("--epochs", type=float, help="iterations of each block for each of its photos")
    parser.add_argument("--one-round", action="store_true", help="do not train blocks on among their neighbors")
    parser.add_argument("--teacher", help="color the merged scene by this network or folder")
    parser.add_argument("--address", help="a running Ray, such as auto or ray://HOST:10001")
    parser.add_argument("--cpus", type=float, default=1, help="processor cores of a block")
    parser.add_argument("--gpus", type=float, default=0, help="GPUs of a block, or a share of one")
    parser.add_argument("--memory", type=int, metavar="MIB", help="of a block [default: estimated]")
    parser.add_argument("--retries", type=int, default=5, help="of a block whose worker is lost")
    parser.add_argument("--every", type=float, default=5.0, metavar="S", help="between two tables")
    parser.add_argument("--scratch", default="/tmp/gs-chroma", help="a worker's folder, for URLs")
    parser.add_argument("--program", default="gs-chroma", help="on every machine")
    return parser.parse_args()


def main() -> None:
    arguments = parsed()
    local = lambda place: place if "://" in place else str(Path(place).resolve())  # noqa: E731
    stages = ["partition", "coarse", "fit", "colorize"]
    work = Work(
        capture=local(arguments.capture),
        job=local(arguments.job),
        scratch=arguments.scratch,
        program=arguments.program,
        teacher=arguments.teacher,
        epochs=arguments.epochs,
        options={stage: shlex.split(getattr(arguments, stage)) for stage in stages},
    )
    ray.init(
        address=arguments.address,
        log_to_driver=False,
        logging_level="ERROR",
        runtime_env={"env_vars": {"PYTHONPATH": str(ROOT / "tools")}},
    )
    failed = Driver(arguments, work).run()
    if failed:
        sys.exit(f"failed: {', '.join(failed)}; {LOGS}/ in the job's folder say why; the same command goes on")


if __name__ == "__main__":
    main()
