#!/usr/bin/env python3
"""Trains one scene with gs-chroma and with its peers, and prints time and quality side by side.

    python3 tools/bench_peers.py ../shared/data/tiny-brighton --side 320 --iterations 1000 \\
        --max-splats 10000 --rounds 3 --brush path/to/brush -o target/peers

Any of --brush, --gsplat "python path/to/simple_trainer.py" and --opensplat may be given or not.
What is done for fairness:

- All read the same photos: 8-bit gray with the L* of the colour, scaled here, with the cameras and
  the points' colours in COLMAP's model changed to match.
- Every 8th photo by name is held out. Programs train on a folder without these photos, so that none
  spends time on measuring. gsplat holds photos out whether told to or not: it gets the whole folder,
  of which it leaves out the same ones, and does not measure.
- Iterations, degree of spherical harmonics and cap on Gaussians are the same, but OpenSplat has no
  cap. All else is as each program has it, except that OpenSplat's first 6,000 iterations would be at
  a lower resolution.
- Programs take turns, so that a machine that slows down slows all of them. Medians are reported.
- `gs-chroma render` draws the held-out views of every program's splat file, and one measure rates them.

Seconds are those of the whole command, from start to exit; those of training are the program's own
word, in whole seconds from Brush. A program's first round may include compiling its kernels.

Needs numpy and Pillow. results.json, and a log of every command, go below the output folder.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import re
import shlex
import shutil
import statistics
import struct
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from PIL import Image

from lab import RGB_TO_XYZ, decode, encode

HOLDOUT_STEP = 8

# COLMAP's names of camera models by their numbers, as far as gs-chroma takes them, and their parameters.
CAMERA_MODELS = [("SIMPLE_PINHOLE", 3), ("PINHOLE", 4)]

# A photo's aspect may differ from its camera's by so much, as in gs-chroma.
ASPECT_SLACK = 0.01


class Problem(Exception):
    """What ends the benchmark, or one program's part in it, in a line."""


# --- COLMAP's model -------------------------------------------------------------------------------


class Camera(NamedTuple):
    """A PINHOLE camera in COLMAP's order."""

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float

    @classmethod
    def read(cls, width: int, height: int, values: Sequence[float]) -> Camera:
        """From the parameters of either pinhole model; the simple one has a single focal length."""
        return cls(width, height, values[0], values[-3], values[-2], values[-1])

    def fitted(self, longer: int) -> Camera:
        """The same view with a longer side of so many pixels."""
        scale = longer / max(self.width, self.height)
        width, height = max(1, round(self.width * scale)), max(1, round(self.height * scale))
        x, y = width / self.width, height / self.height
        return Camera(width, height, self.fx * x, self.fy * y, self.cx * x, self.cy * y)


class Shot(NamedTuple):
    """A photo's pose (quaternion and translation), the number of its camera, and its name."""

    pose: tuple[float, ...]
    camera: int
    name: str


@dataclass
class Model:
    """What the three files of a model say, without the 2D observations, which no trainer needs."""

    cameras: dict[int, Camera]
    shots: list[Shot]
    positions: list[tuple[float, ...]]
    colors: list[tuple[int, ...]]

    def write(self, folder: Path) -> None:
        """In binary, the only form that OpenSplat reads."""
        folder.mkdir(parents=True)
        parts = [struct.pack("<Q", len(self.cameras))]
        parts += [struct.pack("<IiQQ4d", number, 1, *camera) for number, camera in self.cameras.items()]
        (folder / "cameras.bin").write_bytes(b"".join(parts))
        parts = [struct.pack("<Q", len(self.shots))]
        for number, shot in enumerate(self.shots, 1):
            parts += [struct.pack("<I7dI", number, *shot.pose, shot.camera), shot.name.encode()]
            parts += [b"\0", struct.pack("<Q", 0)]
        (folder / "images.bin").write_bytes(b"".join(parts))
        parts = [struct.pack("<Q", len(self.positions))]
        for number, point in enumerate(zip(self.positions, self.colors, strict=True), 1):
            parts.append(struct.pack("<Q3d3BdQ", number, *point[0], *point[1], 0.0, 0))
        (folder / "points3D.bin").write_bytes(b"".join(parts))


