#!/usr/bin/env python3
"""Makes a splat file of many Gaussians, to try viewers with: balls on a chequered ground.

    python3 tools/make_large_splats.py large.ply --count 1000000 --degree 0

The Gaussians lie on surfaces, as those of a trained scene do; each is about as large as the gap
to its neighbors. The same count, degree and seed give the same bytes. Needs NumPy.
"""

import argparse

import numpy as np

BALLS = 24
C0 = 0.28209479177387814


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("output")
    parser.add_argument("--count", type=int, default=1_000_000)
    parser.add_argument("--degree", type=int, default=0, choices=range(4))
    parser.add_argument("--seed", type=int, default=0)
    asked = parser.parse_args()
    random = np.random.default_rng(asked.seed)
    count = asked.count

    # Half of them on the ground, the others on balls that stand on it; y points down.
    on_ground = random.random(count) < 0.5
    ground = np.stack([random.uniform(-6, 6, count), np.zeros(count), random.uniform(-6, 6, count)], 1)
    normal = random.standard_normal((count, 3))
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    ball = random.integers(0, BALLS, count)
    radius = random.uniform(0.3, 0.9, BALLS)
    place = random.uniform(-4.5, 4.5, (BALLS, 3))
    place[:, 1] = -radius
    on_ball = place[ball] + radius[ball, None] * normal
    mean = np.where(on_ground[:, None], ground, on_ball)
    normal = np.where(on_ground[:, None], [[0.0, 1.0, 0.0]], normal)

    chequered = (np.floor(ground[:, 0]) + np.floor(ground[:, 2])) % 2
    paint = random.uniform(0.1, 0.9, (BALLS, 3))
    light = 0.6 + 0.4 * np.clip(-normal[:, 1], 0, 1)
    color = np.where(on_ground[:, None], (0.25 + 0.5 * chequered)[:, None], paint[ball] * light[:, None])
    color = np.clip(color + 0.02 * random.standard_normal((count, 3)), 0, 1)

    # Flat along the normal: the rotation that takes z there.
    half = normal + [0.0, 0.0, 1.0]
    quat = np.stack([half[:, 2], -half[:, 1], half[:, 0], np.zeros(count)], 1)
    length = np.linalg.norm(quat, axis=1, keepdims=True)
    quat = np.where(length > 1e-6, quat / np.maximum(length, 1e-6), [[0.0, 1.0, 0.0, 0.0]])
    gap = np.where(on_ground, 12 / np.sqrt(count / 2), radius[ball] * np.sqrt(4 * np.pi * 2 * BALLS / count))
    scale = np.log(np.stack([gap, gap, gap * 0.1], 1) * random.uniform(0.6, 1.4, (count, 1)))
    opacity = random.uniform(0.0, 4.0, count)
    rest = 0.05 * random.standard_normal((count, 3 * ((asked.degree + 1) ** 2 - 1)))

    names = ["x", "y", "z", "f_dc_0", "f_dc_1", "f_dc_2"]
    names += [f"f_rest_{k}" for k in range(rest.shape[1])]
    names += ["opacity", "scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3"]
    rows = np.concatenate([mean, (color - 0.5) / C0, rest, opacity[:, None], scale, quat], 1)
    with open(asked.output, "wb") as file:
        file.write(f"ply\nformat binary_little_endian 1.0\nelement vertex {count}\n".encode())
        file.writelines(f"property float {name}\n".encode() for name in names)
        file.write(b"end_header\n")
        file.write(rows.astype("<f4").tobytes())


if __name__ == "__main__":
    main()
