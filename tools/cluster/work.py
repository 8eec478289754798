"""The tasks of a job: what a worker does."""

from __future__ import annotations

import json
import os
import socket
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from . import program
from .storage import Store, move_capture, photos_of

COARSE = "coarse"
FIRST = "first"
MERGED = "merged"
LOGS = "logs"
CHECKPOINT_SECONDS = 30.0
FEWEST_ITERATIONS = 50


@dataclass(frozen=True)
class Work:
    """What there is to do; the same for all workers."""

    capture: str
    job: str
    scratch: str
    program: str
    teacher: str | None = None
    epochs: float | None = None
    options: dict[str, list[str]] = field(default_factory=dict)

    def stores(self) -> tuple[Store, Store]:
        """The capture and the job, as this worker has them."""
        scratch = Path(self.scratch)
        return Store(self.capture, scratch), Store(self.job, scratch)


Tell = Callable[..., None]


def partition(work: Work, tell: Tell) -> None:
    """Divides the capture, unless that is done."""
    capture, job = work.stores()
    if "job.json" in job.names(""):
        return
    capture.fetch(capture.names("sparse"))
    if not capture.shared:
        # It asks for photos to be there, and looks at none.
        for name in capture.names("images"):
            path = capture.local / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.touch()
    command = ["partition", str(capture.local), "-o", str(job.local)]
    start(work, job, "partition", command + work.options.get("partition", []), tell)
    job.put_folder("")


def fit(work: Work, name: str, tell: Tell) -> None:
    """Trains the coarse model or a block, or goes on where another worker ended."""
    capture, job = work.stores()
    here = set(job.names(name))
    if f"{name}/report.json" in here and f"{name}/checkpoint" not in here:
        return
    if is_merged(job, FIRST):  # A checkpoint is the second round's.
        return
    job.fetch(["job.json", f"{name}/block.json", f"{name}/checkpoint"])
    if name != COARSE:
        job.fetch([f"{COARSE}/report.json", f"{COARSE}/luma.ply"])
    fetch_capture(capture, photos_of(job, name))
    move_capture(job, capture.local)
    options = work.options.get("coarse" if name == COARSE else "fit", [])
    if work.epochs and name != COARSE:
        photos = json.loads((job.local / name / "block.json").read_text())["photos"]["train"]
        iterations = max(FEWEST_ITERATIONS, round(work.epochs * len(photos)))
        options = [*options, "--iterations", str(iterations)]
    command = ["fit", str(job.local / name), "--resume", *options]
    with job.keeping(f"{name}/checkpoint", CHECKPOINT_SECONDS):
        start(work, job, name, command, tell)
    job.put_folder(name)
    job.put([f"{name}/checkpoint"])


def settle(work: Work, name: str, tell: Tell) -> None:
    """Trains a block on, with what its neighbors had in its margin after the first round."""
    capture, job = work.stores()
    run = [f"{name}/{file}" for file in ["report.json", "luma.ply", "log.csv"]]
    job.fetch(["job.json", f"{name}/block.json", f"{name}/checkpoint", *run])
    if json.loads((job.local / name / "report.json").read_text())["luma"].get("around"):
        return
    job.fetch(f"{folder}/{file}" for folder in [COARSE, FIRST] for file in ["report.json", "luma.ply"])
    fetch_capture(capture, photos_of(job, name))
    move_capture(job, capture.local)
    around = ["--around", str(job.local / FIRST)]
    if (job.local / name / "checkpoint").is_file():  # Without one, a finished run has nothing to resume.
        around.append("--resume")
    with job.keeping(f"{name}/checkpoint", CHECKPOINT_SECONDS):
        start(work, job, name, ["fit", str(job.local / name), *around], tell)
    job.put_folder(name)
    job.put([f"{name}/checkpoint"])


def first(work: Work, tell: Tell) -> None:
    """Puts all blocks together for the second round, unless that is done."""
    _, job = work.stores()
    if not is_merged(job, FIRST):
        merged(work, FIRST, tell)
        job.put_folder(FIRST)


def is_merged(job: Store, name: str) -> bool:
    """Whether blocks were put together under this name."""
    return f"{name}/report.json" in job.names(name)


def merge(work: Work, tell: Tell) -> None:
    """Puts all blocks together, and colors the whole where there is a teacher."""
    job, run = merged(work, MERGED, tell)
    if work.teacher:
        options = ["--teacher", work.teacher, *work.options.get("colorize", [])]
        start(work, job, MERGED, ["colorize", str(run), *options], tell)
    job.put_folder(MERGED)


def merged(work: Work, name: str, tell: Tell) -> tuple[Store, Path]:
    """The job, and the run of all blocks."""
    capture, job = work.stores()
    job.fetch(["job.json"])
    blocks = [block["name"] for block in json.loads((job.local / "job.json").read_text())["blocks"]]
    for block in [COARSE, *blocks]:
        files = ["block.json", "report.json", "luma.ply", "log.csv"]
        job.fetch(f"{block}/{file}" for file in files)
    fetch_capture(capture, photos_of(job, COARSE))
    move_capture(job, capture.local)
    run = job.local / name
    start(work, job, name, ["merge", str(job.local), "-o", str(run)], tell)
    return job, run


def fetch_capture(capture: Store, photos: list[str]) -> None:
    """The model, and some of the photos with their masks."""
    if not capture.shared:
        capture.fetch(capture.names("sparse"))
        capture.fetch(f"images/{photo}" for photo in photos)
        stems = {photo.rpartition(".")[0] for photo in photos} | set(photos)
        masks = capture.names("masks")
        capture.fetch(m for m in masks if m.removeprefix("masks/").removesuffix(".png") in stems)


def start(work: Work, job: Store, name: str, command: list[str], tell: Tell) -> None:
    """Runs gs-chroma; what it says goes to the job's logs."""
    tell(state="running", worker=os.getpid(), node=socket.gethostname(), line=command[0])
    log = job.local / LOGS / f"{name}.log"
    try:
        program.run([work.program, *command], log, lambda line: tell(line=line))
    finally:
        job.put([f"{LOGS}/{name}.log"])