class Binary:
    """Takes numbers from a little-endian file, one after the other."""

    def __init__(self, path: Path) -> None:
        self.path, self.data, self.at = path, path.read_bytes(), 0

    def take(self, layout: str) -> tuple[Any, ...]:
        try:
            values = struct.unpack_from("<" + layout, self.data, self.at)
        except struct.error:
            raise Problem(f"{self.path} ends too early") from None
        self.at += struct.calcsize("<" + layout)
        return values

    def count(self) -> range:
        return range(self.take("Q")[0])

    def text(self) -> str:
        """Up to the next zero byte."""
        begin, self.at = self.at, self.data.find(b"\0", self.at) + 1
        return self.data[begin : self.at - 1].decode()


def read_binary(folder: Path) -> Model:
    model = Model({}, [], [], [])
    file = Binary(folder / "cameras.bin")
    for _ in file.count():
        number, kind, width, height = file.take("IiQQ")
        if not 0 <= kind < len(CAMERA_MODELS):
            raise Problem(f"camera {number} is no pinhole; run COLMAP's image_undistorter")
        values = file.take(f"{CAMERA_MODELS[kind][1]}d")
        model.cameras[number] = Camera.read(width, height, values)
    file = Binary(folder / "images.bin")
    for _ in file.count():
        *_, camera = (_, *pose, _) = file.take("I7dI")
        model.shots.append(Shot(tuple(pose), camera, file.text()))
        file.at += 24 * file.take("Q")[0]
    file = Binary(folder / "points3D.bin")
    for _ in file.count():
        point = file.take("Q3d3Bd")
        model.positions.append(point[1:4])
        model.colors.append(point[4:7])
        file.at += 8 * file.take("Q")[0]
    return model


def read_text(folder: Path) -> Model:
    def rows(name: str) -> list[str]:
        return [row for row in (folder / name).read_text().splitlines() if not row.startswith("#")]

    model = Model({}, [], [], [])
    for row in filter(str.strip, rows("cameras.txt")):
        number, kind, width, height, *values = row.split()
        if (kind, len(values)) not in CAMERA_MODELS:
            raise Problem(f"camera {number} has the model {kind}; run COLMAP's image_undistorter")
        model.cameras[int(number)] = Camera.read(int(width), int(height), [float(v) for v in values])
    # Every second line holds the 2D observations, and may be empty.
    for row in filter(str.strip, rows("images.txt")[::2]):
        _, *pose, camera, name = row.split(maxsplit=9)
        model.shots.append(Shot(tuple(float(v) for v in pose), int(camera), name.strip()))
    for row in filter(str.strip, rows("points3D.txt")):
        values = row.split()
        model.positions.append(tuple(float(v) for v in values[1:4]))
        model.colors.append(tuple(int(v) for v in values[4:7]))
    return model


def read_model(colmap: Path) -> Model:
    for folder in (colmap / "sparse" / "0", colmap / "sparse", colmap):
        for name, read in (("cameras.bin", read_binary), ("cameras.txt", read_text)):
            if (folder / name).is_file():
                return read(folder)
    raise Problem(f"{colmap} holds no COLMAP model")


# --- The photos that all programs get -------------------------------------------------------------


def to_gray(rgb: Any) -> Any:
    """8-bit gray with the L* of 8-bit colours, as the program does it: equal L* is equal luminance."""
    return np.rint(255 * encode(decode(np.asarray(rgb) / 255) @ RGB_TO_XYZ[1])).astype(np.uint8)


def copy_gray(colmap: Path, gray: Path, side: int) -> list[str]:
    """Writes the folders `all` and `train` of gray photos and models; gives the held-out names."""
    model = read_model(colmap)
    cameras: dict[int, Camera] = {}
    shots: list[Shot] = []
    for shot in sorted(model.shots, key=lambda shot: shot.name):
        with Image.open(colmap / "images" / shot.name) as file:
            photo = file.convert("RGB")
        camera = model.cameras[shot.camera]
        aspect = photo.width / photo.height * camera.height / camera.width
        if abs(aspect - 1) > ASPECT_SLACK:
            raise Problem(f"{shot.name} has another aspect than its camera")
        camera = cameras.setdefault(shot.camera, camera.fitted(min(side, max(photo.size))))
        small = photo.resize((camera.width, camera.height), Image.Resampling.LANCZOS)
        name = str(Path(shot.name).with_suffix(".png"))
        path = gray / "all" / "images" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        # Three equal channels: not every program reads a gray file.
        Image.fromarray(to_gray(small)).convert("RGB").save(path)
        shots.append(shot._replace(name=name))
    colors = [(int(v),) * 3 for v in to_gray(model.colors)]
    held_out = [shot.name for shot in shots[::HOLDOUT_STEP]]
    train = [shot for shot in shots if shot.name not in held_out]
    for shot in train:
        path = gray / "train" / "images" / shot.name
        path.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(gray / "all" / "images" / shot.name, path)
    Model(cameras, shots, model.positions, colors).write(gray / "all" / "sparse" / "0")
    Model(cameras, train, model.positions, colors).write(gray / "train" / "sparse" / "0")
    return held_out


