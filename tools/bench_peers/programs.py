"""How gs-chroma and its peers are called, and where they leave what they made.

Options are those in the sources of Brush 1.0.0, gsplat 1.6.0 and OpenSplat 1.1.5.
"""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from bench_peers.command import Problem, run
from bench_peers.photos import HOLDOUT_STEP


@dataclass
class Task:
    """What every program is asked to do with the photos below `gray`."""

    gray: Path
    side: int
    iterations: int
    max_splats: int
    sh_degree: int
    held: str
    seed: int = 0


class Program:
    """gs-chroma or a peer; `out` is always the folder of one round."""

    name: str

    def __init__(self, words: list[str], task: Task) -> None:
        if not words or shutil.which(words[0]) is None:
            raise Problem(f"{self.name}: no program {words[0] if words else 'given'}")
        self.words, self.task = words, task

    def command(self, out: Path) -> list[str]:
        """What trains, and leaves a splat file."""
        raise NotImplementedError

    def scene(self, out: Path) -> Path:
        """The splat file, in COLMAP's coordinates."""
        return out / "scene.ply"

    def training(self, _out: Path) -> float | None:
        """Seconds of training alone, where the program says so."""
        return None

    def version_command(self) -> list[str]:
        return [*self.words, "--version"]

    def version(self) -> str:
        found = re.search(r"\d+\.\d+[\w.+-]*", printed(self.version_command()))
        return found[0] if found else ""


def printed(command: list[str]) -> str:
    """What a command prints, or nothing."""
    try:
        return subprocess.run(command, capture_output=True, text=True, timeout=60, check=False).stdout
    except (OSError, subprocess.TimeoutExpired):
        return ""


class Chroma(Program):
    name = "gs-chroma"

    def command(self, out: Path) -> list[str]:
        task = self.task
        return [
            *self.words, "fit", str(task.gray / "train"), "-o", str(out / "run"), "--no-holdout",
            "--iterations", str(task.iterations), "--max-side", str(task.side),
            "--max-splats", str(task.max_splats), "--sh-degree", str(task.sh_degree),
            "--seed", str(task.seed),
        ]  # fmt: skip

    def scene(self, out: Path) -> Path:
        """Exported: the run's own file may have its origin elsewhere."""
        path = out / "scene.ply"
        run([*self.words, "export", str(out / "run"), "--luma", "-o", str(path)], out / "export")
        return path

    def render(self, scene: Path, views: Path) -> None:
        """Draws the held-out views of a splat file into a folder."""
        held = str(self.task.gray / "held")
        command = [*self.words, "render", str(scene), "--colmap", held, "--views", "all", "--luma"]
        run([*command, "-o", str(views)], views.parent / "render")

    def report(self, out: Path) -> dict[str, Any]:
        return json.loads((out / "run" / "report.json").read_text())

    def training(self, out: Path) -> float | None:
        return self.report(out)["luma"]["seconds"]["train"]


class Brush(Program):
    """`brush`, `brush-cli` or an older `brush_app`: given a folder, none of them opens a window."""

    name = "Brush"

    def __init__(self, words: list[str], task: Task) -> None:
        super().__init__(words, task)
        # 0.3.0 has another name for it.
        old = "--total-steps" in printed([*words, "--help"])
        self.iterations = "--total-steps" if old else "--total-train-iters"

    def command(self, out: Path) -> list[str]:
        task = self.task
        return [
            *self.words, str(task.gray / "train"), self.iterations, str(task.iterations),
            "--max-resolution", str(task.side), "--max-splats", str(task.max_splats),
            "--sh-degree", str(task.sh_degree), "--export-every", str(task.iterations),
            "--export-path", str(out), "--export-name", "scene.ply", "--seed", str(task.seed),
        ]  # fmt: skip

    def training(self, out: Path) -> float | None:
        log = (out / "train.out").read_text(errors="replace")
        took = re.search(r"Done training! Took\D*([\d.]+)s", log)
        return float(took[1]) if took else None


class Gsplat(Program):
    """gsplat's example trainer: Python and the script, with the one strategy that has a cap."""

    name = "gsplat"

    def __init__(self, words: list[str], task: Task) -> None:
        super().__init__(words, task)
        if task.held != "eighth":
            raise Problem("gsplat's trainer holds out every eighth photo and no other")
        if not Path(words[-1]).is_file():
            raise Problem(f"{self.name}: no script {words[-1]}")

    def command(self, out: Path) -> list[str]:
        task = self.task
        return [
            *self.words, "mcmc", "--data_dir", str(task.gray / "all"), "--data_factor", "1",
            "--test_every", str(HOLDOUT_STEP), "--result_dir", str(out),
            "--max_steps", str(task.iterations), "--strategy.cap-max", str(task.max_splats),
            "--sh_degree", str(task.sh_degree), "--no-normalize-world-space", "--save_ply",
            "--eval_steps", "-1", "--disable_viewer", "--disable_video",
        ]  # fmt: skip

    def scene(self, out: Path) -> Path:
        return out / "ply" / f"point_cloud_{self.task.iterations - 1}.ply"

    def training(self, out: Path) -> float | None:
        path = out / "stats" / f"train_step{self.task.iterations - 1:04d}_rank0.json"
        return json.loads(path.read_text())["ellipse_time"] if path.is_file() else None

    def version_command(self) -> list[str]:
        return [*self.words[:-1], "-c", "from importlib.metadata import version; print(version('gsplat'))"]


class OpenSplat(Program):
    name = "OpenSplat"

    def command(self, out: Path) -> list[str]:
        task = self.task
        return [
            *self.words, str(task.gray / "train"), "--output", str(self.scene(out)), "--keep-crs",
            "--num-iters", str(task.iterations), "--sh-degree", str(task.sh_degree),
            # At its default of 2, iterations before the 6,000th see smaller photos.
            "--num-downscales", "0",
        ]  # fmt: skip
