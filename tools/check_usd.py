#!/usr/bin/env python3
"""Lets OpenUSD open a `.usda` that `export` wrote, and compares it with a `.ply` of the same scene.

    python3 -m venv usd && usd/bin/pip install usd-core==26.11
    gs-chroma export runs/demo -o demo.ply && gs-chroma export runs/demo -o demo.usda
    usd/bin/python tools/check_usd.py demo.usda demo.ply

Types must be those of the schema, and every number that of the `.ply`, turned about z by half a
turn. Prints one line; status 1 where anything differs.
"""

import array
import math
import sys

from pxr import Usd, UsdGeom, UsdVol

TYPE = "ParticleField3DGaussianSplat"
# Relative to the larger of the number and 1: text has every digit of a float, exp and the sigmoid
# are made in another precision.
TOLERANCE = 2e-6
# Half a turn about z changes the sign of the harmonics of odd order.
ORDERS = [order for degree in range(4) for order in range(-degree, degree + 1)]


def read_ply(path):
    """Columns of floats by their names."""
    with open(path, "rb") as file:
        header, body = file.read().split(b"end_header\n", 1)
    lines = header.decode().splitlines()
    names = [line.split()[-1] for line in lines if line.startswith("property float ")]
    values = array.array("f", body)
    return {name: values[k :: len(names)] for k, name in enumerate(names)}


def expected(ply):
    """Attributes by their names, a tuple a value."""
    count = len(ply["x"])
    terms = (len([name for name in ply if name.startswith("f_rest_")]) + 3) // 3
    zipped = lambda *names: list(zip(*(ply[name] for name in names)))
    coefficients = []
    for i in range(count):
        for k in range(terms):
            sign = -1 if ORDERS[k] % 2 else 1
            name = lambda channel: f"f_dc_{channel}" if k == 0 else f"f_rest_{channel * (terms - 1) + k - 1}"
            coefficients.append(tuple(sign * ply[name(channel)][i] for channel in range(3)))
    # (0, 0, 0, 1) · q, of unit length.
    turned = [(-z, -y, x, w) for w, x, y, z in zipped("rot_0", "rot_1", "rot_2", "rot_3")]
    return terms, {
        "positions": [(-x, -y, z) for x, y, z in zipped("x", "y", "z")],
        "orientations": [tuple(v / math.hypot(*q) for v in q) for q in turned],
        "scales": [tuple(map(math.exp, s)) for s in zipped("scale_0", "scale_1", "scale_2")],
        "opacities": [(1 / (1 + math.exp(-logit)),) for logit in ply["opacity"]],
        "radiance:sphericalHarmonicsCoefficients": coefficients,
    }


def numbers(value):
    """A value of OpenUSD as a tuple; of a quaternion w, x, y, z."""
    if hasattr(value, "real") and hasattr(value, "imaginary"):
        return (value.real, *value.imaginary)
    return tuple(value) if hasattr(value, "__len__") else (value,)


def apart(a, b):
    return max(abs(x - y) / max(1, abs(y)) for x, y in zip(a, b, strict=True))


def differences(path, ply):
    """What is wrong, a line each."""
    stage = Usd.Stage.Open(path)
    prim = stage.GetDefaultPrim()
    if not prim.IsA(UsdVol.ParticleField3DGaussianSplat):
        yield f"the prim is a {prim.GetTypeName() or 'nothing'}, not a {TYPE}"
        return
    if UsdGeom.GetStageUpAxis(stage) != "Y":
        yield "y is not up"
    schema = Usd.SchemaRegistry().FindConcretePrimDefinition(TYPE)
    for attribute in prim.GetAuthoredAttributes():
        known = schema.GetSchemaAttributeSpec(attribute.GetName())
        if known is None or known.typeName != attribute.GetTypeName():
            yield f"{attribute.GetName()} is a {attribute.GetTypeName()}, which the schema has not"
    terms, wanted = expected(read_ply(ply))
    degree = prim.GetAttribute("radiance:sphericalHarmonicsDegree").Get()
    element = prim.GetAttribute("radiance:sphericalHarmonicsCoefficients").GetMetadata("elementSize")
    if ((degree + 1) ** 2, element) != (terms, terms):
        yield f"degree {degree} and {element} coefficients a Gaussian instead of {terms}"
    for name, values in wanted.items():
        found = [numbers(value) for value in prim.GetAttribute(name).Get() or []]
        if len(found) != len(values):
            yield f"{name}: {len(found)} instead of {len(values)}"
            continue
        both = lambda a, b: min(apart(a, b), apart([-x for x in a], b)) if name == "orientations" else apart(a, b)
        worst = max(map(both, found, values), default=0)
        # Positively written: what is not a number is no agreement.
        if not worst <= TOLERANCE:
            yield f"{name}: {worst:.1e} apart"


def main():
    usda, ply = sys.argv[1:]
    wrong = list(differences(usda, ply))
    for line in wrong:
        print(f"{usda}: {line}", file=sys.stderr)
    if not wrong:
        version = ".".join(map(str, Usd.GetVersion()[1:]))
        print(f"{usda}: a {TYPE} to OpenUSD {version}, every number as in {ply}")
    sys.exit(bool(wrong))


main()
