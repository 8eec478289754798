#!/bin/sh
# Runs `make demo` and `make test` as a newcomer does: on a clean checkout, in a new root of
# Debian 12 that has git, make, python3 and this machine's Rust, and nothing else.
#
#     sudo tools/bare_machine.sh [COMMAND]    # default: make demo && make test
#
# Needs root, debootstrap and a machine of Debian or its kin, whose sources of packages are used.
# BARE_ROOT is where the root goes (target/bare by default; what is there is used again).
set -eu
cd "$(dirname "$0")/.."
# Mounts are this process' alone, and gone with it: nothing that removes the root reaches them.
if [ -z "${BARE_UNSHARED:-}" ]; then
    exec env BARE_UNSHARED=1 unshare --mount --propagation private "$0" "$@"
fi
root=${BARE_ROOT:-$PWD/target/bare}
cargo=${CARGO_HOME:-$HOME/.cargo}
rustup=${RUSTUP_HOME:-$HOME/.rustup}
packages=ca-certificates,git,make,python3

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

mkdir -p "$root$cargo" "$root$rustup"
mount -t proc proc "$root/proc"
mount --rbind /dev "$root/dev"
mount --bind "$cargo" "$root$cargo"
mount --bind "$rustup" "$root$rustup"
chroot "$root" env HOME="$HOME" PATH="$cargo/bin:/usr/sbin:/usr/bin:/sbin:/bin" \
    sh -ec "cd /gs-chroma && ${1:-make demo && make test}"
