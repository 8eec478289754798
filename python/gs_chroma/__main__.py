"""The program `gs-chroma`: `python -m gs_chroma`."""

from __future__ import annotations

import signal
import sys

from gs_chroma import _native


def main() -> int:
    """Runs the program with this process' arguments, and gives its exit status."""
    # Its own handlers write checkpoints and remove what was only begun.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    return _native.main()


if __name__ == "__main__":
    sys.exit(main())
