"""Draws what an iteration costs: docs/images/cost.svg from `cargo bench`.

    cargo bench -- --full --csv cost.csv
    python3 tools/plot_cost.py cost.csv -o docs/images/cost.svg

Needs matplotlib (tools/requirements.txt).
"""

import argparse
import csv
from collections import defaultdict

import matplotlib

matplotlib.use("svg")
import matplotlib.pyplot as plt  # noqa: E402

# Kernels by what their work grows with; the rest is below what a plot shows.
GROUPS = {
    "lists": ["project", "compact", "scan_reduce", "scan_sums", "scan_apply", "sort_count",
              "sort_scatter", "tile_lists", "tile_ranges"],
    "blending": ["shade", "blend"],
    "loss": ["luma_loss", "luma_loss_backward", "sum_loss"],
    "adjoint": ["blend_backward", "sum_instances"],
    "steps": ["shade_backward", "project_backward"],
}


def read(path):
    """Seconds by (splats, width) and kernel."""
    costs = defaultdict(dict)
    with open(path, newline="", encoding="utf-8") as file:
        for row in csv.DictReader(file):
            size = int(row["splats"]), int(row["width"])
            costs[size][row["kernel"]] = float(row["seconds"])
    return costs


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("csv")
    parser.add_argument("-o", "--output", required=True)
    arguments = parser.parse_args()
    costs = read(arguments.csv)
    counts = sorted({splats for splats, _ in costs})
    widths = sorted({width for _, width in costs})

    figure, panels = plt.subplots(1, 2, figsize=(10, 4.2))
    by_count, by_pixels = panels
    for width in widths:
        known = [n for n in counts if (n, width) in costs]
        times = [1e3 * costs[n, width]["iteration"] for n in known]
        by_count.plot(known, times, "o-", label=f"{width} × {width * 9 // 16} px")
    by_count.set_xlabel("Gaussians")
    for count in counts:
        known = [w for w in widths if (count, w) in costs]
        times = [1e3 * costs[count, w]["iteration"] for w in known]
        by_pixels.plot([w * (w * 9 // 16) for w in known], times, "o-", label=f"{count:,} Gaussians")
    by_pixels.set_xlabel("pixels")
    for panel in panels:
        panel.set_xscale("log")
        panel.set_yscale("log")
        panel.set_ylabel("ms an iteration")
        panel.grid(True, which="both", alpha=0.25)
        panel.legend()
    figure.tight_layout()
    figure.savefig(arguments.output, metadata={"Date": None})

    print("| Gaussians | width | " + " | ".join(GROUPS) + " | all, ms |")
    print("|--:|--:|" + "--:|" * (len(GROUPS) + 1))
    for (splats, width), kernels in sorted(costs.items()):
        device = sum(t for kernel, t in kernels.items() if kernel != "iteration")
        shares = [sum(kernels.get(k, 0.0) for k in group) / device for group in GROUPS.values()]
        cells = " | ".join(f"{100 * share:.0f} %" for share in shares)
        print(f"| {splats} | {width} | {cells} | {1e3 * kernels['iteration']:.1f} |")


if __name__ == "__main__":
    main()
