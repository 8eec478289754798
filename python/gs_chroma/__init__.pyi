"""Colored 3D Gaussian scenes from grayscale photographs."""

from collections.abc import Callable, Mapping, Sequence
from os import PathLike
from typing import Any, Literal, TypedDict

import numpy as np
from numpy.typing import ArrayLike, NDArray
from typing_extensions import Unpack

__version__: str

_Path = str | PathLike[str]
_Report = Callable[[Progress], object]
_Float32 = NDArray[np.float32]
_Float64 = NDArray[np.float64]
_Uint8 = NDArray[np.uint8]
_Effect = Literal["exposure", "robust", "antialias", "background"]

class Error(Exception):
    """Error of gs-chroma."""

class CaptureError(Error):
    """Photos or their model cannot be loaded."""

class GpuError(Error):
    """The device failed or is missing."""

class LumaError(Error):
    """The training of a gray scene failed."""

class ChromaError(Error):
    """A scene cannot be colored."""

class TeacherError(Error):
    """A teacher cannot be opened, or its answer is no picture."""

class SplatError(Error):
    """A splat file cannot be read or written."""

class CommandError(Error):
    """A command on a run folder failed."""

class Progress:
    """Progress of a job; `str()` of it is a line."""

    stage: str
    """Stage of the job."""
    done: int
    """Steps of the stage that are done."""
    total: int
    """Steps of the stage in all; 0 where they are not counted."""
    message: str
    """The photo at hand, or figures of the moment."""
    loss: float | None
    """Loss, where something is trained or solved."""
    gaussians: int | None
    """Number of Gaussians, while they are trained."""

class Camera:
    """A pinhole camera with its pose, as COLMAP defines them: axes x right, y down, z forward; a
    point X of the world is at `rotation @ X + translation`; the center of the top left pixel is at
    (0.5, 0.5).
    """

    width: int
    """Width of the picture in pixels."""
    height: int
    """Height of the picture in pixels."""
    fx: float
    """Horizontal focal length in pixels."""
    fy: float
    """Vertical focal length in pixels."""
    cx: float
    """Horizontal principal point in pixels."""
    cy: float
    """Vertical principal point in pixels."""
    rotation: _Float64
    """World-to-camera rotation, float64 [3, 3]."""
    translation: _Float64
    """World-to-camera translation in world units, float64 [3]."""
    center: _Float64
    """The camera's center in world units, float64 [3]."""

    def __init__(
        self,
        width: int,
        height: int,
        fx: float,
        fy: float,
        cx: float,
        cy: float,
        rotation: ArrayLike,
        translation: ArrayLike,
    ) -> None: ...
    def resized(self, width: int, height: int) -> Camera:
        """The same view at another size."""

class LoadOptions(TypedDict, total=False):
    """Options of loading photos; docs/schemas/report.schema.json describes them (`capture`)."""

    max_side: int | None
    holdout: bool
    lens: Literal["auto", "on", "off"]
    channel: Literal["luma", "r", "g", "b"]
    encoding: Literal["auto", "srgb", "linear"]
    normalize: Literal["auto", "off"] | tuple[float, float]
    masks: str
    masked: Literal["ignore", "remove"]

class Dataset:
    """Photos of a COLMAP folder with their cameras, at working size. Photos are decoded when they
    are asked for.
    """

    names: list[str]
    """Name of each view: its photo's path below images/."""
    cameras: list[Camera]
    """Camera of each view, at working size."""
    train: list[int]
    """Indices of the views that are trained on."""
    test: list[int]
    """Indices of the views that are held out."""
    points: _Float64
    """COLMAP's points in world units, float64 [P, 3]."""
    extent: float
    """The scene's extent in world units: 1.1 times the largest distance of a camera from the
    cameras' mean.
    """
    offset: _Float64
    """Offset that was subtracted from COLMAP's coordinates, in world units, float64 [3]; zero
    unless these were large.
    """
    options: dict[str, Any]
    """Options of loading, as a dictionary."""

    @staticmethod
    def open(
        dir: _Path, *, progress: _Report | None = None, **options: Unpack[LoadOptions]
    ) -> Dataset:
        """Opens a COLMAP folder with images/ and sparse/.

        `max_side` is the longer side that larger photos are scaled to, in pixels. Every 8th view
        is held out, unless `holdout=False`. What is left out or doubtful is a warning.
        """

    def photo(self, view: int) -> _Uint8:
        """The gray photo of a view, uint8 [height, width], sRGB-encoded."""

    def mask(self, view: int) -> _Uint8 | None:
        """The mask of a view, uint8 [height, width]: 255 where a pixel counts; `None` where all do.
        """

    def __len__(self) -> int: ...

