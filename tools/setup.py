"""Installs what gs-chroma needs and this machine lacks.

    python3 tools/setup.py             # what the program and its tests need
    python3 tools/setup.py --all       # also what `make test-all` needs

On Debian and its kin that may be a C linker, a Vulkan loader and driver, and pip, all by apt; on
every system the shared library of ONNX Runtime, which goes into the cache folder where gs-chroma
looks for it. What is there already is left alone. What cannot be installed is named in one line
and is no failure here: the step that needs it fails, and says so.

Python's standard library only, 3.9 or newer.
"""

from __future__ import annotations

import ctypes.util
import importlib.util
import os
import platform
import shutil
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path
from typing import NamedTuple

ONNXRUNTIME = "1.31.1"


class Wheel(NamedTuple):
    """A wheel for Python 3.12; its library does not depend on the Python that fetches it."""

    platform: str
    sha256: str
    shared_object: str


WHEELS = {
    ("Linux", "x86_64"): Wheel(
        "manylinux_2_28_x86_64",
        "1f3dea47f2f0e5117c2404cea7d21fd253ae7836a3bf167a501cdfbb2600d536",
        f"libonnxruntime.so.{ONNXRUNTIME}",
    ),
    ("Linux", "aarch64"): Wheel(
        "manylinux_2_28_aarch64",
        "0b9a492176886992e0e875f06bc0367e333f5fff11711a2d642e18b02f3009cc",
        f"libonnxruntime.so.{ONNXRUNTIME}",
    ),
    ("Darwin", "arm64"): Wheel(
        "macosx_14_0_arm64",
        "96dd2564b10ea7153ad9c207e7cd8e5917cb3ba521e0e0a62ac03486fdc8d56c",
        f"libonnxruntime.{ONNXRUNTIME}.dylib",
    ),
    ("Windows", "AMD64"): Wheel(
        "win_amd64",
        "ae8a9a351efda685cc59a66226cdefaa37a126c1d66872ca23a2de9425326130",
        "onnxruntime.dll",
    ),
}


def main() -> None:
    """Installs system packages first: pip may be one of them."""
    everything = "--all" in sys.argv[1:]
    packages = missing_packages()
    if everything:
        packages += missing_packages_of_all_tests()
    if packages:
        install_packages(packages)
    if runtime_is_missing():
        install_runtime()
    if everything:
        install_viewers()
        install_tools_of_all_tests()


def missing_packages() -> list[str]:
    """Debian packages of what is not there: linker, Vulkan, and pip where it is needed."""
    packages: list[str] = []
    if platform.system() != "Linux":
        return packages
    if not shutil.which("cc"):
        packages += ["gcc", "libc6-dev"]
    if not ctypes.util.find_library("vulkan"):
        packages.append("libvulkan1")
    if not has_vulkan_driver():
        packages.append("mesa-vulkan-drivers")
    if runtime_is_missing() and not has_pip():
        packages.append("python3-pip")
    return packages


# Programs that `make test-all` starts, and their Debian packages.
PROGRAMS = {
    "ffmpeg": "ffmpeg",
    "colmap": "colmap",
    "node": "nodejs",
    "npm": "npm",
    "spirv-val": "spirv-tools",
    "glslangValidator": "glslang-tools",
    "debootstrap": "debootstrap",
}


def missing_packages_of_all_tests() -> list[str]:
    """Debian packages of the programs of `make test-all` that are not there."""
    packages = [package for program, package in PROGRAMS.items() if not shutil.which(program)]
    browsers = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
    if not (os.environ.get("CHROMIUM") or any(map(shutil.which, browsers))):
        packages.append("chromium")
    if not importlib.util.find_spec("ensurepip"):
        packages.append("python3-venv")
    return packages


def install_tools_of_all_tests() -> None:
    """Installs OpenUSD for Python and naga into target/test-all, where the Makefile looks."""
    folder = Path(__file__).parent.parent / "target" / "test-all"
    python = folder / "bin" / "python"
    if not python.exists() and not run([sys.executable, "-m", "venv", str(folder)]):
        say("there is no OpenUSD: venv failed")
    elif not run([str(python), "-m", "pip", "--quiet", "install", "usd-core==26.11", "numpy"]):
        say(f"there is no OpenUSD: pip failed in {folder}")
    if not shutil.which("naga") and not (folder / "bin" / "naga").exists():
        cargo = ["cargo", "install", "--quiet", "--locked", "naga-cli@30.0.1", "--root", str(folder)]
        if not run(cargo):
            say("there is no naga: cargo install naga-cli failed")


def install_viewers() -> None:
    """Installs the viewers that tools/viewers/package-lock.json names."""
    folder = Path(__file__).parent / "viewers"
    if not shutil.which("npm"):
        say(f"there is no npm; install Node 20 or newer, and run npm ci in {folder}")
        return
    say(f"installing viewers into {folder}")
    if not run(["npm", "ci", "--no-audit", "--no-fund", "--prefix", str(folder)]):
        say(f"npm failed; run npm ci in {folder}")


