"""Runs commands, and says in a line why one failed."""

from __future__ import annotations

import os
import subprocess
import time
from pathlib import Path


class Problem(Exception):
    """What ends the benchmark, or one program's part in it, in a line."""


def run(command: list[str], log: Path) -> float:
    """Wall seconds of a command; its output goes to `log`.out and `log`.err."""
    # Brush says how long it trained only where its messages are asked for.
    environment = {**os.environ, "RUST_LOG": "brush_cli=info"}
    errors = log.with_suffix(".err")
    with log.with_suffix(".out").open("wb") as out, errors.open("wb") as err:
        begun = time.monotonic()
        try:
            done = subprocess.run(
                command, stdin=subprocess.DEVNULL, stdout=out, stderr=err, env=environment, check=False
            )
        except OSError as error:
            raise Problem(f"{command[0]}: {error.strerror}") from None
        seconds = time.monotonic() - begun
    if done.returncode != 0:
        lines = [line.strip() for line in errors.read_text(errors="replace").splitlines() if line.strip()]
        raise Problem(f"exit code {done.returncode}: {lines[-1] if lines else 'nothing on stderr'}")
    return seconds
