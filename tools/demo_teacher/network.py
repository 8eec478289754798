"""A small U-Net from gray to a, b: five levels below full size, 147,000 parameters."""

from __future__ import annotations

import torch
from torch import nn

WIDTHS = (8, 16, 28, 40, 44)
AB_SCALE = 50.0  # Outputs of order 1 become Lab units.


def block(inside: int, outside: int, stride: int = 1) -> nn.Sequential:
    """Convolution, batch norm, ReLU."""
    return nn.Sequential(
        nn.Conv2d(inside, outside, 3, stride, 1, bias=False), nn.BatchNorm2d(outside), nn.ReLU()
    )


class Network(nn.Module):
    """(B, 1, H, W) gray in [0, 1] to (B, 2, H, W) a, b; H and W are multiples of 32."""

    def __init__(self) -> None:
        """All weights at random."""
        super().__init__()
        w = WIDTHS
        self.down = nn.ModuleList()
        before = 1
        for width in w:
            level = [block(before, width, 2)]
            if before > 1:  # The first level is the costliest and needs no depth.
                level.append(block(width, width))
            self.down.append(nn.Sequential(*level))
            before = width
        self.bottom = block(w[-1], w[-1])
        self.up = nn.ModuleList(
            block(deep + shallow, shallow) for deep, shallow in zip(w[:0:-1], w[-2::-1])
        )
        self.head = nn.Conv2d(w[0], 8, 3, 1, 1)

    def forward(self, gray: torch.Tensor) -> torch.Tensor:
        """Gray in, a and b out."""
        kept = []
        x = 2 * gray - 1
        for level in self.down:
            x = level(x)
            kept.append(x)
        x = x + self.bottom(x)
        for level, skip in zip(self.up, kept[-2::-1]):
            x = nn.functional.interpolate(x, scale_factor=2.0, mode="nearest")
            x = level(torch.cat([x, skip], dim=1))
        return AB_SCALE * nn.functional.pixel_shuffle(self.head(x), 2)


class Teacher(nn.Module):
    """The network behind DDColor's contract: (1, 3, 256, 256) RGB to (1, 2, 256, 256) a, b."""

    def __init__(self, network: Network) -> None:
        """Wraps `network` without copying it."""
        super().__init__()
        self.network = network

    def forward(self, rgb: torch.Tensor) -> torch.Tensor:
        """RGB in, a and b out."""
        return self.network(rgb.mean(dim=1, keepdim=True))