class GsplatParameters(TypedDict):
    """Parameters of gsplat: logarithms of scales, logits of opacities, quaternions w x y z."""

    means: _Float32
    scales: _Float32
    quats: _Float32
    opacities: _Float32
    sh0: _Float32
    shN: _Float32

class Splats:
    """A set of N Gaussians, as arrays of NumPy. An array that is read is a copy."""

    means: _Float32
    """Centers in world units, float32 [N, 3]."""
    log_scales: _Float32
    """Natural logarithms of the standard deviations along the rotated axes, in world units, float32
    [N, 3].
    """
    quaternions: _Float32
    """Rotations as quaternions w x y z of any length, float32 [N, 4]."""
    opacity_logits: _Float32
    """Logits of the opacities, float32 [N]."""
    sh: _Float32
    """SH coefficients, float32 [N, (degree + 1)², channels], in the order and with the signs of 3D
    Gaussian Splatting: 1 channel gray, 3 RGB, sRGB-encoded less 0.5; 2 CIELAB a and b.
    """
    offset: _Float64
    """Offset that was subtracted from COLMAP's coordinates, in world units, float64 [3]."""
    antialiased: bool
    """True if opacities fall by what the screen blur spreads (Mip-Splatting)."""

    def __init__(
        self,
        *,
        means: ArrayLike,
        log_scales: ArrayLike,
        quaternions: ArrayLike,
        opacity_logits: ArrayLike,
        sh: ArrayLike,
        offset: ArrayLike | None = None,
        antialiased: bool = False,
    ) -> None: ...
    @staticmethod
    def read(path: _Path) -> Splats:
        """Reads a splat file: .ply, .compressed.ply, .splat, .spz or .sog. What is doubtful about
        it is a warning.
        """

    def write(self, path: _Path) -> None:
        """Writes a splat file, whose name tells the format: .ply, .compressed.ply, .splat, .spz,
        .sog, .glb or .usda. Gray becomes RGB. What the format loses is a warning.
        """

    @staticmethod
    def from_gsplat(
        params: Mapping[str, Any], *, offset: ArrayLike | None = None, antialiased: bool = False
    ) -> Splats:
        """From the parameters of gsplat: a dictionary of arrays or tensors `means` [N, 3], `scales`
        (logarithms) [N, 3], `quats` (w x y z) [N, 4], `opacities` (logits) [N], `sh0` [N, 1, 3] and
        `shN` [N, K, 3], K being 0, 3, 8 or 15.
        """

    def to_gsplat(self) -> GsplatParameters:
        """The parameters of gsplat, a dictionary of float32 arrays as `from_gsplat` takes it."""

    def to_luma(self) -> Splats:
        """The same Gaussians in gray: one channel, the mean of all."""

    def __len__(self) -> int: ...

class LumaSettings(TypedDict, total=False):
    """Settings in the place of the preset's; docs/schemas/report.schema.json describes them (`luma.settings`)."""

    iterations: int
    max_splats: int
    seed: int
    stop_when_flat: float
    rules: Literal["own", "3dgs"]
    surround: bool
    fill_gaps: bool
    memory_limit: int
    stream_photos: bool
    haste: float

class LumaScene:
    """A trained gray scene."""

    splats: Splats
    """The Gaussians, one channel."""
    dataset: Dataset
    """Photos that it was trained on."""
    settings: dict[str, Any]
    """Settings of the training, as a dictionary."""
    effects: list[dict[str, Any]]
    """Effects of image formation with the evidence for them, a list of dictionaries."""
    curve: list[dict[str, float]]
    """Scores of held-out views during training, a list of dictionaries: `iteration`, `seconds`,
    `splats`, `psnr` in dB.
    """
    iterations: int
    """Iterations that led to the Gaussians."""

