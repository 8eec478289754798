#!/bin/sh
# Builds the wheel of the Python module and the program, for this system, into target/wheels.
#
#     tools/build_wheel.sh [OPTIONS OF maturin build]
#
# Needs Rust and Python 3.10 or newer; maturin is installed into target/maturin.
set -eu
cd "$(dirname "$0")/.."
if [ ! -x target/maturin/bin/maturin ]; then
    python3 -m venv target/maturin
    target/maturin/bin/pip --quiet --disable-pip-version-check install 'maturin>=1.9,<2'
fi
target/maturin/bin/maturin build --out target/wheels "$@"
ls -l target/wheels
