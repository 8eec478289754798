"""sRGB to CIELAB (D65, 2 degree observer) and the measures of color that the tools report."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

RGB_TO_XYZ = np.array(
    [
        [0.4124564, 0.3575761, 0.1804375],
        [0.2126729, 0.7151522, 0.0721750],
        [0.0193339, 0.1191920, 0.9503041],
    ]
)
WHITE = RGB_TO_XYZ.sum(axis=1)
KNEE = 6 / 29


def decode(encoded: Array) -> Array:
    """sRGB values in [0, 1] as linear light."""
    return np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)


def encode(light: Array) -> Array:
    """Linear light as sRGB values, cut to [0, 1]."""
    clipped = np.clip(light, 0.0, 1.0)
    return np.where(clipped <= 0.0031308, 12.92 * clipped, 1.055 * clipped ** (1 / 2.4) - 0.055)


def rgb_to_lab(rgb: Array) -> Array:
    """sRGB (..., 3) in [0, 1] to L* in [0, 100] and a*, b*."""
    t = decode(rgb) @ RGB_TO_XYZ.T / WHITE
    f = np.where(t > KNEE**3, np.cbrt(t), t / (3 * KNEE**2) + 4 / 29)
    x, y, z = f[..., 0], f[..., 1], f[..., 2]
    return np.stack([116 * y - 16, 500 * (x - y), 200 * (y - z)], axis=-1)


def lab_to_rgb(lab: Array) -> Array:
    """L*, a*, b* (..., 3) to sRGB, clipped to the cube."""
    y = (lab[..., 0] + 16) / 116
    f = np.stack([y + lab[..., 1] / 500, y, y - lab[..., 2] / 200], axis=-1)
    t = np.where(f > KNEE, f**3, 3 * KNEE**2 * (f - 4 / 29))
    return encode(t * WHITE @ np.linalg.inv(RGB_TO_XYZ).T)


def lightness_to_gray(lightness: Array) -> Array:
    """The sRGB gray in [0, 1] that has a given L*."""
    f = (lightness + 16) / 116
    return encode(np.where(f > KNEE, f**3, 3 * KNEE**2 * (f - 4 / 29)))


def colorfulness(rgb: Array) -> float:
    """Hasler and Suesstrunk (2003), signed opponent channels, of sRGB (..., 3) in [0, 1]."""
    r, g, b = (255 * rgb[..., i] for i in range(3))
    red_green, yellow_blue = r - g, (r + g) / 2 - b
    spread = np.hypot(red_green.std(), yellow_blue.std())
    return float(spread + 0.3 * np.hypot(red_green.mean(), yellow_blue.mean()))
