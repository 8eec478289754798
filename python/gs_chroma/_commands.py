"""Commands on run folders, with the options of the program's."""

from __future__ import annotations

import json
import os
from typing import Any, Callable, Iterator

from . import _native

Report = Callable[[_native.Progress], object]


def evaluate(run: Any = None, *, progress: Report | None = None, **options: Any) -> dict[str, Any]:
    """Measures a colored run, and gives what eval.json holds (docs/schemas/eval.schema.json).

    `options` are those of `gs-chroma eval`, with `_` for `-`: `teacher="ddcolor-tiny",
    baselines=True`. The run is by default the newest below runs/.
    """
    return _answer("eval", run, progress, options)


def export(
    run: Any = None, output: Any = None, *, progress: Report | None = None, **options: Any
) -> dict[str, Any]:
    """Writes a run's scene as a splat file, and gives its size and what the format loses.

    `options` are those of `gs-chroma export`, with `_` for `-`.
    """
    return _answer("export", run, progress, {"output": output, **options})


def frames(
    run: Any = None, output: Any = None, *, progress: Report | None = None, **options: Any
) -> dict[str, Any]:
    """Writes the photos of a colored run in color, as pictures or a film.

    `options` are those of `gs-chroma frames`, with `_` for `-`.
    """
    return _answer("frames", run, progress, {"output": output, **options})


def _answer(
    command: str, run: Any, progress: Report | None, options: dict[str, Any]
) -> dict[str, Any]:
    arguments = [command, *_words(options)]
    if run is not None:
        arguments += ["--", os.fspath(run)]
    return json.loads(_native.answer(arguments, progress))


def _words(options: dict[str, Any]) -> Iterator[str]:
    """Options as the program takes them: `baselines=True` is `--baselines`."""
    for name, value in options.items():
        option = "--" + name.replace("_", "-")
        if value is True:
            yield option
        elif isinstance(value, (list, tuple)):
            yield from (f"{option}={part}" for part in value)
        elif value is not None and value is not False:
            yield f"{option}={value}"
