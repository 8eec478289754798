#!/bin/sh
# Packages the crate, installs the program from the archive as anyone would, and runs it.
# PROFILE=dev compiles faster.
set -eu
cd "$(dirname "$0")/.."
target=${CARGO_TARGET_DIR:-$PWD/target}
version=$(sed -n 's/^version = "\(.*\)"/\1/p' Cargo.toml | head -n 1)
# Not below the repository, whose workspace it is no part of.
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
# What is installed below is what is in the archive.
CARGO_TARGET_DIR=$target cargo package --quiet --no-verify --allow-dirty
crate=$target/package/gs-chroma-$version.crate
size=$(wc -c < "$crate")
echo "$crate: $size bytes"
[ "$size" -lt 2000000 ] || { echo "the crate has more in it than it is built from" >&2; exit 1; }
tar -xzf "$crate" -C "$folder"
cd "$folder"
CARGO_TARGET_DIR=$target/package-check cargo install --quiet --locked --profile "${PROFILE:-release}" \
    --path "gs-chroma-$version" --root "$folder"
bin/gs-chroma --version
bin/gs-chroma teacher list > /dev/null
bin/gs-chroma doctor --help > /dev/null
