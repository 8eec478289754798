#!/usr/bin/env bash
# Tries everything on this machine's GPU in one go: device, doctor, cost of the kernels, tests, a long fit,
# its colors, and the peers that are named.
#
#   tools/device_check.sh [OUTPUT] [--no-tests]     OUTPUT is target/device unless given
#
# Environment, with paths from the repository's root:
#   SCENE                     COLMAP folder of color photos, ../shared/data/fern-llff unless given
#   ITERATIONS, SIDE          of the fit: 15000 and 800
#   BRUSH, GSPLAT, OPENSPLAT  what tools/bench_peers takes as --brush, --gsplat and --opensplat
#   PROGRAM, PYTHON           target/release/gs-chroma, which is built first, and python3
#
# What a step prints goes to OUTPUT, its messages to a .log of its name. A step whose input is missing is
# skipped, and one that fails does not stop the others.

set -u
export LC_ALL=C
cd "$(dirname "$0")/.." || exit 1

out=target/device tests=yes
for argument in "$@"; do
    case $argument in
        --no-tests) tests=no ;;
        -*) echo "usage: tools/device_check.sh [OUTPUT] [--no-tests]" >&2; exit 2 ;;
        *) out=$argument ;;
    esac
done
scene=${SCENE:-../shared/data/fern-llff} iterations=${ITERATIONS:-15000} side=${SIDE:-800}
program=${PROGRAM:-target/release/gs-chroma}
mkdir -p "$out" || exit 1
rm -rf "$out/run"

summary=$out/summary.md failed=0
printf '| step | exit code | seconds |\n|---|---|---|\n' >"$summary"

# step FILE COMMAND...: runs the command, and notes how it ended and how long it took.
step() {
    local file=$1 name=${1%.*} begun=${EPOCHREALTIME/./} code=0
    shift
    echo "$name ..." >&2
    "$@" >"$out/$file" 2>"$out/$name.log" </dev/null || { code=$? failed=1; }
    printf '| %s | %d | %.1f |\n' "$name" "$code" "$((${EPOCHREALTIME/./} - begun))e-6" >>"$summary"
}

# skip NAME WHY
skip() {
    printf '| %s | skipped: %s | |\n' "$1" "$2" >>"$summary"
}

have() {
    command -v "$1" >/dev/null
}

if have vulkaninfo; then step device.txt vulkaninfo --summary
elif have nvidia-smi; then step device.txt nvidia-smi
else skip device "neither vulkaninfo nor nvidia-smi"; fi

if have cargo; then step build.txt cargo build --release; else skip build "no cargo"; fi

if have "$program"; then step doctor.json "$program" doctor --json; else skip doctor "no $program"; fi

if have cargo; then step bench.txt cargo bench -- --full --csv "$out/cost.csv"; else skip bench "no cargo"; fi

if have cargo; then step accuracy.md cargo bench --bench accuracy -- --csv "$out/accuracy.csv" --json "$out/accuracy.json"
else skip accuracy "no cargo"; fi

if [ $tests = no ]; then skip tests "--no-tests"
elif have cargo; then step tests.txt cargo test --release
else skip tests "no cargo"; fi

if ! have "$program"; then skip fit "no $program"
elif [ ! -d "$scene" ]; then skip fit "no $scene"
else
    step fit.json "$program" fit "$scene" -o "$out/run" --preset paper --iterations "$iterations" \
        --max-side "$side" --timings --json
fi

# Both solvers; Adam with as many iterations again, like the paper.
if [ ! -f "$out/run/luma.ply" ]; then skip colorize "nothing was fitted"
else
    step colorize-adam.json "$program" colorize "$out/run" --teacher "$scene/images" \
        --solver adam --until $((2 * iterations)) --timings --json
    step colorize.json "$program" colorize "$out/run" --teacher "$scene/images" --timings --json
    step eval.json "$program" eval "$out/run" --teacher "$scene/images" --baselines --json
fi

peers=()
[ -z "${BRUSH:-}" ] || peers+=(--brush "$BRUSH")
[ -z "${GSPLAT:-}" ] || peers+=(--gsplat "$GSPLAT")
[ -z "${OPENSPLAT:-}" ] || peers+=(--opensplat "$OPENSPLAT")
if [ ${#peers[@]} -eq 0 ]; then skip peers "none named"
elif [ ! -d "$scene" ]; then skip peers "no $scene"
else
    step peers.md "${PYTHON:-python3}" tools/bench_peers "$scene" --side "$side" --iterations "$iterations" \
        --max-splats 200000 --program "$program" -o "$out/peers" "${peers[@]}"
fi

cat "$summary"
exit $failed