# --- The programs ---------------------------------------------------------------------------------


@dataclass
class Task:
    """What every program is asked to do."""

    gray: Path
    iterations: int
    side: int
    max_splats: int
    sh_degree: int


def run(command: list[str], log: Path) -> float:
    """Wall seconds of a command, whose output goes to `log`.out and `log`.err."""
    # Brush says only here how long it trained.
    environment = {**os.environ, "RUST_LOG": "brush_cli=info"}
    errors = log.with_suffix(".err")
    with log.with_suffix(".out").open("wb") as out, errors.open("wb") as err:
        begun = time.monotonic()
        try:
            done = subprocess.run(
                command, stdin=subprocess.DEVNULL, stdout=out, stderr=err, env=environment
            )
        except OSError as error:
            raise Problem(f"{command[0]}: {error.strerror}") from None
        seconds = time.monotonic() - begun
    if done.returncode != 0:
        lines = errors.read_text(errors="replace").split("\n")
        last = next((line.strip() for line in reversed(lines) if line.strip()), "nothing on stderr")
        raise Problem(f"exit code {done.returncode}: {last}")
    return seconds


class Program:
    """gs-chroma or a peer; `out` is always the folder of one round."""

    name: str

    def __init__(self, words: list[str], task: Task) -> None:
        if shutil.which(words[0]) is None:
            raise Problem(f"{self.name}: no program {words[0]}")
        self.words, self.task = words, task

    def command(self, out: Path) -> list[str]:
        """What trains, and leaves a splat file."""
        raise NotImplementedError

    def scene(self, out: Path) -> Path:
        """The splat file, in COLMAP's coordinates."""
        raise NotImplementedError

    def training(self, out: Path) -> float | None:
        """Seconds of training alone, where the program says so."""
        return None

    def asked_version(self) -> list[str]:
        """What prints the version."""
        return [*self.words, "--version"]

    def version(self) -> str:
        try:
            done = subprocess.run(self.asked_version(), capture_output=True, text=True, timeout=60)
        except (OSError, subprocess.TimeoutExpired):
            return ""
        found = re.search(r"\d+\.\d+[\w.+-]*", done.stdout)
        return found[0] if found else ""


class Chroma(Program):
    name = "gs-chroma"

    def command(self, out: Path) -> list[str]:
        task = self.task
        return [
            *self.words, "fit", str(task.gray / "train"), "-o", str(out / "run"), "--no-holdout",
            "--iterations", str(task.iterations), "--max-side", str(task.side),
            "--max-splats", str(task.max_splats), "--sh-degree", str(task.sh_degree),
        ]  # fmt: skip

    def report(self, out: Path) -> dict[str, Any]:
        return json.loads((out / "run" / "report.json").read_text())

    def scene(self, out: Path) -> Path:
        """Exported: a run's own file may have its origin elsewhere."""
        path = out / "scene.ply"
        run([*self.words, "export", str(out / "run"), "--luma", "-o", str(path)], out / "export")
        return path

    def training(self, out: Path) -> float:
        return self.report(out)["luma"]["seconds"]["train"]


class Brush(Program):
    """`brush` (brush_app in older releases) or `brush-cli`: given a folder, both train without a window."""

    name = "Brush"

    def __init__(self, words: list[str], task: Task) -> None:
        super().__init__(words, task)
        # Up to 0.3.0 this option had another name.
        known = subprocess.run([*words, "--help"], capture_output=True, text=True).stdout
        self.iterations = "--total-steps" if "--total-steps" in known else "--total-train-iters"

    def command(self, out: Path) -> list[str]:
        task = self.task
        return [
            *self.words, str(task.gray / "train"), self.iterations, str(task.iterations),
            "--max-resolution", str(task.side), "--max-splats", str(task.max_splats),
            "--sh-degree", str(task.sh_degree), "--export-every", str(task.iterations),
            "--export-path", str(out), "--export-name", "scene.ply",
        ]  # fmt: skip

    def scene(self, out: Path) -> Path:
        return out / "scene.ply"

    def training(self, out: Path) -> float | None:
        took = re.search(r"Done training! Took\D*([\d.]+)s", (out / "train.out").read_text(errors="replace"))
        return float(took[1]) if took else None


