"""Runs gs-chroma with a log, and ends it with the worker that started it."""

from __future__ import annotations

import ctypes
import os
import pty
import re
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

PR_SET_PDEATHSIG = 1  # From Linux' prctl.h.
COLOR = re.compile(r"\x1b\[[0-9;]*m")
ESCAPE = re.compile(r"\x1b\[[0-9;?]*[A-Za-z]")
COLUMNS = "100"


class Failed(Exception):
    """The program said that it cannot go on; trying again would not help."""


class Ended(Exception):
    """Something ended the program, such as a lack of memory; it can go on."""


def dies_with_parent() -> None:
    """Lets the system kill the program when the worker that started it dies."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)


def run(command: list[str], log: Path, tell: Callable[[str], None]) -> None:
    """Runs a command; its output goes to `log`, and each line that it shows to `tell`.

    The program draws its progress on terminals only, so it is given one.
    """
    log.parent.mkdir(parents=True, exist_ok=True)
    ours, its = pty.openpty()
    environment = {**os.environ, "COLUMNS": COLUMNS, "TERM": "xterm"}
    process = subprocess.Popen(  # noqa: S603
        command,
        stdin=subprocess.DEVNULL,
        stdout=its,
        stderr=its,
        env=environment,
        preexec_fn=dies_with_parent,  # noqa: PLW1509
    )
    os.close(its)
    with log.open("a") as file:
        file.write(f"$ {' '.join(command)}\n")
        for lines in pieces(ours):
            said = [line for line in lines if line]
            file.writelines(f"{line}\n" for line in said if not is_bar(line))
            file.flush()
            if said:
                tell(said[-1])
    os.close(ours)
    code = process.wait()
    if code < 0 or code in (130, 137, 143):
        raise Ended(f"{command[1]} was ended by signal {-code if code < 0 else code - 128}")
    if code != 0:
        raise Failed(last_error(log) or f"{command[1]} ended with exit status {code}")


def pieces(terminal: int):
    """Lists of lines, as they come."""
    rest = ""
    while True:
        try:
            data = os.read(terminal, 65536)
        except OSError:  # Linux says so when the other side is closed.
            data = b""
        if not data:
            if rest:
                yield [rest]
            return
        text = ESCAPE.sub("\n", COLOR.sub("", rest + data.decode(errors="replace")))
        *whole, rest = re.split(r"[\r\n]+", text)
        yield [line.rstrip() for line in whole]


def is_bar(line: str) -> bool:
    """Whether a line is a progress bar at some moment."""
    return "\u2588" in line or "\u2591" in line


def last_error(log: Path) -> str | None:
    """The line with which the program ended."""
    lines = log.read_text(errors="replace").splitlines()
    errors = [line for line in lines if line.startswith("error: ")]
    return errors[-1].removeprefix("error: ") if errors else None
