"""Values that JSON has no words for."""

from __future__ import annotations

import os
from typing import Any


def plain(value: Any) -> Any:
    """A path as a string, a number or an array of NumPy as numbers."""
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    if hasattr(value, "tolist"):
        return value.tolist()
    raise TypeError(f"{type(value).__name__} is no setting")
