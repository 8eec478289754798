"""Writes what COLMAP says of its camera models, for the tests of src/capture/lens.

    python tools/make_lens_fixture.py --out tests/fixtures/lens/colmap.json

Needs pycolmap (`tools/requirements.txt`). The file holds a list of rays and, for every model
and several sets of parameters, the pixels at which COLMAP's `img_from_cam` shows them.
"""

from __future__ import annotations

import argparse
import json
import math
from pathlib import Path

import pycolmap

WIDTH, HEIGHT = 640, 480
CENTER = [322.5, 238.25]

# Weak and strong sets of coefficients after focal lengths and principal point.
COEFFICIENTS: dict[str, list[list[float]]] = {
    "SIMPLE_PINHOLE": [[]],
    "PINHOLE": [[]],
    "SIMPLE_RADIAL": [[-0.02], [-0.25], [0.3]],
    "RADIAL": [[-0.3, 0.08], [0.1, 0.05]],
    "OPENCV": [[-0.28, 0.07, 0.001, -0.0007], [0.05, -0.02, -0.004, 0.003]],
    "OPENCV_FISHEYE": [[0.03, -0.01, 0.004, -0.0006], [-0.1, 0.02, -0.003, 0.0002]],
    "FULL_OPENCV": [
        [0.1, 0.02, 0.001, -0.002, 0.003, 0.3, 0.05, 0.001],
        [-0.3, 0.1, -0.0005, 0.0004, -0.02, 0.01, -0.005, 0.002],
    ],
    "FOV": [[0.4], [1.1], [-0.7]],
    "SIMPLE_RADIAL_FISHEYE": [[0.04], [-0.06]],
    "RADIAL_FISHEYE": [[0.02, -0.004], [-0.05, 0.003]],
    "THIN_PRISM_FISHEYE": [
        [0.02, -0.01, 0.001, -0.0008, 0.002, -0.0003, 0.0011, -0.0006],
    ],
    "RAD_TAN_THIN_PRISM_FISHEYE": [
        [0.02, -0.01, 0.005, -0.001, 0.0004, -0.00005, 0.001, -0.0008, 0.0011, -0.0004, -0.0006,
         0.0002],
    ],
    "SIMPLE_DIVISION": [[-0.2], [0.05]],
    "DIVISION": [[-0.35], [0.03]],
    "SIMPLE_FISHEYE": [[]],
    "FISHEYE": [[]],
    "EUCM": [[0.5, 1.1], [0.9, 0.6], [0.0, 1.0]],
}  # fmt: skip


def rays() -> list[list[float]]:
    """Directions from the axis to 75 degrees beside it, not of unit length."""
    directions = [[0.0, 0.0, 2.0]]
    for degrees in (3, 15, 30, 40, 55, 75):
        for turn in (0.1, 1.3, 2.9, 4.4):
            radius = math.tan(math.radians(degrees))
            directions.append([radius * math.cos(turn), radius * math.sin(turn), 1.0])
    return directions


def camera(name: str, parameters: list[float]) -> pycolmap.Camera:
    return pycolmap.Camera(model=name, width=WIDTH, height=HEIGHT, params=parameters)


def cases() -> list[dict]:
    found = []
    for name, sets in COEFFICIENTS.items():
        info = camera_info(name)
        for coefficients in sets:
            focal = [431.5] if info.startswith("f,") else [431.5, 428.75]
            parameters = focal + CENTER + coefficients
            found.append(case(name, parameters))
    found.append(case("EQUIRECTANGULAR", [640.0, 480.0]))
    return found


def camera_info(name: str) -> str:
    model = getattr(pycolmap.CameraModelId, name)
    return pycolmap.Camera.create_from_model_id(1, model, 500.0, WIDTH, HEIGHT).params_info


def case(name: str, parameters: list[float]) -> dict:
    shown = camera(name, parameters)
    pixels = [shown.img_from_cam(ray) for ray in rays()]
    return {
        "model": name,
        "number": getattr(pycolmap.CameraModelId, name).value,
        "parameters": parameters,
        "pixels": [None if pixel is None else [float(c) for c in pixel] for pixel in pixels],
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("tests/fixtures/lens/colmap.json"))
    out = parser.parse_args().out
    known = {name for name in pycolmap.CameraModelId.__members__ if name != "INVALID"}
    assert known == {*COEFFICIENTS, "EQUIRECTANGULAR"}, "another COLMAP has other models"
    fixture = {
        "pycolmap": pycolmap.__version__,
        "width": WIDTH,
        "height": HEIGHT,
        "rays": rays(),
        "cases": cases(),
    }
    out.parent.mkdir(parents=True, exist_ok=True)
    lines = json.dumps(fixture).replace('{"model"', '\n{"model"')
    out.write_text(lines + "\n")


if __name__ == "__main__":
    main()
