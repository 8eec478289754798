"""Where a capture and a job lie: in a folder that all workers share, or behind a URL of fsspec's."""

from __future__ import annotations

import json
import threading
from collections.abc import Iterable
from contextlib import contextmanager
from pathlib import Path

import fsspec


class Store:
    """Files below a folder or a URL, and where a worker has them."""

    def __init__(self, place: str, scratch: Path):
        self.shared = "://" not in place
        self.place = place.rstrip("/")
        self.local = Path(place) if self.shared else scratch / self.place.rpartition("/")[2]
        if not self.shared:
            self.files, self.root = fsspec.core.url_to_fs(self.place)

    def names(self, folder: str) -> list[str]:
        """All files below a folder, by their paths from the root."""
        if self.shared:
            found = (self.local / folder).rglob("*")
            return sorted(str(path.relative_to(self.local)) for path in found if path.is_file())
        base = f"{self.root}/{folder}".rstrip("/")
        if not self.files.exists(base):
            return []
        return sorted(path[len(self.root) + 1 :] for path in self.files.find(base))

    def fetch(self, names: Iterable[str]) -> None:
        """Brings files to the worker, those that are there."""
        for name in () if self.shared else names:
            source = f"{self.root}/{name}"
            if self.files.exists(source):
                target = self.local / name
                target.parent.mkdir(parents=True, exist_ok=True)
                self.files.get_file(source, str(target))

    def put(self, names: Iterable[str]) -> None:
        """Brings files of the worker to where all find them."""
        for name in () if self.shared else names:
            source = self.local / name
            if source.is_file():
                self.files.makedirs(f"{self.root}/{name}".rpartition("/")[0], exist_ok=True)
                # Under another name first: whoever reads meanwhile reads a whole file.
                self.files.put_file(str(source), f"{self.root}/{name}.part")
                self.files.mv(f"{self.root}/{name}.part", f"{self.root}/{name}")
            elif self.files.exists(f"{self.root}/{name}"):
                self.files.rm(f"{self.root}/{name}")

    def put_folder(self, folder: str) -> None:
        """The same with all files of a folder."""
        if not self.shared:
            found = (path for path in (self.local / folder).rglob("*") if path.is_file())
            self.put(str(path.relative_to(self.local)) for path in found)

    @contextmanager
    def keeping(self, name: str, seconds: float):
        """Puts a file again whenever it has changed, as long as this lasts."""
        ended = threading.Event()

        def keep() -> None:
            known = None
            while not ended.wait(seconds):
                path = self.local / name
                changed = path.stat().st_mtime_ns if path.is_file() else None
                if changed not in (None, known):
                    self.put([name])
                    known = changed

        thread = threading.Thread(target=keep, daemon=True)
        if not self.shared:
            thread.start()
        try:
            yield
        finally:
            ended.set()
            if not self.shared:
                thread.join()


def photos_of(job: Store, block: str) -> list[str]:
    """Names of a block's photos, below images/."""
    photos = json.loads((job.local / block / "block.json").read_text())["photos"]
    return sorted(photos["train"] + photos["test"])


def move_capture(job: Store, capture: Path) -> None:
    """Lets a worker's copy of the job name the worker's copy of the capture."""
    path = job.local / "job.json"
    plan = json.loads(path.read_text())
    if not job.shared and plan["capture"] != str(capture):
        plan["capture"] = str(capture)
        path.write_text(json.dumps(plan, indent=2) + "\n")
