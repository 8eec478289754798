"""Renders other gardens, trains the toy teacher on them, and writes it as ONNX.

    python tools/train_demo_teacher.py --work target/teacher --out assets/teacher/demo-teacher.onnx

Needs `tools/requirements.txt`. Training pictures stay in the work folder and are used again by a
later run. The demo's photos are only looked at after training, to measure the finished file.
"""

from __future__ import annotations

import argparse
import json
import os
import time
from pathlib import Path

# Before PyTorch loads: spinning threads made training three times slower on a shared machine.
os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")

import torch

from demo_teacher import data, export, training
from demo_teacher.network import Network

SCENES = 24
UNSEEN_SCENES = 3  # The last ones; measured, never trained on.
SEED = 3


def main() -> None:
    """Renders, trains, exports and measures."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--work", type=Path, required=True, help="folder for training pictures")
    parser.add_argument("--out", type=Path, default=Path("assets/teacher/demo-teacher.onnx"))
    parser.add_argument("--demo", type=Path, default=Path("assets/demo/images"))
    parser.add_argument("--iterations", type=int, default=1000)
    parser.add_argument("--batch", type=int, default=8)
    parser.add_argument("--scenes", type=int, default=SCENES, help="how many gardens to render")
    parser.add_argument("--only-render", action="store_true", help="stop after the pictures")
    options = parser.parse_args()

    start = time.monotonic()
    folder = options.work / "pictures"
    data.render_scenes(folder, 0, options.scenes)
    rendered = time.monotonic()
    if options.only_render:
        return
    unseen = tuple(f"{seed:03d}_" for seed in range(options.scenes - UNSEEN_SCENES, options.scenes))
    paths = [p for p in sorted(folder.glob("*.png")) if int(p.name[:3]) < options.scenes]
    train = [data.planes(data.load(path)) for path in paths if not path.name.startswith(unseen)]

    torch.manual_seed(SEED)
    torch.use_deterministic_algorithms(True)
    network = Network()
    training.fit(
        network,
        train,
        options.iterations,
        options.batch,
        SEED,
        lambda line: print(line, flush=True),
    )
    export.export(network, options.out)
    facts = {
        "parameters": sum(p.numel() for p in network.parameters()),
        "bytes": options.out.stat().st_size,
        "training_pictures": len(train),
        "seconds": {"render": round(rendered - start), "train": round(time.monotonic() - rendered)},
        "unseen_gardens": export.measure(
            options.out,
            [p for p in paths if p.name.startswith(unseen)],
            options.work / "unseen.png",
        ),
        "demo": export.measure(
            options.out, sorted(options.demo.glob("*.jpg")), options.work / "demo.png"
        ),
    }
    (options.work / "facts.json").write_text(json.dumps(facts, indent=1) + "\n")
    print(json.dumps(facts, indent=1))


if __name__ == "__main__":
    main()
