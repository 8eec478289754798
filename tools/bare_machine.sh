#!/bin/sh
# Runs `make demo` and `make test` as a newcomer does: on a clean checkout, in a new root of
# Debian 12 that has git, make, python3 and this machine's Rust, and nothing else.
#
#     sudo tools/bare_machine.sh [COMMAND]    # default: make demo && make test
#     sudo tools/bare_machine.sh --wheel [COMMAND]
#
# With --wheel the root has python3-venv and a Vulkan driver in the place of make and Rust; the
# wheel in target/wheels is installed, colors the bundled scene and runs the example.
#
# Needs root, debootstrap and a machine of Debian or its kin, whose sources of packages are used.
# BARE_ROOT is where the root goes (target/bare by default; what is there is used again).
set -eu
cd "$(dirname "$0")/.."
# Mounts are this process' alone, and gone with it: nothing that removes the root reaches them.
if [ -z "${BARE_UNSHARED:-}" ]; then
    exec env BARE_UNSHARED=1 unshare --mount --propagation private "$0" "$@"
fi
cargo=${CARGO_HOME:-$HOME/.cargo}
rustup=${RUSTUP_HOME:-$HOME/.rustup}
if [ "${1:-}" = --wheel ]; then
    shift
    wheel=$(ls "$PWD"/target/wheels/*.whl)
    root=${BARE_ROOT:-$PWD/target/bare-wheel}
    packages=ca-certificates,mesa-vulkan-drivers,python3,python3-venv
    path=/venv/bin
    command="python3 -m venv --clear /venv
        time pip --quiet install '/$(basename "$wheel")[onnx]' pillow
        time gs-chroma fit assets/demo -o runs/demo
        time gs-chroma colorize runs/demo --teacher assets/teacher/demo-teacher.onnx
        time gs-chroma frames runs/demo -o runs/colored
        time python examples/color_scene.py assets/demo runs/python"
else
    wheel=
    root=${BARE_ROOT:-$PWD/target/bare}
    packages=ca-certificates,git,make,python3
    path=$cargo/bin
    command="make demo && make test"
fi

if [ ! -e "$root/complete" ]; then
    mirror=$(apt-get indextargets --format '$(REPO_URI)' 'Created-By: Packages' | head -n 1)
    rm -rf "$root"
    debootstrap --variant=minbase --include="$packages" bookworm "$root" "$mirror"
    touch "$root/complete"
fi
# The network as it is here.
cp -r /etc/apt/. "$root/etc/apt"
cp -r /etc/ssl/certs/. "$root/etc/ssl/certs"
for file in /etc/resolv.conf /etc/hosts /etc/pip.conf; do
    if [ -e "$file" ]; then cp "$file" "$root$file"; fi
done
rm -rf "$root/gs-chroma"
git -c safe.directory='*' clone --quiet --no-hardlinks . "$root/gs-chroma"

mount -t proc proc "$root/proc"
mount --rbind /dev "$root/dev"
if [ -n "$wheel" ]; then
    cp "$wheel" "$root"
else
    mkdir -p "$root$cargo" "$root$rustup"
    mount --bind "$cargo" "$root$cargo"
    mount --bind "$rustup" "$root$rustup"
fi
chroot "$root" env HOME="$HOME" PATH="$path:/usr/sbin:/usr/bin:/sbin:/bin" \
    bash -ec "cd /gs-chroma && ${1:-$command}"
