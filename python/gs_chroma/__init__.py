"""Colored 3D Gaussian scenes from grayscale photographs.

    import gs_chroma

    dataset = gs_chroma.Dataset.open("house", max_side=800)
    scene = gs_chroma.fit(dataset, preset="balanced", progress=print)
    colored = gs_chroma.colorize(scene, lambda gray: model(gray))
    colored.splats.write("house.ply")

`fit`, `colorize` and `render` work in memory; `evaluate`, `export` and `frames` on run folders,
which the command `gs-chroma` makes.
"""

from __future__ import annotations

from . import _process
from ._commands import evaluate, export, frames
from ._native import (
    Camera,
    CaptureError,
    ChromaError,
    Colored,
    CommandError,
    Dataset,
    Error,
    GpuError,
    LumaError,
    LumaScene,
    Progress,
    SplatError,
    Splats,
    TeacherError,
    __version__,
    colorize,
    device,
    fit,
    render,
)

_process.declare()

__all__ = [
    "Camera",
    "CaptureError",
    "ChromaError",
    "Colored",
    "CommandError",
    "Dataset",
    "Error",
    "GpuError",
    "LumaError",
    "LumaScene",
    "Progress",
    "SplatError",
    "Splats",
    "TeacherError",
    "colorize",
    "device",
    "evaluate",
    "export",
    "fit",
    "frames",
    "render",
]
