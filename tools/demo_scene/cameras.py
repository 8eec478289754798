"""Where the photographer stands.

Rotations are world-to-camera with COLMAP's axes: x right, y down, z forward.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .meshes import Array

LENS_MM = 33.0
SENSOR_MM = 36.0
TARGET = np.array([0.0, 0.0, 0.32])


@dataclass
class Camera:
    """A pinhole camera: name, center in world space, world-to-camera rotation (3, 3)."""

    name: str
    center: Array
    rotation: Array


def focal_pixels(width: int) -> float:
    """Focal length in pixels of an image `width` pixels wide."""
    return LENS_MM / SENSOR_MM * width


def look_at(name: str, center: Array, target: Array, roll: float = 0.0) -> Camera:
    """A camera at `center` that looks at `target`; `roll` in radians about the view axis."""
    forward = (target - center) / np.linalg.norm(target - center)
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    down = np.cross(forward, right)
    c, s = np.cos(roll), np.sin(roll)
    return Camera(name, center, np.stack([c * right + s * down, c * down - s * right, forward]))


def _on_sphere(azimuth: float, elevation: float, distance: float) -> Array:
    """A point seen from the target; azimuth 0 is the wall's front, angles in degrees."""
    a, e = np.radians([azimuth, elevation])
    return TARGET + distance * np.array([np.sin(a) * np.cos(e), -np.cos(a) * np.cos(e), np.sin(e)])


def demo_cameras() -> list[Camera]:
    """Fourteen views: a low and a high arc of seven, 12 degrees apart, held by a steady hand.

    The low arc starts off its end, so that every eighth name (0 and 8) lies between others.
    """
    rng = np.random.default_rng(11)
    arc = [12.0 * k for k in range(-3, 4)]
    walk = [(a, 17.0, 2.25) for a in arc[2:] + arc[:2]] + [(a + 4.0, 32.0, 2.35) for a in arc]
    cameras = []
    for index, (azimuth, elevation, distance) in enumerate(walk):
        spot = _on_sphere(
            azimuth + rng.normal(0, 1.0),
            elevation + rng.normal(0, 0.8),
            distance + rng.normal(0, 0.06),
        )
        aim = TARGET + rng.normal(0, 0.03, 3)
        cameras.append(look_at(f"garden_{index:02d}", spot, aim, float(rng.normal(0, 0.012))))
    return cameras


def random_cameras(seed: int, count: int) -> list[Camera]:
    """Training views from anywhere in front of the wall, near and far."""
    rng = np.random.default_rng([40961, seed])
    cameras = []
    for index in range(count):
        spot = _on_sphere(rng.uniform(-48, 48), rng.uniform(10, 45), rng.uniform(1.3, 2.6))
        aim = TARGET + rng.normal(0, (0.35, 0.2, 0.15))
        cameras.append(look_at(f"{seed:03d}_{index}", spot, aim, float(rng.normal(0, 0.03))))
    return cameras
