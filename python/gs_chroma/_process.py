"""The program in Python's process: its command, its arguments, its libraries."""

from __future__ import annotations

import os
import sys
from importlib.machinery import PathFinder
from pathlib import Path

from . import _native


def declare() -> None:
    """Tells the compiled part what it would find out by itself as a program of its own."""
    for name in _native.variables():
        os.environ.setdefault(name, "1")
    command = [sys.executable or "python3", str(Path(__file__).with_name("__main__.py"))]
    _native.declare(command, sys.argv[1:], libraries())


def libraries() -> list[str]:
    """Folders of ONNX Runtime's library in the package `onnxruntime`, which is not imported."""
    # No library is loaded from the current folder.
    path = [folder for folder in sys.path if folder not in ("", os.getcwd())]
    spec = PathFinder.find_spec("onnxruntime", path)
    if spec is None or spec.origin is None:
        return []
    return [str(Path(spec.origin).with_name("capi"))]
