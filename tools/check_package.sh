#!/bin/sh
# Packages the crate, installs the program from the archive as anyone would, and runs it.
#
#     tools/check_package.sh [FOLDER]    # default: target/package-check
set -eu
cd "$(dirname "$0")/.."
folder=${1:-$PWD/target/package-check}
target=${CARGO_TARGET_DIR:-$PWD/target}
version=$(sed -n 's/^version = "\(.*\)"/\1/p' Cargo.toml | head -n 1)
rm -rf "$folder"
mkdir -p "$folder"
# The install below builds what is in the archive.
cargo package --quiet --locked --no-verify --allow-dirty
crate=$target/package/gs-chroma-$version.crate
size=$(wc -c < "$crate")
echo "$crate: $size bytes"
# crates.io takes 10 MiB.
[ "$size" -lt 4000000 ] || { echo "the crate is too large" >&2; exit 1; }
tar -xzf "$crate" -C "$folder"
CARGO_TARGET_DIR=$folder/target cargo install --quiet --locked --path "$folder/gs-chroma-$version" --root "$folder"
# Away from the repository.
cd "$folder"
bin/gs-chroma --version
bin/gs-chroma teacher list > /dev/null
bin/gs-chroma doctor --help > /dev/null
