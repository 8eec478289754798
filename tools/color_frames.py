#!/usr/bin/env python3
"""Colors the gray frames of a path by a network, each by itself, as a program for films would.

    gs-chroma eval RUN --frames 60 --gray-frames gray/
    python3 tools/color_frames.py gray/ --network NETWORK.onnx -o colored/ --mean 2
    gs-chroma eval RUN --frames 60 --against film=colored/

With `--mean N`, a and b of a frame are the mean over the N frames before and behind it: a film's
simplest filter against flicker, which knows no motion. L* is the gray frame's. The network takes
gray [1,1,H,W] from 0 to 1 (`--side` pixels, a square) and gives a, b [1,2,h,w] in CIELAB units.
Needs numpy, Pillow and onnxruntime.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
import onnxruntime
from lab import Array, lab_to_rgb, rgb_to_lab
from PIL import Image


def answer(network: onnxruntime.InferenceSession, gray: Image.Image, side: int) -> Array:
    """The network's a and b (height, width, 2) of a gray picture."""
    small = np.asarray(gray.resize((side, side), Image.Resampling.BOX), np.float32) / 255
    ab = network.run(None, {network.get_inputs()[0].name: small[None, None]})[0][0]
    planes = [Image.fromarray(plane).resize(gray.size, Image.Resampling.BILINEAR) for plane in ab]
    return np.stack([np.asarray(plane, np.float64) for plane in planes], axis=-1)


def main() -> None:
    """Colors a folder."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("frames", type=Path, help="folder of gray PNG files")
    parser.add_argument("--network", type=Path, required=True, help="ONNX file")
    parser.add_argument("--side", type=int, default=224, help="side of its input")
    parser.add_argument("--mean", type=int, default=0, help="neighbors each way that count")
    parser.add_argument("-o", "--output", type=Path, required=True, help="folder")
    arguments = parser.parse_args()
    files = sorted(arguments.frames.glob("*.png"))
    network = onnxruntime.InferenceSession(arguments.network, providers=["CPUExecutionProvider"])
    grays = [Image.open(file).convert("L") for file in files]
    answers = [answer(network, gray, arguments.side) for gray in grays]
    arguments.output.mkdir(parents=True, exist_ok=True)
    for index, (file, gray) in enumerate(zip(files, grays)):
        near = answers[max(index - arguments.mean, 0) : index + arguments.mean + 1]
        lightness = rgb_to_lab(np.asarray(gray.convert("RGB"), np.float64) / 255)[..., :1]
        rgb = lab_to_rgb(np.concatenate([lightness, np.mean(near, axis=0)], axis=-1))
        Image.fromarray((255 * rgb).round().astype(np.uint8)).save(arguments.output / file.name)


if __name__ == "__main__":
    main()
