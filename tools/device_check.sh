#!/usr/bin/env bash
# Tries everything on this machine's GPU in one go: device, doctor, cost of the kernels, tests, a long fit,
# its colors, and the peers that are named.
#
#   tools/device_check.sh [OUTPUT]                  OUTPUT is target/device unless given
#   tools/device_check.sh --pack FOLDER             builds here what PREBUILT takes there
#
# Environment, with paths from the repository's root:
#   SCENE                     COLMAP folder of color photos, fern-llff below SCENES unless given
#   STEPS                     those to do, all unless given: device build doctor bench accuracy tests fit
#                             colorize-adam colorize eval peers
#   ITERATIONS, SIDE          of the fit: 15000 and 800
#   BRUSH, GSPLAT, OPENSPLAT  what tools/bench_peers takes as --brush, --gsplat and --opensplat
#   PROGRAM, PYTHON           target/release/gs-chroma, which is built first, and python3
#   PREBUILT                  folder of programs, for a machine without cargo; the checkout has to lie where
#                             it lay when they were built (a symbolic link will do)
#
# What a step prints goes to OUTPUT, its messages to a .log of its name. A step whose input is missing is
# skipped, and one that fails does not stop the others.

set -u
export LC_ALL=C
cd "$(dirname "$0")/.." || exit 1

# pack FOLDER: the program, the tests and the benchmarks without their debug information.
pack() {
    mkdir -p "$1" && {
        cargo build --release --message-format json
        cargo test --no-run --message-format json
        cargo bench --no-run --message-format json
    } | "${PYTHON:-python3}" -c '
import json, sys
for message in map(json.loads, sys.stdin):
    if message.get("executable") and "example" not in message["target"]["kind"]:
        kind, name = message["target"]["kind"][0], message["target"]["name"]
        tested = message["profile"]["test"] and kind != "test"
        print(message["executable"], f"{name}-unit" if tested else f"{kind}-{name}")
' | while read -r from to; do
        strip -o "$1/$to" "$from" || return 1
    done
}

if [ "${1:-}" = --pack ]; then
    [ $# -eq 2 ] || { echo "usage: tools/device_check.sh --pack FOLDER" >&2; exit 2; }
    pack "$2"
    exit
fi

out=target/device
for argument in "$@"; do
    case $argument in
        -*) echo "usage: tools/device_check.sh [OUTPUT] | --pack FOLDER" >&2; exit 2 ;;
        *) out=$argument ;;
    esac
done
scene=${SCENE:-${SCENES:-scenes}/fern-llff} iterations=${ITERATIONS:-15000} side=${SIDE:-800}
prebuilt=${PREBUILT:-} program=${PROGRAM:-${prebuilt:+$prebuilt/bin-gs-chroma}}
program=${program:-target/release/gs-chroma}
mkdir -p "$out" || exit 1

summary=$out/summary.md failed=0
printf '| step | exit code | seconds |\n|---|---|---|\n' >"$summary"

# step FILE COMMAND...: runs the command, and notes how it ended and how long it took.
step() {
    local file=$1 name=${1%.*} begun=${EPOCHREALTIME/./} code=0
    shift
    case " ${STEPS:-$name} " in *" $name "*) ;; *) skip "$name" "not asked for"; return ;; esac
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

# bench NAME ARGUMENT...
bench() {
    local name=$1
    shift
    if [ -n "$prebuilt" ]; then "$prebuilt/bench-$name" "$@"; else cargo bench --bench "$name" -- "$@"; fi
}

# all_tests: every test program although one fails.
all_tests() {
    local test code=0
    [ -n "$prebuilt" ] || { cargo test --no-fail-fast; return; }
    for test in "$prebuilt"/test-* "$prebuilt"/*-unit; do "$test" || code=1; done
    return $code
}

if [ -n "$prebuilt" ]; then skip build "$prebuilt"
elif have cargo; then step build.txt cargo build --release
else skip build "no cargo"; fi

if have "$program"; then step doctor.json "$program" doctor --json; else skip doctor "no $program"; fi

if [ -n "$prebuilt" ] || have cargo; then
    step bench.txt bench iteration --full --csv "$out/cost.csv"
    step accuracy.md bench accuracy --csv "$out/accuracy.csv" --json "$out/accuracy.json"
    step tests.txt all_tests
else skip "bench, accuracy, tests" "no cargo"; fi

if ! have "$program"; then skip fit "no $program"
elif [ ! -d "$scene" ]; then skip fit "no $scene"
else
    case " ${STEPS:-fit} " in *" fit "*) rm -rf "$out/run" ;; esac
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
