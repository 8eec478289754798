"""Trains once, and measures the splat file on the held-out views."""

from __future__ import annotations

import shutil
import statistics
from dataclasses import astuple, dataclass
from pathlib import Path

import numpy as np
from PIL import Image

from bench_peers.command import Problem, run
from bench_peers.programs import Chroma, Program

# Side and standard deviation of the windows of SSIM, and its constants for values up to 1.
WINDOW, SIGMA = 11, 1.5
C1, C2 = 0.01**2, 0.03**2


@dataclass
class Result:
    """One round of one program, or the medians of several."""

    seconds: float
    training: float | None
    splats: float
    psnr: float
    corrected_psnr: float
    ssim: float


def median(results: list[Result]) -> Result:
    """Of each value by itself."""
    columns = zip(*map(astuple, results), strict=True)
    return Result(*(None if None in column else statistics.median(column) for column in columns))


def one_round(program: Program, renderer: Chroma, held_out: list[str], out: Path) -> Result:
    """Trains in a fresh folder, then draws and measures the held-out views."""
    shutil.rmtree(out, ignore_errors=True)
    out.mkdir(parents=True)
    seconds = run(program.command(out), out / "train")
    scene, views = program.scene(out), out / "views"
    if not scene.is_file():
        raise Problem(f"wrote no {scene.name}")
    renderer.render(scene, views)
    truths = program.task.gray / "all" / "images"
    pairs = [(load(views / name), load(truths / name)) for name in held_out]
    return Result(
        seconds=seconds,
        training=program.training(out),
        splats=splat_count(scene),
        psnr=statistics.mean(psnr(*pair) for pair in pairs),
        corrected_psnr=statistics.mean(psnr(corrected(*pair), pair[1]) for pair in pairs),
        ssim=statistics.mean(ssim(*pair) for pair in pairs),
    )


def splat_count(scene: Path) -> int:
    with scene.open("rb") as file:
        for line in iter(file.readline, b"end_header\n"):
            if line.startswith(b"element vertex "):
                return int(line.split()[2])
            if not line:
                break
    raise Problem(f"{scene.name} does not say how many Gaussians it holds")


def load(path: Path) -> np.ndarray:
    """A gray picture, 0 to 1."""
    with Image.open(path) as file:
        return np.asarray(file.convert("L")) / 255


def psnr(image: np.ndarray, truth: np.ndarray) -> float:
    """In dB; 100 for pictures without a difference."""
    return -10 * float(np.log10(max(np.mean((image - truth) ** 2), 1e-10)))


def corrected(image: np.ndarray, truth: np.ndarray) -> np.ndarray:
    """The picture after the gain and offset that bring it closest to the photo."""
    centered = image - image.mean()
    variance = np.mean(centered**2)
    gain = np.mean(centered * (truth - truth.mean())) / variance if variance > 0 else 1.0
    return np.clip(gain * centered + truth.mean(), 0, 1)


def ssim(image: np.ndarray, truth: np.ndarray) -> float:
    """Wang et al. (2004), over the windows that lie inside the picture."""
    weights = np.exp(-0.5 * ((np.arange(WINDOW) - WINDOW // 2) / SIGMA) ** 2)
    weights /= weights.sum()

    def blur(values: np.ndarray) -> np.ndarray:
        for axis in (0, 1):
            values = np.lib.stride_tricks.sliding_window_view(values, WINDOW, axis) @ weights
        return values

    a, b = blur(image), blur(truth)
    variances = blur(image**2) - a**2 + blur(truth**2) - b**2
    covariance = blur(image * truth) - a * b
    similarity = (2 * a * b + C1) * (2 * covariance + C2) / ((a**2 + b**2 + C1) * (variances + C2))
    return float(similarity.mean())
