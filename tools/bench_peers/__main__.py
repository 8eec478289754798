"""Trains one scene with gs-chroma and with its peers, and prints time and quality side by side.

    cargo build --release
    python3 tools/bench_peers $SCENES/tiny-brighton --side 320 --iterations 1000 \\
        --max-splats 10000 --rounds 3 --brush path/to/brush -o target/peers

Any of --brush PROGRAM, --gsplat "python path/to/simple_trainer.py" and --opensplat PROGRAM may be
given. What is done for fairness:

- All read the same photos: 8-bit gray with the L* of the colors, scaled here. Cameras and points in
  COLMAP's model are changed to match.
- Every 8th photo by name is held out, or with --hold ends the first and the last. Programs train on a folder without these photos, so that none
  spends time on measuring. gsplat's trainer always holds some out: it gets the whole folder, leaves
  out the same ones, and does not measure.
- Iterations, degree of spherical harmonics and cap on Gaussians are the same, though OpenSplat knows
  no cap and gsplat starts with all points. Everything else is as each program has it by default,
  except that OpenSplat sees photos at full size from the start.
- Programs take turns, so that a machine that slows down slows all of them; medians count.
- `gs-chroma render` draws the held-out views of every splat file, and one measure rates them.

Seconds are those of the whole command, loading and writing included; those of training are what the
program says, in whole seconds if it is Brush. A first round may include compiling kernels. A peer
that fails is named and left out. results.json and every command's output go to the output folder.

Needs numpy and Pillow.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import re
import shlex
import shutil
import sys
from dataclasses import asdict
from pathlib import Path

# The folder that is run comes first on Python's path; what it shares with other tools is beside it.
sys.path[0] = str(Path(__file__).resolve().parents[1])

from bench_peers.command import Problem  # noqa: E402
from bench_peers.measure import Result, median, one_round  # noqa: E402
from bench_peers.photos import HELD, copy_gray  # noqa: E402
from bench_peers.programs import Brush, Chroma, Gsplat, OpenSplat, Program, Task  # noqa: E402


def processor() -> str:
    try:
        found = re.search(r"^model name\s*:\s*(.+)$", Path("/proc/cpuinfo").read_text(), re.MULTILINE)
    except OSError:
        found = None
    return found[1] if found else platform.processor() or platform.machine()


def table(rows: dict[str, Result], ours: Result, versions: dict[str, str]) -> str:
    lines = [
        "| program | seconds | / gs-chroma | training | Gaussians | PSNR | corrected | SSIM |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for name, row in rows.items():
        training = "–" if row.training is None else f"{row.training:.1f} s"
        label = f"{name} {versions[name]}".strip()
        lines.append(
            f"| {label} | {row.seconds:.1f} s | {row.seconds / ours.seconds:.2f} | {training}"
            f" | {row.splats:.0f} | {row.psnr:.2f} dB | {row.corrected_psnr:.2f} dB | {row.ssim:.3f} |"
        )
    return "\n".join(lines)


def benchmark(arguments: argparse.Namespace) -> None:
    output = arguments.output.resolve()
    gray = output / "gray"
    if not (arguments.colmap / "images").is_dir():
        raise Problem(f"{arguments.colmap} holds no images/ folder")
    names = ("side", "iterations", "max_splats", "sh_degree", "held")
    settings = {name: getattr(arguments, name) for name in names}
    task = Task(gray, **settings)
    ours = Chroma([arguments.program], task)
    programs: list[Program] = [ours]
    if arguments.brush:
        programs.append(Brush([arguments.brush], task))
    if arguments.gsplat:
        programs.append(Gsplat(shlex.split(arguments.gsplat), task))
    if arguments.opensplat:
        programs.append(OpenSplat([arguments.opensplat], task))
    versions = {program.name: program.version() for program in programs}
    shutil.rmtree(gray, ignore_errors=True)
    held_out = copy_gray(arguments.colmap, gray, arguments.side, arguments.held)

    rounds: dict[str, list[Result]] = {program.name: [] for program in programs}
    failures: dict[str, str] = {}
    for number in range(1, arguments.rounds + 1):
        task.seed = number - 1
        for program in programs:
            if program.name in failures:
                continue
            try:
                result = one_round(program, ours, held_out, output / program.name / f"round-{number}")
            except Problem as problem:
                if program is ours:
                    raise Problem(f"{program.name}: {problem}") from None
                failures[program.name] = f"round {number}: {problem}"
                print(f"{program.name}, {failures[program.name]}", file=sys.stderr)
                continue
            rounds[program.name].append(result)
            line = f"{program.name}, round {number}: {result.seconds:.1f} s, {result.psnr:.2f} dB"
            print(line, file=sys.stderr, flush=True)

    rows = {name: median(results) for name, results in rounds.items() if name not in failures}
    scene = arguments.colmap.resolve().name
    machine = {
        "processor": processor(),
        "cores": os.cpu_count(),
        "device": ours.report(output / ours.name / "round-1")["device"]["name"],
        "system": platform.platform(),
    }
    print(table(rows, rows[ours.name], versions))
    for name, failure in failures.items():
        print(f"\nLeft out: {name}, {failure}")
    print(
        f"\n{scene}, longer side {task.side} pixels, {task.iterations} iterations, at most {task.max_splats}"
        f" Gaussians, SH degree {task.sh_degree}; medians, rounds in turn: {arguments.rounds};"
        f" held out: {', '.join(held_out)}; corrected: after each photo's own gain and offset.\n"
        f"{machine['processor']}, {machine['cores']} cores; {machine['device']}"
    )
    results = {
        "scene": scene,
        "settings": settings,
        "held_out": held_out,
        "machine": machine,
        "versions": versions,
        "commands": {program.name: program.command(output / program.name / "round-1") for program in programs},
        "rounds": {name: [asdict(result) for result in results] for name, results in rounds.items()},
        "medians": {name: asdict(row) for name, row in rows.items()},
        "failures": failures,
    }
    (output / "results.json").write_text(json.dumps(results, indent=2) + "\n")


def positive(text: str) -> int:
    number = int(text)
    if number < 1:
        raise argparse.ArgumentTypeError("must be at least 1")
    return number


def main() -> int:
    parser = argparse.ArgumentParser(prog="bench_peers", description=__doc__.splitlines()[0])
    parser.add_argument("colmap", type=Path, metavar="COLMAP_DIR")
    parser.add_argument("-o", "--output", type=Path, default=Path("target/peers"))
    parser.add_argument("--side", type=positive, default=320, help="longer side of the photos in pixels")
    parser.add_argument("--iterations", type=positive, default=1000)
    parser.add_argument("--max-splats", type=positive, default=10_000)
    parser.add_argument("--sh-degree", type=int, choices=range(4), default=3)
    parser.add_argument("--rounds", type=positive, default=3, help="each with another seed")
    parser.add_argument("--hold", dest="held", choices=HELD, default="eighth", help="which photos are held out")
    parser.add_argument("--program", default="target/release/gs-chroma", help="gs-chroma")
    parser.add_argument("--brush", metavar="PROGRAM")
    parser.add_argument("--gsplat", metavar="COMMAND", help="Python and the path of simple_trainer.py")
    parser.add_argument("--opensplat", metavar="PROGRAM")
    try:
        benchmark(parser.parse_args())
    except (Problem, OSError) as problem:
        print(f"error: {problem}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
