"""The module on the bundled scene, small and short."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import tempfile
import threading
import time
import traceback
import unittest
import warnings
from pathlib import Path

import numpy as np

import gs_chroma

DEMO = Path(__file__).parents[2] / "assets" / "demo"
SIDE = 48
ITERATIONS = 20
PROGRAM = [sys.executable, "-m", "gs_chroma"]


def program(*words: object, folder: str) -> subprocess.CompletedProcess[str]:
    """The program's output with these arguments in a folder."""
    words = [*PROGRAM, *map(str, words)]
    return subprocess.run(words, cwd=folder, capture_output=True, text=True, check=False)


def sepia(gray: np.ndarray) -> np.ndarray:
    """CIELAB a and b of brown."""
    return np.full((*gray.shape, 2), (6.0, 18.0), np.float32)


class Scene(unittest.TestCase):
    """One training serves all tests."""

    @classmethod
    def setUpClass(cls) -> None:
        cls.dataset = gs_chroma.Dataset.open(DEMO, max_side=SIDE)
        cls.told: list[gs_chroma.Progress] = []
        cls.scene = gs_chroma.fit(
            cls.dataset, preset="draft", iterations=ITERATIONS, progress=cls.told.append
        )

    def test_photos_and_cameras(self) -> None:
        dataset = self.dataset
        self.assertEqual(len(dataset), len(dataset.names))
        self.assertEqual(sorted(dataset.train + dataset.test), list(range(len(dataset))))
        camera, photo = dataset.cameras[0], dataset.photo(0)
        self.assertEqual(photo.shape, (camera.height, camera.width))
        self.assertEqual((photo.dtype, max(photo.shape)), (np.uint8, SIDE))
        np.testing.assert_allclose(camera.rotation @ camera.center, -camera.translation, atol=1e-9)
        # Points lie before the camera and, most of them, in its picture.
        at = dataset.points @ camera.rotation.T + camera.translation
        x = camera.fx * at[:, 0] / at[:, 2] + camera.cx
        self.assertGreater(np.mean((at[:, 2] > 0) & (x > 0) & (x < camera.width)), 0.5)
        with self.assertRaises(IndexError):
            dataset.photo(len(dataset))

    def test_training_tells_and_draws(self) -> None:
        stages = [progress.stage for progress in self.told]
        self.assertIn("photos", stages)
        last = self.told[-1]
        self.assertEqual((last.stage, last.done, last.total), ("training", ITERATIONS, ITERATIONS))
        self.assertIn("loss", str(last))
        picture = gs_chroma.render(self.scene, self.dataset.cameras[0])
        photo = self.dataset.photo(0) / 255
        self.assertEqual((picture.shape, picture.dtype), (photo.shape, np.float32))
        error = np.mean((picture - photo) ** 2)
        self.assertLess(error, 0.8 * np.var(photo))
        self.assertEqual(self.scene.settings["max_splats"], 12000)

    def test_a_callable_colors(self) -> None:
        asked = []

        def brown(gray: np.ndarray) -> np.ndarray:
            asked.append((gray.dtype, gray.min() >= 0, gray.max() <= 1, gray.ndim))
            # Any size will do.
            return sepia(gray[::2, ::2])

        colored = gs_chroma.colorize(self.scene, brown, rounds=2)
        self.assertEqual(set(asked), {(np.dtype(np.float32), True, True, 2)})
        self.assertEqual(len(asked), len(self.dataset))
        self.assertEqual(colored.chroma.shape, (len(colored.splats), 1, 2))
        view = self.dataset.train[0]
        photo = colored.photo(view)
        self.assertEqual(photo.shape, (*self.dataset.photo(view).shape, 3))
        red, green, blue = photo.reshape(-1, 3).mean(0)
        self.assertTrue(red > green > blue, (red, green, blue))
        # RGB and tensors of others, too.
        def tensor(gray: np.ndarray) -> object:
            class Tensor:
                def detach(self): return self
                def cpu(self): return self
                def numpy(self): return np.stack([gray, 0.8 * gray, 0.5 * gray], axis=2)
            return Tensor()

        other = gs_chroma.colorize(self.scene.splats, tensor, dataset=self.dataset, rounds=1)
        picture = gs_chroma.render(other, self.dataset.cameras[view])
        self.assertEqual(picture.shape[2], 3)
        self.assertGreater(picture[..., 0].mean(), picture[..., 2].mean() + 0.05)

    def test_answers_that_are_no_pictures(self) -> None:
        for answer, error, words in [
            (lambda gray: gray, ValueError, "the shape is"),
            (lambda gray: sepia(gray).transpose(2, 0, 1), ValueError, "permute"),
            (lambda gray: 9e3 * sepia(gray), gs_chroma.TeacherError, "no CIELAB"),
            (lambda gray: np.nan * sepia(gray), ValueError, "not finite"),
            (lambda gray: 255.0 * np.ones((4, 4, 3)), ValueError, "RGB is uint8"),
            (lambda gray: "brown", ValueError, "could not convert"),
            (lambda gray: None, gs_chroma.ChromaError, "no view has a color"),
            ("nothing-of-that-name", gs_chroma.TeacherError, "no such file"),
        ]:
            with self.assertRaises(error) as caught:
                gs_chroma.colorize(self.scene, answer)
            self.assertIn(words, str(caught.exception))
        with self.assertWarnsRegex(UserWarning, "CIELAB"):
            gs_chroma.colorize(self.scene, lambda gray: sepia(gray) / 110, rounds=1)

    def test_exceptions_come_back_with_their_lines(self) -> None:
        def broken(gray: np.ndarray) -> np.ndarray:
            raise KeyError("of the model")

        try:
            gs_chroma.colorize(self.scene, broken)
        except KeyError as raised:
            lines = traceback.format_exception(raised)
        self.assertIn("in broken", "".join(lines))
        self.assertIn("KeyError: 'of the model'", lines[-1])

        def stop(progress: gs_chroma.Progress) -> None:
            if progress.stage == "training":
                raise StopIteration("enough")

        begun = time.monotonic()
        with self.assertRaises(StopIteration):
            gs_chroma.fit(self.dataset, iterations=100_000, progress=stop)
        self.assertLess(time.monotonic() - begun, 60)

    def test_an_interrupt_ends_a_training_while_others_run(self) -> None:
        ticks = 0
        ends = threading.Event()

        def tick() -> None:
            nonlocal ticks
            while not ends.wait(0.01):
                ticks += 1
                if ticks == 30:
                    os.kill(os.getpid(), signal.SIGINT)

        # Shells let what runs in the background ignore it.
        before = signal.signal(signal.SIGINT, signal.default_int_handler)
        self.addCleanup(signal.signal, signal.SIGINT, before)
        thread = threading.Thread(target=tick)
        thread.start()
        try:
            with self.assertRaises(KeyboardInterrupt):
                gs_chroma.fit(self.dataset, iterations=100_000)
        finally:
            ends.set()
            thread.join()
        # The other thread would not have counted while Python was locked.
        self.assertGreaterEqual(ticks, 30)

    def test_wrong_settings_are_named(self) -> None:
        for error, words, call in [
            (TypeError, "no setting iteration;", lambda: gs_chroma.fit(self.dataset, iteration=5)),
            (ValueError, "iterations: ", lambda: gs_chroma.fit(self.dataset, iterations="many")),
            (ValueError, "iterations: 0", lambda: gs_chroma.fit(self.dataset, iterations=0)),
            (ValueError, "sh_degree: 4", lambda: gs_chroma.fit(self.dataset, sh_degree=4)),
            (ValueError, "unknown variant", lambda: gs_chroma.fit(self.dataset, preset="best")),
            (ValueError, "max_side: 3", lambda: gs_chroma.Dataset.open(DEMO, max_side=3)),
            (ValueError, "LOW,HIGH", lambda: gs_chroma.Dataset.open(DEMO, normalize=(2, 1))),
            (ValueError, "rounds: 0", lambda: gs_chroma.colorize(self.scene, sepia, rounds=0)),
            (TypeError, "dataset: ", lambda: gs_chroma.colorize(self.scene.splats, sepia)),
            (gs_chroma.CaptureError, "no such folder", lambda: gs_chroma.Dataset.open("nowhere")),
        ]:
            with self.assertRaises(error) as caught:
                call()
            self.assertIn(words, str(caught.exception))
        self.assertTrue(issubclass(gs_chroma.CaptureError, gs_chroma.Error))

    def test_the_same_bytes_as_the_program_and_commands_on_its_run(self) -> None:
        colored = gs_chroma.colorize(self.scene, DEMO / "images", rounds=2)
        with tempfile.TemporaryDirectory() as folder:
            colored.splats.write(Path(folder, "python.ply"))
            fit = ["fit", DEMO, "-o", "run", "--preset", "draft"]
            fit += ["--iterations", ITERATIONS, "--max-side", SIDE]
            for words in [fit, ["colorize", "run", "--teacher", DEMO / "images", "--rounds", 2]]:
                done = program(*words, folder=folder)
                self.assertEqual(done.returncode, 0, done.stderr)
            run = Path(folder, "run")
            gray = Path(folder, "gray.ply")
            self.scene.splats.write(gray)
            self.assertEqual(gray.read_bytes(), (run / "luma.ply").read_bytes())
            self.assertEqual(
                Path(folder, "python.ply").read_bytes(), (run / "color.ply").read_bytes()
            )
            told: list[str] = []
            wrote = gs_chroma.export(
                run, Path(folder, "run.spz"), progress=lambda progress: told.append(str(progress))
            )
            self.assertEqual(wrote["splats"], len(colored.splats))
            self.assertTrue(told)
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                done = gs_chroma.frames(run, Path(folder, "colored"))
            self.assertEqual(done["photos"], len(self.dataset))
            with self.assertRaisesRegex(gs_chroma.CommandError, "nowhere"):
                gs_chroma.export("nowhere", Path(folder, "a.ply"))
            with self.assertRaisesRegex(TypeError, "--fast"):
                gs_chroma.export(run, Path(folder, "a.ply"), fast=True)

            def stop(_: gs_chroma.Progress) -> None:
                raise StopIteration

            with self.assertRaises(StopIteration):
                gs_chroma.evaluate(run, progress=stop)
            # Nothing is left locked or half-written.
            self.assertFalse((run / "eval.json").exists())
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                evaluation = gs_chroma.evaluate(run, frames=2)
            self.assertEqual(evaluation, json.loads((run / "eval.json").read_text()))


