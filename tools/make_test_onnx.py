"""Writes the tiny ONNX files that the teacher loader's tests read.

    python tools/make_test_onnx.py --out tests/fixtures/onnx

Needs `tools/requirements.txt` (only onnx). See `tests/fixtures/onnx/README.md` for what they hold.
"""

from __future__ import annotations

import argparse
import math
from pathlib import Path

import onnx
import onnx.numpy_helper
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
    constants: list[onnx.TensorProto], kind: dict[str, int] | None = None, opset: int = OPSET,
) -> None:  # fmt: skip
    """Checks and writes one graph, float32 but for inputs and outputs of another `kind`."""
    kind = kind or {}
    graph = helper.make_graph(
        nodes,
        path.stem,
        [
            helper.make_tensor_value_info(n, kind.get(n, TensorProto.FLOAT), s)
            for n, s in inputs.items()
        ],
        [
            helper.make_tensor_value_info(n, kind.get(n, TensorProto.FLOAT), s)
            for n, s in outputs.items()
        ],
        constants,
    )
    # Format 8 is what opset 17 came with; older runtimes refuse newer ones.
    format_version = 8 if opset <= OPSET else 10
    imports = [helper.make_opsetid("", opset)]
    model = helper.make_model(graph, opset_imports=imports, ir_version=format_version)
    onnx.save(model, path)
    # By its path, so that weights beside it are found.
    onnx.checker.check_model(str(path), full_check=True)


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


