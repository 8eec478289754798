"""Writes the network as ONNX, runs that file with ONNX Runtime, and measures its colors."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import onnx
import onnxruntime
import torch
from numpy.typing import NDArray
from PIL import Image

import lab

from . import data
from .network import Network, Teacher

OPSET = 17


def export(network: Network, path: Path) -> None:
    """One self-contained file at opset 17, input and output named as in DDColor's exports."""
    path.parent.mkdir(parents=True, exist_ok=True)
    torch.onnx.export(
        Teacher(network.eval()), (torch.rand(1, 3, data.SIDE, data.SIDE),), str(path),
        input_names=["input"], output_names=["output"], opset_version=OPSET, dynamo=False,
    )  # fmt: skip
    model = onnx.load(path)
    onnx.checker.check_model(model, full_check=True)
    model.doc_string = "Toy colorizer of one procedural garden. Not for real photographs."
    onnx.save(model, path)


def colorize(
    session: Any, rgb: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """(L, a, b) of a picture with a, b from the teacher, and its true Lab; both (H, W, 3)."""
    truth = lab.rgb_to_lab(rgb)
    gray = lab.lightness_to_gray(truth[..., 0])
    height, width = gray.shape
    small = Image.fromarray(gray.astype(np.float32)).resize(
        (data.SIDE, data.SIDE), Image.Resampling.BILINEAR
    )
    tensor = np.repeat(np.asarray(small)[None, None], 3, axis=1)
    chroma = session.run(["output"], {"input": tensor})[0][0]
    planes = [
        np.asarray(Image.fromarray(plane).resize((width, height), Image.Resampling.BILINEAR))
        for plane in chroma
    ]
    return np.dstack([truth[..., 0], *planes]), truth


def measure(model: Path, photos: list[Path], sheet: Path | None) -> dict[str, float]:
    """Mean a, b error and colorfulness of `photos`; `sheet` gets rows of gray, colored, true."""
    session = onnxruntime.InferenceSession(str(model), providers=["CPUExecutionProvider"])
    errors, gray_errors, ours, true, rows = [], [], [], [], []
    for photo in photos:
        rgb = data.load(photo)
        colored, truth = colorize(session, rgb)
        shown = lab.lab_to_rgb(colored)
        errors.append(np.linalg.norm(colored[..., 1:] - truth[..., 1:], axis=-1).mean())
        gray_errors.append(np.linalg.norm(truth[..., 1:], axis=-1).mean())
        ours.append(lab.colorfulness(shown))
        true.append(lab.colorfulness(rgb))
        gray = np.repeat(lab.lightness_to_gray(truth[..., :1]), 3, axis=-1)
        rows.append(np.concatenate([gray, shown, rgb], axis=1))
    if sheet is not None:
        picture = np.round(255 * np.concatenate(rows)).astype(np.uint8)
        Image.fromarray(picture).save(sheet)
    return {
        "photos": len(photos),
        "mean_ab_distance": round(float(np.mean(errors)), 2),
        "mean_ab_distance_of_gray": round(float(np.mean(gray_errors)), 2),
        "colorfulness": round(float(np.mean(ours)), 2),
        "colorfulness_of_truth": round(float(np.mean(true)), 2),
    }