def has_vulkan_driver() -> bool:
    """Whether a manifest of a driver lies where the Vulkan loader looks for one."""
    if any(os.environ.get(name) for name in ("VK_DRIVER_FILES", "VK_ICD_FILENAMES")):
        return True
    folders = ("/etc/vulkan/icd.d", "/usr/local/share/vulkan/icd.d", "/usr/share/vulkan/icd.d")
    return any(any(Path(folder).glob("*.json")) for folder in folders)


def install_packages(packages: list[str]) -> None:
    """Installs Debian packages, as root or through a sudo that asks for no password."""
    names = " ".join(packages)
    if not shutil.which("apt-get"):
        say(f"please install what Debian calls: {names}")
        return
    become_root: list[str] = []
    if os.geteuid() != 0:
        become_root = ["sudo", "-n"]
        if not shutil.which("sudo") or not run([*become_root, "true"], stderr=subprocess.DEVNULL):
            say(f"please install, as root: apt-get install {names}")
            return
    say(f"installing by apt-get: {names}")
    apt = [*become_root, "env", "DEBIAN_FRONTEND=noninteractive", "apt-get", "-qq"]
    install = [*apt, "install", "-y", "--no-install-recommends", *packages]
    # What dpkg unpacks is of no interest; errors are.
    if not (run([*apt, "update"]) and run(install, stdout=subprocess.DEVNULL)):
        say(f"apt-get failed; please install, as root: apt-get install {names}")


def runtime_is_missing() -> bool:
    """Whether ONNX Runtime is neither named by the user nor in the cache folder."""
    wheel = wheel_here()
    there = bool(wheel) and (cache_folder() / wheel.shared_object).is_file()
    return not there and not os.environ.get("ORT_DYLIB_PATH")


def install_runtime() -> None:
    """Takes the library and its license out of the wheel that pip downloads and verifies."""
    by_hand = f"let ORT_DYLIB_PATH name the library of ONNX Runtime {ONNXRUNTIME}"
    wheel = wheel_here()
    if not wheel:
        say(f"no ONNX Runtime for {platform.system()} {platform.machine()} is known; {by_hand}")
        return
    if not has_pip():
        say(f"{sys.executable} has no pip, which fetches ONNX Runtime; install it, or {by_hand}")
        return
    folder = cache_folder()
    say(f"installing ONNX Runtime {ONNXRUNTIME} into {folder}")
    folder.mkdir(parents=True, exist_ok=True)
    # Inside the folder, so that the last step is a rename.
    with tempfile.TemporaryDirectory(dir=folder) as temporary:
        work = Path(temporary)
        requirements = work / "requirements.txt"
        requirements.write_text(f"onnxruntime=={ONNXRUNTIME} --hash=sha256:{wheel.sha256}\n")
        pip = [sys.executable, "-I", "-m", "pip", "--quiet", "--disable-pip-version-check", "download"]
        pip += ["--require-hashes", "--requirement", str(requirements), "--dest", str(work)]
        pip += ["--no-deps", "--only-binary=:all:", "--platform", wheel.platform]
        pip += ["--implementation", "cp", "--python-version", "3.12", "--abi", "cp312"]
        if not run(pip):
            say(f"pip failed; run this again, or {by_hand}")
            return
        (downloaded,) = work.glob("*.whl")
        with zipfile.ZipFile(downloaded) as archive:
            # The library last: it is what tells that all is there.
            for name in ("LICENSE", "ThirdPartyNotices.txt", f"capi/{wheel.shared_object}"):
                part = Path(archive.extract(f"onnxruntime/{name}", work))
                part.replace(folder / part.name)


def wheel_here() -> Wheel | None:
    """The wheel for this machine."""
    return WHEELS.get((platform.system(), platform.machine()))


def cache_folder() -> Path:
    """Where gs-chroma looks for ONNX Runtime: `cache_folder` in src/chroma/teacher/runtime.rs."""
    variable = os.environ.get
    home = variable("HOME")
    cache = variable("XDG_CACHE_HOME") or (home and f"{home}/.cache") or variable("LOCALAPPDATA")
    return Path(cache or "", "gs-chroma", "onnxruntime")


def has_pip() -> bool:
    """Whether this Python has pip."""
    return importlib.util.find_spec("pip") is not None


def run(command: list[str], **streams: int) -> bool:
    """Runs a command; whether it succeeded."""
    return subprocess.run(command, check=False, **streams).returncode == 0


def say(message: str) -> None:
    """Prints at once: pip and apt write to the same place."""
    print(f"setup: {message}", flush=True)


if __name__ == "__main__":
    main()