def unit_tiny(path: Path) -> None:
    """x = L / 50 - 1 in, a / 110 and b / 110 out: tanh(x / 4 + 0.1) and tanh(0.15 - x / 5)."""
    save(
        path,
        [helper.make_node("Conv", ["input", "weights", "bias"], ["plain"]),
         helper.make_node("Tanh", ["plain"], ["output"])],
        {"input": [1, 1, SIDE, SIDE]}, {"output": [1, 2, SIDE, SIDE]},
        convolution(1, 2, [0.25, -0.2], [0.1, 0.15]),
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
        kind={"class": TensorProto.INT64},
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


AB_WEIGHTS = [A_SLOPE / 3] * 3 + [B_SLOPE / 3] * 3
AB_BIAS = [A_OFFSET, B_OFFSET]
AB_NODES = [helper.make_node("Conv", ["input", "weights", "bias"], ["output"])]
AB_SHAPES: tuple[dict[str, Shape], dict[str, Shape]] = (
    {"input": [1, 3, SIDE, SIDE]},
    {"output": [1, 2, SIDE, SIDE]},
)


def half_tiny(path: Path) -> None:
    """ddcolor_tiny in 16-bit floats, in and out."""
    constants = [
        helper.make_tensor("weights", TensorProto.FLOAT16, [2, 3, 1, 1], AB_WEIGHTS),
        helper.make_tensor("bias", TensorProto.FLOAT16, [2], AB_BIAS),
    ]
    kind = {"input": TensorProto.FLOAT16, "output": TensorProto.FLOAT16}
    save(path, AB_NODES, *AB_SHAPES, constants, kind)


def int8_tiny(path: Path) -> None:
    """ddcolor_tiny with weights of 8 bits, in steps of 2/3."""
    nodes = [helper.make_node("DequantizeLinear", ["bytes", "step"], ["weights"]), *AB_NODES]
    weights = [round(3 * weight / 2) for weight in AB_WEIGHTS]
    constants = [
        helper.make_tensor("bytes", TensorProto.INT8, [2, 3, 1, 1], weights),
        helper.make_tensor("step", TensorProto.FLOAT, [], [2 / 3]),
        helper.make_tensor("bias", TensorProto.FLOAT, [2], AB_BIAS),
    ]
    save(path, nodes, *AB_SHAPES, constants)


def old_tiny(path: Path) -> None:
    """ddcolor_tiny in opset 11."""
    save(path, AB_NODES, *AB_SHAPES, convolution(3, 2, AB_WEIGHTS, AB_BIAS), opset=11)


def new_tiny(path: Path) -> None:
    """ddcolor_tiny in opset 21."""
    save(path, AB_NODES, *AB_SHAPES, convolution(3, 2, AB_WEIGHTS, AB_BIAS), opset=21)


def outside_tiny(path: Path) -> None:
    """ddcolor_tiny whose weights lie in outside_tiny.data."""
    data = b""
    constants = []
    for constant in convolution(3, 2, AB_WEIGHTS, AB_BIAS):
        floats = onnx.numpy_helper.to_array(constant).tobytes()
        constant.ClearField("float_data")
        constant.data_location = TensorProto.EXTERNAL
        where = {"location": "outside_tiny.data", "offset": len(data), "length": len(floats)}
        for key, value in where.items():
            constant.external_data.add(key=key, value=str(value))
        data += floats
        constants.append(constant)
    path.with_suffix(".data").write_bytes(data)
    save(path, AB_NODES, *AB_SHAPES, constants)


def pixels_tiny(path: Path) -> None:
    """RGB in bytes, pixel by pixel and two pictures at once: r, g, b of half the gray, moved."""
    nodes = [
        helper.make_node("Cast", ["input"], ["floats"], to=TensorProto.FLOAT),
        helper.make_node("Transpose", ["floats"], ["planes"], perm=[0, 3, 1, 2]),
        helper.make_node("Conv", ["planes", "weights", "bias"], ["moved"]),
        helper.make_node("Transpose", ["moved"], ["pixels"], perm=[0, 2, 3, 1]),
        helper.make_node("Cast", ["pixels"], ["output"], to=TensorProto.UINT8),
    ]
    weights = [RGB_SLOPE * (i == j) for i in range(3) for j in range(3)]
    shape: Shape = [2, SIDE, SIDE, 3]
    kind = {"input": TensorProto.UINT8, "output": TensorProto.UINT8}
    bias = [255.0 * offset for offset in RGB_OFFSET]
    save(path, nodes, {"input": shape}, {"output": shape}, convolution(3, 3, weights, bias), kind)


def two_answers_tiny(path: Path) -> None:
    """ddcolor_tiny's answer, `ab`, behind another output of its shape, `half`."""
    nodes = [
        helper.make_node("Conv", ["input", "weights", "bias"], ["ab"]),
        helper.make_node("Mul", ["ab", "share"], ["half"]),
    ]
    share = helper.make_tensor("share", TensorProto.FLOAT, [], [0.5])
    outputs: dict[str, Shape] = {"half": [1, 2, SIDE, SIDE], "ab": [1, 2, SIDE, SIDE]}
    constants = [*convolution(3, 2, AB_WEIGHTS, AB_BIAS), share]
    save(path, nodes, {"input": [1, 3, SIDE, SIDE]}, outputs, constants)


def endless_tiny(path: Path) -> None:
    """ddcolor_tiny's answer after a loop that never ends."""
    number, truth = TensorProto.INT64, TensorProto.BOOL
    count = helper.make_tensor_value_info("count", number, [])
    before = helper.make_tensor_value_info("before", truth, [])
    after = helper.make_tensor_value_info("after", truth, [])
    state = [
        helper.make_tensor_value_info(name, TensorProto.FLOAT, [1, 2, SIDE, SIDE])
        for name in ("state", "next")
    ]
    body = helper.make_graph(
        [
            helper.make_node("Identity", ["before"], ["after"]),
            helper.make_node("Neg", ["state"], ["next"]),
        ],
        "body", [count, before, state[0]], [after, state[1]],
    )  # fmt: skip
    nodes = [
        helper.make_node("Conv", ["input", "weights", "bias"], ["ab"]),
        helper.make_node("Loop", ["", "true", "ab"], ["output"], body=body),
    ]
    forever = helper.make_tensor("true", truth, [], [True])
    constants = [*convolution(3, 2, AB_WEIGHTS, AB_BIAS), forever]
    save(path, nodes, {"input": [1, 3, SIDE, SIDE]}, {"output": [1, 2, SIDE, SIDE]}, constants)


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


def detector_tiny(path: Path) -> None:
    """YOLOX's contract: one box of 16 x 8 pixels around (12, 10), scored by the channels' means."""
    boxes, numbers, row = 21, 8, 5
    constant = [0.0] * (boxes * numbers)
    constant[row * numbers : row * numbers + 5] = [0.5, 0.25, math.log(2.0), 0.0, 1.0]
    means = [0.0] * (3 * boxes * numbers)
    for channel in range(3):
        means[channel * boxes * numbers + row * numbers + 5 + channel] = 1 / 255
    save(
        path, [helper.make_node("ReduceMean", ["images"], ["mean"], axes=[2, 3], keepdims=0),
               helper.make_node("Gemm", ["mean", "means", "constant"], ["flat"]),
               helper.make_node("Reshape", ["flat", "shape"], ["output"])],
        {"images": [1, 3, SIDE, SIDE]}, {"output": [1, boxes, numbers]},
        [helper.make_tensor("means", TensorProto.FLOAT, [3, boxes * numbers], means),
         helper.make_tensor("constant", TensorProto.FLOAT, [boxes * numbers], constant),
         helper.make_tensor("shape", TensorProto.INT64, [3], [1, boxes, numbers])],
    )  # fmt: skip


def main() -> None:
    """Writes all files."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("tests/fixtures/onnx"))
    folder = parser.parse_args().out
    folder.mkdir(parents=True, exist_ok=True)
    for make in (
        ddcolor_tiny, siggraph17_tiny, unit_tiny, siggraph17_full_tiny, caffe_v2_tiny,
        bigcolor_tiny,
        deoldify_tiny, deoldify_browser_tiny, half_tiny, int8_tiny, old_tiny, new_tiny,
        outside_tiny, pixels_tiny, two_answers_tiny, endless_tiny, wrong_rank, wrong_channels, two_inputs,
        detector_tiny,
    ):  # fmt: skip
        make(folder / f"{make.__name__}.onnx")
    truncated(folder / "truncated.onnx", folder / "ddcolor_tiny.onnx")
    perceptual(folder / "perceptual.onnx", "H", "W")
    perceptual(folder / "perceptual_small.onnx", SIDE // 2, SIDE)
    for path in sorted(folder.glob("*.onnx")):
        print(f"{path.name}: {path.stat().st_size} bytes")


if __name__ == "__main__":
    main()
