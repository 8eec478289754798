#!/bin/sh
# Runs `make demo` and `make test` as a newcomer does: on a clean checkout, in a new root of
# Debian 12 that has git, make, python3 and this machine's Rust, and nothing else.
#
#     sudo tools/bare_machine.sh [COMMAND]    # default: make demo && make test
#
# Needs root and debootstrap. BARE_ROOT is where the root goes (target/bare by default; what is
# there is used again), DEBIAN_MIRROR where packages come from.
set -eu
cd "$(dirname "$0")/.."
root=${BARE_ROOT:-$PWD/target/bare}
cargo=${CARGO_HOME:-$HOME/.cargo}
rustup=${RUSTUP_HOME:-$HOME/.rustup}
packages=ca-certificates,git,make,python3

if [ ! -e "$root/etc/debian_version" ]; then
    debootstrap --variant=minbase --include="$packages" bookworm "$root" \
        "${DEBIAN_MIRROR:-http://deb.debian.org/debian}"
fi
# The network as it is here.
cp -r /etc/apt/. "$root/etc/apt"
cp -r /etc/ssl/certs/. "$root/etc/ssl/certs"
for file in /etc/resolv.conf /etc/hosts /etc/pip.conf; do
    if [ -e "$file" ]; then cp "$file" "$root$file"; fi
done
rm -rf "$root/gs-chroma"
git clone --quiet --no-hardlinks . "$root/gs-chroma"

leave() { umount "$root/proc" "$root/dev" "$root$cargo" "$root$rustup" 2>/dev/null || true; }
trap leave EXIT
mkdir -p "$root$cargo" "$root$rustup"
mount -t proc proc "$root/proc"
mount --rbind /dev "$root/dev"
mount --bind "$cargo" "$root$cargo"
mount --bind "$rustup" "$root$rustup"
chroot "$root" env HOME="$HOME" PATH="$cargo/bin:/usr/sbin:/usr/bin:/sbin:/bin" \
    sh -ec "cd /gs-chroma && ${1:-make demo && make test}"