def fit(
    dataset: Dataset,
    *,
    preset: Literal["draft", "balanced", "paper"] | None = None,
    sh_degree: int | None = None,
    with_effects: Sequence[_Effect] | None = None,
    without_effects: Sequence[_Effect] | None = None,
    start: Splats | None = None,
    progress: _Report | None = None,
    **settings: Unpack[LumaSettings],
) -> LumaScene:
    """Trains a gray scene, geometry and luminance.

    `preset` is by default `paper` on a GPU, `draft` without one; it does not change the photos'
    size. `start` are Gaussians to begin with instead of COLMAP's points. `memory_limit` is in
    bytes of the device. `progress` is called with a `Progress`; an exception that it raises, or
    Ctrl-C, ends the training.
    """

class ChromaSettings(TypedDict, total=False):
    """Settings of the solver; docs/schemas/report.schema.json describes them (`chroma.settings`)."""

    solver: Literal["irls", "adam"]
    rounds: int
    robust: float | None
    settled: float
    ridge: float
    anchor: float
    match_saturation: bool
    fill: bool
    iterations: int
    scales: int
    seed: int
    memory_limit: int | None

class NetworkSettings(TypedDict, total=False):
    """Settings of a teacher; `upsample` also of a callable's small answers."""

    profile: str | None
    size: int | None
    device: Literal["auto", "cpu", "cuda", "directml", "coreml"]
    upsample: Literal["guided", "bilinear"]

class Colored:
    """A colored scene."""

    splats: Splats
    """The Gaussians with RGB harmonics, as splat files have them."""
    chroma: _Float32
    """SH coefficients of CIELAB a and b, float32 [N, (degree + 1)², 2], from which RGB is made."""
    dataset: Dataset
    """Photos that it was colored from."""
    settings: dict[str, Any]
    """Settings of the solver, as a dictionary."""
    saturation: float
    """Factor that makes colors as strong as the teacher's; it is in `splats` and `chroma`."""

    def photo(self, view: int) -> _Uint8:
        """The photo of a view in the scene's colors, at its own lightness: uint8 [height, width,
        3], sRGB. What the scene does not show stays gray.
        """

def colorize(
    scene: LumaScene | Splats,
    teacher: Callable[[_Float32], Any] | _Path,
    *,
    dataset: Dataset | None = None,
    sh_degree: int | Literal["auto"] = 0,
    correct_views: bool | None = None,
    network: NetworkSettings | None = None,
    progress: _Report | None = None,
    **settings: Unpack[ChromaSettings],
) -> Colored:
    """Colors a gray scene, or Gaussians of another program together with their `dataset`.

    A teacher is a callable, asked once for each photo: gray float32 [H, W] in 0 to 1, upright,
    in; CIELAB a and b [h, w, 2], or RGB [h, w, 3] as uint8 or floats from 0 to 1, or None, out.
    The answer may be of any size, an array or a tensor on any device. Or it is the path of an
    .onnx file or of a folder of colored photos, the name of a network (`gs-chroma teacher list`),
    or `photos`, whose own colors are meant. An exception of the callable comes back as it is.
    """

def render(
    scene: LumaScene | Colored | Splats, camera: Camera, *, near: float | None = None
) -> _Float32:
    """A picture of a scene: gray [height, width], RGB [height, width, 3], both sRGB in 0 to 1, or
    CIELAB a and b [height, width, 2]; float32.

    Nothing nearer than `near`, in world units, is shown; by default a hundredth of the extent.
    """

def device() -> str:
    """Name and driver of the device that jobs run on: the fastest one, or the one that the
    environment variable `WGPU_ADAPTER_NAME` named when the first job began.
    """

def evaluate(
    run: _Path | None = None, *, progress: _Report | None = None, **options: Any
) -> dict[str, Any]:
    """Measures a colored run, and gives what eval.json holds (docs/schemas/eval.schema.json).

    `options` are those of `gs-chroma eval`, with `_` for `-`: `teacher="ddcolor-tiny",
    baselines=True`. The run is by default the newest below runs/.
    """

def export(
    run: _Path | None = None,
    output: _Path | None = None,
    *,
    progress: _Report | None = None,
    **options: Any,
) -> dict[str, Any]:
    """Writes a run's scene as a splat file, and gives its size and what the format loses.

    `options` are those of `gs-chroma export`, with `_` for `-`.
    """

def frames(
    run: _Path | None = None,
    output: _Path | None = None,
    *,
    progress: _Report | None = None,
    **options: Any,
) -> dict[str, Any]:
    """Writes the photos of a colored run in color, as pictures or a film.

    `options` are those of `gs-chroma frames`, with `_` for `-`.
    """
