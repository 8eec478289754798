"""Builds the Python module in the dev profile and runs its tests.

    python3 tools/test_python.py [TEST …]      # default: all of python/tests
"""

from __future__ import annotations

import importlib.util
import os
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
PYTHON = (3, 10)
SUFFIX = {"win32": ".pyd"}.get(sys.platform, ".abi3.so")
LIBRARY = {"win32": "gs_chroma_python.dll", "darwin": "libgs_chroma_python.dylib"}


def main() -> int:
    """The exit status of the tests, or 0 where this Python cannot run them."""
    old = sys.version_info < PYTHON
    if old or not importlib.util.find_spec("numpy"):
        reason = "is older than 3.10" if old else "lacks NumPy"
        print(f"Python tests are skipped: {sys.executable} {reason}")
        return 0
    # An example, so that dependencies have the features of tests and are built already.
    cargo = ["cargo", "build", "--package", "gs-chroma", "--package", "gs-chroma-python"]
    cargo += ["--lib", "--example", "color_scene"]
    status = subprocess.run(cargo, cwd=ROOT, check=False).returncode
    if status != 0:
        return status
    target = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
    package = target / "python" / "gs_chroma"
    shutil.rmtree(package, ignore_errors=True)
    shutil.copytree(ROOT / "python" / "gs_chroma", package)
    library = LIBRARY.get(sys.platform, "libgs_chroma_python.so")
    shutil.copy(target / "debug" / library, package / f"_native{SUFFIX}")
    tests = sys.argv[1:] or ["discover", "--start-directory", str(ROOT / "python" / "tests")]
    environment = {**os.environ, "PYTHONPATH": str(package.parent)}
    unittest = [sys.executable, "-m", "unittest", *tests]
    return subprocess.run(unittest, cwd=ROOT / "python" / "tests", env=environment, check=False).returncode


if __name__ == "__main__":
    sys.exit(main())
