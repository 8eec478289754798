"""Writes the tiny ONNX files that the teacher loader's tests read.

    python tools/make_test_onnx.py --out tests/fixtures/onnx

Needs `tools/requirements.txt` (only onnx). See `tests/fixtures/onnx/README.md` for what they hold.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import onnx
from onnx import TensorProto, helper

OPSET = 17
SIDE = 32
# a = 40 (2 g - 1), b = -30 (2 g - 1) + 10, with g the mean of the three channels.
A_SLOPE, A_OFFSET = 80.0, -40.0
B_SLOPE, B_OFFSET = -60.0, 40.0

Shape = list[int | str]


def save(
    path: Path, nodes: list[onnx.NodeProto], inputs: dict[str, Shape], outputs: dict[str, Shape],
    constants: list[onnx.TensorProto],
) -> None:  # fmt: skip
    """Checks and writes one float32 graph."""
    graph = helper.make_graph(
        nodes,
        path.stem,
        [helper.make_tensor_value_info(n, TensorProto.FLOAT, s) for n, s in inputs.items()],
        [helper.make_tensor_value_info(n, TensorProto.FLOAT, s) for n, s in outputs.items()],
        constants,
    )
    # Format 8 is what opset 17 came with; older runtimes refuse newer ones.
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", OPSET)], ir_version=8)
    onnx.checker.check_model(model, full_check=True)
    onnx.save(model, path)


def convolution(
    inside: int, outside: int, weights: list[float], bias: list[float]
) -> list[onnx.TensorProto]:
    """Weights (outside, inside, 1, 1) and bias of a pointwise convolution."""
    return [
        helper.make_tensor("weights", TensorProto.FLOAT, [outside, inside, 1, 1], weights),
        helper.make_tensor("bias", TensorProto.FLOAT, [outside], bias),
    ]


def ddcolor_tiny(path: Path) -> None:
    """DDColor's contract at 32 x 32 with an answer in closed form."""
    weights = [A_SLOPE / 3] * 3 + [B_SLOPE / 3] * 3
    save(
        path, [helper.make_node("Conv", ["input", "weights", "bias"], ["output"])],
        {"input": [1, 3, SIDE, SIDE]}, {"output": [1, 2, SIDE, SIDE]},
        convolution(3, 2, weights, [A_OFFSET, B_OFFSET]),
    )  # fmt: skip


def wrong_rank(path: Path) -> None:
    """An input of rank 2, as of a table."""
    save(
        path,
        [helper.make_node("Relu", ["input"], ["output"])],
        {"input": [1, 8]},
        {"output": [1, 8]},
        [],
    )


def wrong_channels(path: Path) -> None:
    """DDColor's input, but five output channels: neither a, b nor RGB."""
    save(
        path, [helper.make_node("Conv", ["input", "weights", "bias"], ["output"])],
        {"input": [1, 3, SIDE, SIDE]}, {"output": [1, 5, SIDE, SIDE]},
        convolution(3, 5, [1 / 3] * 15, [0.0] * 5),
    )  # fmt: skip


def two_inputs(path: Path) -> None:
    """Two inputs that no profile knows: a gray picture and a style picture."""
    save(
        path, [helper.make_node("Add", ["input", "style"], ["sum"]),
               helper.make_node("Conv", ["sum", "weights", "bias"], ["output"])],
        {"input": [1, 3, SIDE, SIDE], "style": [1, 3, SIDE, SIDE]}, {"output": [1, 2, SIDE, SIDE]},
        convolution(3, 2, [0.0] * 6, [0.0, 0.0]),
    )  # fmt: skip


def truncated(path: Path, whole: Path) -> None:
    """The first two thirds of a good file."""
    content = whole.read_bytes()
    path.write_bytes(content[: 2 * len(content) // 3])


def perceptual(path: Path, height: int | str, width: int | str) -> None:
    """A perceptual distance in closed form: the mean squared difference of two pictures."""
    picture: Shape = [1, 3, height, width]
    save(
        path, [helper.make_node("Sub", ["first", "second"], ["difference"]),
               helper.make_node("Mul", ["difference", "difference"], ["square"]),
               helper.make_node("ReduceMean", ["square"], ["distance"], keepdims=1)],
        {"first": picture, "second": picture}, {"distance": [1, 1, 1, 1]}, [],
    )  # fmt: skip


def main() -> None:
    """Writes all files."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("tests/fixtures/onnx"))
    folder = parser.parse_args().out
    folder.mkdir(parents=True, exist_ok=True)
    for make in (ddcolor_tiny, wrong_rank, wrong_channels, two_inputs):
        make(folder / f"{make.__name__}.onnx")
    truncated(folder / "truncated.onnx", folder / "ddcolor_tiny.onnx")
    perceptual(folder / "perceptual.onnx", "H", "W")
    perceptual(folder / "perceptual_small.onnx", SIDE // 2, SIDE)
    for path in sorted(folder.glob("*.onnx")):
        print(f"{path.name}: {path.stat().st_size} bytes")


if __name__ == "__main__":
    main()
