"""A whole job from Python: photos with poses in, colored pictures and a colored splat file out.

    pip install pillow      # beside gs_chroma: docs/python.md
    python examples/color_scene.py COLMAP_DIR OUT
"""

import sys
from pathlib import Path

import numpy as np
from PIL import Image

import gs_chroma


def teacher(gray):
    """Colors a photo, [H, W] in 0 to 1, sepia: a and b of CIELAB, [H, W, 2].

    A network of PyTorch would be: return model(torch.from_numpy(gray)[None, None])[0].permute(1, 2, 0)
    """
    strength = 4 * gray * (1 - gray)
    return np.stack([8 * strength, 24 * strength], axis=2)


capture, out = map(Path, sys.argv[1:3])
(out / "photos").mkdir(parents=True, exist_ok=True)
dataset = gs_chroma.Dataset.open(capture, max_side=160)
scene = gs_chroma.fit(dataset, preset="draft", iterations=300, progress=print)
colored = gs_chroma.colorize(scene, teacher, progress=print)
colored.splats.write(out / "scene.ply")
for view, name in enumerate(dataset.names):
    path = out / "photos" / Path(name).with_suffix(".png").name
    Image.fromarray(colored.photo(view)).save(path)
print(f"{len(colored.splats)} Gaussians and {len(dataset)} photos in {out}")
