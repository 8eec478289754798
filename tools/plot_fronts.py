"""Draws the fronts of several sweeps beside each other and prints what each knob costs.

    gs-chroma tradeoff SCENE -o runs/SCENE-tradeoff          # for each scene
    python3 tools/plot_fronts.py runs/*-tradeoff/tradeoff.json -o fronts.svg

Needs matplotlib (tools/requirements.txt). For one scene `tradeoff` draws a page by itself.
"""

import argparse
import json
from pathlib import Path

import matplotlib

matplotlib.use("svg")
import matplotlib.pyplot as plt  # noqa: E402

# Stages with the measure of each, whether more of it is better, its unit, its digits.
STAGES = {
    "luma": ("psnr", True, "held-out PSNR, dB", 2),
    "color": ("delta_e", False, "held-out ΔE00", 2),
}


def read(path, stage):
    """The points of a stage that did not fail: what was turned, seconds, measure, SSIM."""
    points = []
    for point in json.loads(Path(path).read_text(encoding="utf-8"))["points"]:
        outcome = point["outcome"]
        if point["stage"] != stage or outcome is None or outcome[STAGES[stage][0]] is None:
            continue
        words = [f"{setting['knob']}={setting['value']}" for setting in point["settings"]]
        after = [f"after {point['after']}"] if point["after"] is not None else []
        points.append(
            {
                "settings": " ".join((words or ["base"]) + after),
                # What is turned alone has a color of its own.
                "knob": words[0].split("=")[0] if len(words) == 1 else None,
                "base": not words and not after,
                "after": bool(after),
                "seconds": outcome["seconds"],
                "quality": outcome[STAGES[stage][0]],
                "ssim": outcome["ssim"],
                "splats": outcome["splats"],
            }
        )
    return points


def front(points, more):
    """Those than which none is both faster and better, by time."""
    best, kept = None, []
    for point in sorted(points, key=lambda p: (p["seconds"], -p["quality"] if more else p["quality"])):
        if best is None or (point["quality"] > best if more else point["quality"] < best):
            best = point["quality"]
            kept.append(point)
    return kept


def scene_of(path):
    return Path(path).parent.name.removesuffix("-tradeoff")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("sweeps", nargs="+")
    parser.add_argument("--stage", choices=STAGES, default="luma")
    parser.add_argument("-o", "--output", required=True)
    arguments = parser.parse_args()
    _, more, label, digits = STAGES[arguments.stage]
    sweeps = {scene_of(path): read(path, arguments.stage) for path in arguments.sweeps}
    sweeps = {scene: points for scene, points in sweeps.items() if points}

    knobs = sorted({p["knob"] for points in sweeps.values() for p in points if p["knob"]})
    colors = {knob: f"C{index % 10}" for index, knob in enumerate(knobs)}
    marks = {knob: "os^vD<>ph*"[index // 10 % 10] for index, knob in enumerate(knobs)}
    figure, panels = plt.subplots(1, len(sweeps), figsize=(4.6 * len(sweeps), 4.4), squeeze=False)
    for panel, (scene, points) in zip(panels[0], sweeps.items()):
        line = front(points, more)
        panel.plot([p["seconds"] for p in line], [p["quality"] for p in line], "-", color="0.6", zorder=1, drawstyle="steps-post")
        for point in points:
            knob = point["knob"]
            color = colors.get(knob, "black" if point["base"] else "0.5")
            mark = "." if point["after"] else marks.get(knob, "X" if point["base"] else "+")
            at = point["seconds"], point["quality"]
            name = knob or ("base" if point["base"] else "on the way" if point["after"] else "smaller photos")
            panel.plot(*at, mark, color=color, markersize=7, label=None if knob and point["after"] else name)
            if knob and not point["after"]:
                # Which knob, the color says.
                value = point["settings"].split("=")[1]
                panel.annotate(value, at, textcoords="offset points", xytext=(6, -10), fontsize=7)
        panel.set_title(scene)
        panel.set_xlim(left=0)
        panel.margins(0.08)
        panel.set_xlabel("seconds")
        panel.grid(True, which="both", alpha=0.25)
        if not more:
            panel.invert_yaxis()
    panels[0][0].set_ylabel(label)
    unique = {}
    for panel in panels[0]:
        for handle, name in zip(*panel.get_legend_handles_labels()):
            unique.setdefault(name, handle)
    figure.legend(unique.values(), unique.keys(), loc="lower center", ncols=min(len(unique), 9), fontsize=8)
    figure.tight_layout(rect=(0, 0.07, 1, 1))
    figure.savefig(arguments.output, metadata={"Date": None})

    for scene, points in sweeps.items():
        base = next(p for p in points if p["base"])
        best = front(points, more)
        print(f"\n**{scene}**, base {base['seconds']:.0f} s, {base['quality']:.{digits}f}\n")
        print(f"| point | time, base = 1 | {label} | to the base | SSIM | Gaussians | on the front |")
        print("|---|--:|--:|--:|--:|--:|---|")
        for point in sorted(points, key=lambda p: p["seconds"]):
            ratio = point["seconds"] / base["seconds"]
            change = point["quality"] - base["quality"]
            mark = "yes" if point in best else ""
            ssim = "" if point["ssim"] is None else f"{point['ssim']:.3f}"
            print(
                f"| {point['settings']} | {ratio:.2f} | {point['quality']:.{digits}f} "
                f"| {change:+.{digits}f} | {ssim} | {point['splats']:,} | {mark} |"
            )


if __name__ == "__main__":
    main()