class Arrays(unittest.TestCase):
    """Gaussians as arrays."""

    def splats(self, count: int = 5, degree: int = 1, channels: int = 3) -> gs_chroma.Splats:
        random = np.random.default_rng(0)
        return gs_chroma.Splats(
            means=random.normal(size=(count, 3)),
            log_scales=random.normal(size=(count, 3)) - 3,
            quaternions=random.normal(size=(count, 4)),
            opacity_logits=random.normal(size=count),
            sh=random.normal(size=(count, (degree + 1) ** 2, channels)),
        )

    def test_files_and_gsplat_keep_the_arrays(self) -> None:
        splats = self.splats()
        names = ["means", "log_scales", "quaternions", "opacity_logits", "sh"]
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder, "scene.ply")
            splats.write(path)
            read = gs_chroma.Splats.read(path)
            same = gs_chroma.Splats.from_gsplat(splats.to_gsplat())
            for name in names:
                np.testing.assert_array_equal(getattr(splats, name), getattr(same, name))
                # Files have unit quaternions.
                wanted = getattr(splats, name)
                if name == "quaternions":
                    wanted = wanted / np.linalg.norm(wanted, axis=1, keepdims=True)
                np.testing.assert_allclose(getattr(read, name), wanted, rtol=1e-6)
            with self.assertRaisesRegex(gs_chroma.SplatError, "no.ply"):
                gs_chroma.Splats.read(Path(folder, "no.ply"))
        params = splats.to_gsplat()
        self.assertEqual((params["sh0"].shape, params["shN"].shape), ((5, 1, 3), (5, 3, 3)))
        gray = splats.to_luma()
        np.testing.assert_allclose(gray.sh[..., 0], splats.sh.mean(2), atol=1e-6)

    def test_what_is_read_is_the_callers(self) -> None:
        splats = self.splats()
        means = splats.means
        means[:] = 0
        self.assertTrue(np.any(splats.means))

    def test_shapes_and_numbers_are_checked(self) -> None:
        good = dict(
            means=np.zeros((2, 3)),
            log_scales=np.zeros((2, 3)),
            quaternions=np.ones((2, 4)),
            opacity_logits=[0.0, np.inf],
            sh=np.zeros((2, 1, 1)),
        )
        self.assertEqual(len(gs_chroma.Splats(**good)), 2)
        for name, value, words in [
            ("means", np.zeros((2, 4)), r"means: the shape is \[2, 4\], not \[N, 3\]"),
            ("log_scales", np.zeros((3, 3)), "3 rows for 2 means"),
            ("quaternions", np.zeros((2, 4)), "one is zero"),
            ("opacity_logits", np.zeros(3), "opacity_logits"),
            ("sh", np.zeros((2, 2, 3)), "1, 4, 9 or 16"),
            ("sh", np.full((2, 1, 1), np.nan), "not finite"),
        ]:
            with self.assertRaisesRegex(ValueError, words):
                gs_chroma.Splats(**{**good, name: value})

    def test_cameras_are_checked(self) -> None:
        camera = gs_chroma.Camera(64, 48, 50, 50, 32, 24, np.eye(3), [0, 0, 4])
        self.assertEqual(gs_chroma.render(self.splats(), camera).shape, (48, 64, 3))
        self.assertEqual(gs_chroma.render(self.splats(channels=2), camera).shape, (48, 64, 2))
        self.assertEqual(camera.resized(32, 24).fx, 25)
        for rotation in [2 * np.eye(3), np.diag([1, 1, -1]), np.zeros((3, 2))]:
            with self.assertRaises(ValueError):
                gs_chroma.Camera(64, 48, 50, 50, 32, 24, rotation, [0, 0, 4])


