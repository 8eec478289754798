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

# RGB of the tiny networks that answer with RGB, in units of white.
RGB_SLOPE, RGB_OFFSET = 0.5, [0.4, 0.2, 0.1]

Shape = list[int | str]


def save(
    path: Path, nodes: list[onnx.NodeProto], inputs: dict[str, Shape], outputs: dict[str, Shape],
    constants: list[onnx.TensorProto], integers: tuple[str, ...] = (),
) -> None:  # fmt: skip
    """Checks and writes one graph, float32 but for the inputs named in `integers`."""
    kind = {name: TensorProto.INT64 for name in integers}
    graph = helper.make_graph(
        nodes,
        path.stem,
        [
            helper.make_tensor_value_info(n, kind.get(n, TensorProto.FLOAT), s)
            for n, s in inputs.items()
        ],
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


def siggraph17_tiny(path: Path) -> None:
    """Lightness in, a and b out: a = L / 2 - 10, b = 5 - L / 4."""
    save(
        path, [helper.make_node("Conv", ["input", "weights", "bias"], ["output"])],
        {"input": [1, 1, SIDE, SIDE]}, {"output": [1, 2, SIDE, SIDE]},
        convolution(1, 2, [0.5, -0.25], [-10.0, 5.0]),
    )  # fmt: skip


def siggraph17_full_tiny(path: Path) -> None:
    """Lightness, hints and mask in: a = L / 5 + hint a / 2 + 10 mask, b = hint b - 5 mask - L / 10."""
    save(
        path,
        [helper.make_node("Concat", ["input_A", "input_B", "mask_B"], ["all"], axis=1),
         helper.make_node("Conv", ["all", "weights", "bias"], ["output"])],
        {"input_A": [1, 1, SIDE, SIDE], "input_B": [1, 2, SIDE, SIDE],
         "mask_B": [1, 1, SIDE, SIDE]},
        {"output": [1, 2, SIDE, SIDE]},
        convolution(4, 2, [0.2, 0.5, 0.0, 10.0, -0.1, 0.0, 1.0, -5.0], [0.0, 0.0]),
    )  # fmt: skip


def caffe_v2_tiny(path: Path) -> None:
    """Lightness less 50 in, a quarter of the size out: a = x, b = 20 - x / 2."""
    save(
        path,
        [helper.make_node("AveragePool", ["data_l"], ["small"], kernel_shape=[4, 4],
                          strides=[4, 4]),
         helper.make_node("Conv", ["small", "weights", "bias"], ["class8_ab"])],
        {"data_l": [1, 1, SIDE, SIDE]}, {"class8_ab": [1, 2, SIDE // 4, SIDE // 4]},
        convolution(1, 2, [1.0, -0.5], [0.0, 20.0]),
    )  # fmt: skip


def bigcolor_tiny(path: Path) -> None:
    """Gray, class and code in; RGB from -1 to 1 out, moved by the class and by 0 times the code."""
    side: Shape = ["h", "w"]
    save(
        path,
        [helper.make_node("Cast", ["class"], ["number"], to=TensorProto.FLOAT),
         helper.make_node("ReduceSum", ["z"], ["sum"], keepdims=0),
         helper.make_node("Mul", ["sum", "nothing"], ["moved"]),
         helper.make_node("Conv", ["gray", "weights", "bias"], ["plain"]),
         helper.make_node("Add", ["plain", "number"], ["with_class"]),
         helper.make_node("Add", ["with_class", "moved"], ["rgb"])],
        {"gray": [1, 1, *side], "class": [1], "z": [1, 119]}, {"rgb": [1, 3, *side]},
        [*convolution(1, 3, [2 * RGB_SLOPE] * 3, [2 * offset - 1 for offset in RGB_OFFSET]),
         helper.make_tensor("nothing", TensorProto.FLOAT, [], [0.0])],
        integers=("class",),
    )  # fmt: skip


def rgb_network(path: Path, white: float, sides: Shape) -> None:
    """RGB in and out, white being `white`; each output channel has its own input channel."""
    weights = [RGB_SLOPE * (i == j) for i in range(3) for j in range(3)]
    save(
        path, [helper.make_node("Conv", ["input", "weights", "bias"], ["output"])],
        {"input": [1, 3, *sides]}, {"output": [1, 3, *sides]},
        convolution(3, 3, weights, [white * offset for offset in RGB_OFFSET]),
    )  # fmt: skip


def deoldify_tiny(path: Path) -> None:
    """DeOldify from 0 to 255 with open sides."""
    rgb_network(path, 255.0, ["H", "W"])


def deoldify_browser_tiny(path: Path) -> None:
    """DeOldify from 0 to 1."""
    rgb_network(path, 1.0, [SIDE, SIDE])


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
    for make in (
        ddcolor_tiny, siggraph17_tiny, siggraph17_full_tiny, caffe_v2_tiny, bigcolor_tiny,
        deoldify_tiny, deoldify_browser_tiny, wrong_rank, wrong_channels, two_inputs,
    ):  # fmt: skip
        make(folder / f"{make.__name__}.onnx")
    truncated(folder / "truncated.onnx", folder / "ddcolor_tiny.onnx")
    perceptual(folder / "perceptual.onnx", "H", "W")
    perceptual(folder / "perceptual_small.onnx", SIDE // 2, SIDE)
    for path in sorted(folder.glob("*.onnx")):
        print(f"{path.name}: {path.stat().st_size} bytes")


if __name__ == "__main__":
    main()
