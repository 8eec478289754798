"""Training pictures: random gardens, and random crops of them as gray input and a, b target."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray
from PIL import Image

import lab

SIDE = 256
RENDER_SIZE = (288, 192)
RENDER_SAMPLES = 12
VIEWS_PER_SCENE = 4


def render_scenes(folder: Path, first: int, count: int) -> None:
    """Renders `count` random gardens, `VIEWS_PER_SCENE` views each; pictures already there stay."""
    from demo_scene import cameras, layout, stage  # Blender takes seconds to import.

    for seed in range(first, first + count):
        views = cameras.random_cameras(seed, VIEWS_PER_SCENE)
        if all((folder / f"{view.name}.png").exists() for view in views):
            continue
        exposure = float(np.random.default_rng([5, seed]).uniform(-0.5, 0.4))
        stage.build(layout.random_layout(seed))
        stage.settings(*RENDER_SIZE, RENDER_SAMPLES, exposure)
        stage.shoot(views, folder)


def load(path: Path) -> NDArray[np.float64]:
    """A picture as sRGB (H, W, 3) in [0, 1]."""
    return np.asarray(Image.open(path).convert("RGB"), dtype=np.float64) / 255


def planes(rgb: NDArray[np.float64]) -> torch.Tensor:
    """Gray in [0, 1], made from L*, and the true a, b, as (3, H, W)."""
    values = lab.rgb_to_lab(rgb)
    values[..., 0] = lab.lightness_to_gray(values[..., 0])
    return torch.from_numpy(np.ascontiguousarray(values.transpose(2, 0, 1))).float()


def crop(picture: torch.Tensor, rng: np.random.Generator) -> torch.Tensor:
    """A random part (55 to 100 % of a side), mirrored half of the time, stretched to a square.

    Stretched, since that is how a picture of any shape meets DDColor's input.
    """
    _, height, width = picture.shape
    share = rng.uniform(0.55, 1.0)
    tall, wide = (
        int(n * np.clip(share * rng.uniform(0.92, 1.08), 0.5, 1)) for n in (height, width)
    )
    top, left = rng.integers(0, height - tall + 1), rng.integers(0, width - wide + 1)
    part = picture[:, top : top + tall, left : left + wide]
    if rng.random() < 0.5:
        part = part.flip(2)
    return torch.nn.functional.interpolate(part[None], size=(SIDE, SIDE), mode="bilinear")[0]


def batch(
    pictures: list[torch.Tensor], size: int, rng: np.random.Generator
) -> tuple[torch.Tensor, torch.Tensor]:
    """Random crops as (B, 1, 256, 256) and (B, 2, 256, 256); the gray's contrast varies."""
    crops = torch.stack(
        [crop(pictures[index], rng) for index in rng.integers(0, len(pictures), size)]
    )
    contrast = torch.from_numpy(np.exp(rng.normal(0, 0.12, (size, 1, 1, 1)))).float()
    return crops[:, :1].clamp(1e-4, 1) ** contrast, crops[:, 1:]