class Gsplat(Program):
    """gsplat's example trainer with the strategy that has a cap; as Python and the script's path."""

    name = "gsplat"

    def __init__(self, words: list[str], task: Task) -> None:
        super().__init__(words, task)
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
        stats = out / "stats" / f"train_step{self.task.iterations - 1:04d}_rank0.json"
        return json.loads(stats.read_text())["ellipse_time"] if stats.is_file() else None

    def asked_version(self) -> list[str]:
        return [*self.words[:-1], "-c", "from importlib.metadata import version; print(version('gsplat'))"]


class OpenSplat(Program):
    name = "OpenSplat"

    def command(self, out: Path) -> list[str]:
        task = self.task
        return [
            *self.words, str(task.gray / "train"), "-o", str(self.scene(out)), "-n", str(task.iterations),
            "--sh-degree", str(task.sh_degree), "--num-downscales", "0", "--keep-crs",
        ]  # fmt: skip

    def scene(self, out: Path) -> Path:
        return out / "scene.ply"


# --- Measuring ------------------------------------------------------------------------------------


@dataclass
class Result:
    """One round of one program."""

    seconds: float
    training: float | None
    splats: int
    psnr: float
    ssim: float


def splat_count(scene: Path) -> int:
    with scene.open("rb") as file:
        for line in file:
            if line.startswith(b"element vertex "):
                return int(line.split()[2])
            if line.startswith(b"end_header"):
                break
    raise Problem(f"{scene.name} names no number of Gaussians")


def psnr(image: Any, truth: Any) -> float:
    return -10 * float(np.log10(max(np.mean((image - truth) ** 2), 1e-10)))


def ssim(image: Any, truth: Any) -> float:
    """Wang et al. (2004): Gaussian windows of 11 x 11 and sigma 1.5 that lie inside the image."""
    window = np.exp(-0.5 * (np.arange(-5, 6) / 1.5) ** 2)
    window /= window.sum()

    def blur(values: Any) -> Any:
        rows = np.lib.stride_tricks.sliding_window_view(values, 11, axis=0) @ window
        return np.lib.stride_tricks.sliding_window_view(rows, 11, axis=1) @ window

    a, b = blur(image), blur(truth)
    variances = blur(image**2) - a**2 + blur(truth**2) - b**2
    covariance = blur(image * truth) - a * b
    c1, c2 = 0.01**2, 0.03**2
    similarity = (2 * a * b + c1) * (2 * covariance + c2) / ((a**2 + b**2 + c1) * (variances + c2))
    return float(similarity.mean())


def one_round(program: Program, renderer: Program, held_out: list[str], out: Path) -> Result:
    """Trains in a fresh folder, then draws and measures the held-out views."""
    shutil.rmtree(out, ignore_errors=True)
    out.mkdir(parents=True)
    seconds = run(program.command(out), out / "train")
    scene = program.scene(out)
    if not scene.is_file():
        raise Problem(f"wrote no {scene.name}")
    whole, views = program.task.gray / "all", out / "views"
    command = [*renderer.words, "render", str(scene), "--colmap", str(whole), "--views", "test", "--luma"]
    run([*command, "-o", str(views)], out / "render")

    def load(path: Path) -> Any:
        with Image.open(path) as file:
            return np.asarray(file.convert("L")) / 255

    pairs = [(load(views / name), load(whole / "images" / name)) for name in held_out]
    return Result(
        seconds=seconds,
        training=program.training(out),
        splats=splat_count(scene),
        psnr=statistics.mean(psnr(*pair) for pair in pairs),
        ssim=statistics.mean(ssim(*pair) for pair in pairs),
    )


def median(results: list[Result]) -> Result:
    """Of every value on its own."""
    columns = zip(*(asdict(result).values() for result in results), strict=True)
    return Result(*(None if None in column else statistics.median(column) for column in columns))


# --- The benchmark --------------------------------------------------------------------------------


def processor() -> str:
    try:
        found = re.search(r"^model name\s*:\s*(.+)$", Path("/proc/cpuinfo").read_text(), re.MULTILINE)
    except OSError:
        found = None
    return found[1] if found else platform.processor() or platform.machine()


def table(rows: dict[str, Result], versions: dict[str, str]) -> str:
    ours = next(iter(rows.values()))
    lines = ["| program | seconds | ratio | training | Gaussians | PSNR | SSIM |", "|---|---|---|---|---|---|---|"]
    for name, row in rows.items():
        training = "–" if row.training is None else f"{row.training:.1f} s"
        lines.append(
            f"| {name} {versions[name]} | {row.seconds:.1f} s | {row.seconds / ours.seconds:.2f} | {training}"
            f" | {row.splats:.0f} | {row.psnr:.2f} dB | {row.ssim:.3f} |"
        )
    return "\n".join(lines)