class Program(unittest.TestCase):
    """The program in Python's process."""

    def test_statuses_and_streams(self) -> None:
        with tempfile.TemporaryDirectory() as folder:
            done = program("--version", folder=folder)
            self.assertEqual((done.returncode, done.stdout), (0, f"gs-chroma {gs_chroma.__version__}\n"))
            done = program("fit", "nowhere", "--with", "lens", "--without", "lens", folder=folder)
            self.assertEqual(done.returncode, 2)
            self.assertIn("Usage: gs-chroma fit", done.stderr)
            done = program("fit", "nowhere", folder=folder)
            self.assertEqual(done.returncode, 1)
            self.assertRegex(done.stderr.splitlines()[-1], "^error: nowhere: ")

    def test_an_interrupt_ends_it_as_a_shell_expects(self) -> None:
        with tempfile.TemporaryDirectory() as folder:
            fit = [*PROGRAM, "fit", str(DEMO), "-o", "run", "--iterations", "100000"]
            child = subprocess.Popen(fit, cwd=folder, stderr=subprocess.PIPE, text=True)
            while not Path(folder, "run").exists() and child.poll() is None:
                time.sleep(0.05)
            for _ in range(2):
                child.send_signal(signal.SIGINT)
                time.sleep(0.2)
            _, said = child.communicate(timeout=60)
            self.assertNotIn("Traceback", said)
            self.assertIn(child.returncode, (1, 130))


if __name__ == "__main__":
    unittest.main()
