"""Fits the network: smooth L1 on a, b with rare colors counted more."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
import torch

from . import data
from .network import Network

BIN = 10.0  # Lab units; the side of one cell of the color histogram.
HALF_BINS = 11
UNIFORM_SHARE = 0.5  # Zhang et al. 2016: mix the histogram with a uniform one before inverting.
MOST_WEIGHT = 8.0  # A few stray pixels must not steer the network.
RATE = 4e-3


def cell(chroma: torch.Tensor) -> torch.Tensor:
    """The histogram cell of each a, b (B, 2, H, W), as (B, H, W) indices."""
    side = 2 * HALF_BINS
    index = (chroma / BIN + HALF_BINS).floor().clamp(0, side - 1).long()
    return index[:, 0] * side + index[:, 1]


def cell_weights(pictures: list[torch.Tensor]) -> torch.Tensor:
    """One weight per histogram cell, of mean 1 over the pixels of `pictures`."""
    counts = torch.zeros((2 * HALF_BINS) ** 2)
    for picture in pictures:
        counts += torch.bincount(cell(picture[None, 1:]).ravel(), minlength=len(counts))
    share = counts / counts.sum()
    used = (share > 0).sum()
    weights = 1 / ((1 - UNIFORM_SHARE) * share + UNIFORM_SHARE / used)
    return weights / (share * weights).sum()


def fit(
    network: Network, pictures: list[torch.Tensor], iterations: int, size: int, seed: int,
    say: Callable[[str], None],
) -> None:  # fmt: skip
    """Trains in place with Adam and a one-cycle rate."""
    rng = np.random.default_rng(seed)
    weights = cell_weights(pictures)
    optimizer = torch.optim.AdamW(network.parameters(), lr=RATE, weight_decay=1e-4)
    schedule = torch.optim.lr_scheduler.OneCycleLR(optimizer, RATE, iterations, pct_start=0.15)
    network.train()
    start, recent = time.monotonic(), 0.0
    for iteration in range(1, iterations + 1):
        gray, chroma = data.batch(pictures, size, rng)
        error = torch.nn.functional.smooth_l1_loss(
            network(gray), chroma, reduction="none", beta=2.0
        ).sum(dim=1)
        loss = (error * weights[cell(chroma)].clamp(max=MOST_WEIGHT)).mean()
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
        schedule.step()
        recent = loss.item() if iteration == 1 else 0.95 * recent + 0.05 * loss.item()
        if iteration % 25 == 0 or iteration == iterations:
            say(
                f"{iteration}/{iterations} loss {recent:.2f} after {time.monotonic() - start:.0f} s"
            )
    network.eval()