def benchmark(arguments: argparse.Namespace) -> None:
    output: Path = arguments.output.resolve()
    if not (arguments.colmap / "images").is_dir():
        raise Problem(f"{arguments.colmap} holds no images/ folder")
    gray = output / "gray"
    task = Task(gray, arguments.iterations, arguments.side, arguments.max_splats, arguments.sh_degree)
    ours = Chroma([arguments.program], task)
    programs: list[Program] = [ours]
    if arguments.brush:
        programs.append(Brush([arguments.brush], task))
    if arguments.gsplat:
        programs.append(Gsplat(shlex.split(arguments.gsplat), task))
    if arguments.opensplat:
        programs.append(OpenSplat([arguments.opensplat], task))
    versions = {program.name: program.version() for program in programs}
    shutil.rmtree(gray, ignore_errors=True)
    held_out = copy_gray(arguments.colmap, gray, arguments.side)

    results: dict[str, list[Result]] = {program.name: [] for program in programs}
    failures: dict[str, str] = {}
    for number in range(1, arguments.rounds + 1):
        for program in [program for program in programs if program.name not in failures]:
            where = f"round {number}, {program.name}"
            try:
                result = one_round(program, ours, held_out, output / program.name / f"round-{number}")
            except Problem as problem:
                if program is ours:
                    raise Problem(f"{where}: {problem}") from None
                failures[program.name] = f"{where}: {problem}"
                print(failures[program.name], file=sys.stderr)
                continue
            results[program.name].append(result)
            print(f"{where}: {result.seconds:.1f} s, {result.psnr:.2f} dB", file=sys.stderr)

    rows = {name: median(done) for name, done in results.items() if name not in failures}
    machine = {
        "processor": processor(),
        "cores": os.cpu_count(),
        "device": ours.report(output / ours.name / "round-1")["device"]["name"],
        "system": platform.platform(),
    }
    print(table(rows, versions))
    for failure in failures.values():
        print(f"\nLeft out: {failure}")
    print(
        f"\n{arguments.colmap.resolve().name}, {arguments.side} pixels, {arguments.iterations} iterations, at most"
        f" {arguments.max_splats} Gaussians, SH degree {arguments.sh_degree}; median of {arguments.rounds} rounds"
        f" in turn; {len(held_out)} held-out views.\n"
        f"{machine['processor']}, {machine['cores']} cores; {machine['device']}."
    )
    everything = {
        "scene": arguments.colmap.resolve().name,
        "settings": {key: getattr(task, key) for key in ("iterations", "side", "max_splats", "sh_degree")},
        "held_out": held_out,
        "machine": machine,
        "versions": versions,
        "commands": {program.name: program.command(output / program.name / "round-1") for program in programs},
        "rounds": {name: [asdict(result) for result in done] for name, done in results.items()},
        "medians": {name: asdict(row) for name, row in rows.items()},
        "ratios": {name: row.seconds / rows[ours.name].seconds for name, row in rows.items()},
        "failures": failures,
    }
    (output / "results.json").write_text(json.dumps(everything, indent=2) + "\n")


def positive(text: str) -> int:
    value = int(text)
    if value < 1:
        raise ValueError
    return value


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("colmap", type=Path, metavar="COLMAP_DIR")
    parser.add_argument("--side", type=positive, default=320, help="longer side of the photos in pixels")
    parser.add_argument("--iterations", type=positive, default=1000)
    parser.add_argument("--max-splats", type=positive, default=10_000)
    parser.add_argument("--sh-degree", type=int, choices=range(4), default=3)
    parser.add_argument("--rounds", type=positive, default=3)
    parser.add_argument("--program", default="target/release/gs-chroma")
    parser.add_argument("--brush", metavar="PROGRAM")
    parser.add_argument("--gsplat", metavar="COMMAND", help="Python and the path of simple_trainer.py")
    parser.add_argument("--opensplat", metavar="PROGRAM")
    parser.add_argument("-o", "--output", type=Path, default=Path("target/peers"))
    try:
        benchmark(parser.parse_args())
    except Problem as problem:
        print(f"error: {problem}", file=sys.stderr)
        return 1
    except OSError as error:
        print(f"error: {error.filename}: {error.strerror}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
