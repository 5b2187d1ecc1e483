"""Build hook: compile the C library and gather what the package carries besides Python.

Everything is written to ``services/linkwind/_data`` (ignored by git), which is where a wheel, an
editable install and a wheel built from the sdist all find it.
"""

from __future__ import annotations

import importlib.util
import os
import shutil
import subprocess
import sys
import sysconfig
import tempfile
from pathlib import Path
from typing import Any

try:
    from hatchling.builders.hooks.plugin.interface import BuildHookInterface
except ImportError:  # run by hand: ``python fmu/hatch_build.py`` rebuilds the library in place
    BuildHookInterface = object  # type: ignore[assignment,misc]

# No fast-math and no contraction: the same bits from gcc, clang and zig (see fmu/README.md). The file
# travels with the package, which compiles FMUs with the same flags.
FLAGS_FILE = Path(__file__).with_name("flags.txt")
FLAGS = FLAGS_FILE.read_text(encoding="utf-8").split()
WARNINGS = ["-Wall", "-Wextra", "-Wpedantic", "-Wshadow", "-Wconversion", "-Wno-sign-conversion"]


def compiler() -> list[str]:
    """Return the command of the C compiler: ``$CC``, the system's, or the ziglang wheel's."""
    if os.environ.get("CC"):
        return os.environ["CC"].split()
    for name in ("cc", "gcc", "clang"):
        if shutil.which(name):
            return [name]
    if importlib.util.find_spec("ziglang"):
        return [sys.executable, "-m", "ziglang", "cc", "-mcpu=baseline"]  # zig's default is this processor
    raise RuntimeError(
        "no C compiler found: expected $CC, cc, gcc, clang or the ziglang wheel (pip install ziglang)"
    )


def run_compiler(*arguments: object, cwd: Path) -> None:
    """Run the compiler in a folder, and show what it says."""
    command = [*compiler(), *FLAGS, *WARNINGS, "-pthread", *map(str, arguments)]
    done = subprocess.run(command, cwd=cwd, capture_output=True, text=True, check=False)
    if done.returncode:
        raise RuntimeError(f"compiling the core failed:\n{' '.join(command)}\n{done.stderr}")
    if done.stderr:
        print(done.stderr, file=sys.stderr)


def compile_library(root: Path, target: Path) -> None:
    """Compile the folders of ``fmu`` that the Python side calls into one shared library.

    Fluids are for vectors, which gcc makes of plain loops at -O3 only.
    """
    source = root / "fmu"
    folders = ("core", "baselines", "aero", "coupling")
    fluids = ("flow", "vortex")
    includes = [f"-I{source / folder}" for folder in (*folders, *fluids)]
    partial = target.with_name(target.name + ".partial")
    with tempfile.TemporaryDirectory() as folder:
        objects = Path(folder)
        exact = sorted(file for folder in folders for file in (source / folder).glob("*.c"))
        run_compiler(*includes, "-c", *exact, cwd=objects)
        wide = sorted(file for folder in fluids for file in (source / folder).glob("*.c"))
        run_compiler(*includes, "-O3", "-c", *wide, cwd=objects)
        run_compiler("-shared", "-o", partial, *sorted(objects.glob("*.o")), "-lm", cwd=objects)
    partial.replace(target)  # a running process keeps the file that it has mapped


def build_data(root: Path) -> None:
    """Fill ``services/linkwind/_data`` with the library, the C sources and the schemas."""
    data = root / "services" / "linkwind" / "_data"
    data.mkdir(exist_ok=True)
    for folder in ("core", "without", "aero", "fmi", "host"):
        shutil.rmtree(data / "fmu" / folder, ignore_errors=True)
        shutil.copytree(
            root / "fmu" / folder, data / "fmu" / folder, ignore=shutil.ignore_patterns("__pycache__")
        )
    shutil.copy(FLAGS_FILE, data / "fmu")
    shutil.rmtree(data / "schemas", ignore_errors=True)
    shutil.copytree(root / "schemas", data / "schemas")
    compile_library(root, data / "liblinkwind.so")


class NativeBuildHook(BuildHookInterface):
    """Compile at install, and tag the wheel for this platform but for any Python."""

    def dependencies(self) -> list[str]:
        has_compiler = os.environ.get("CC") or any(map(shutil.which, ("cc", "gcc", "clang")))
        return [] if has_compiler else ["ziglang"]

    def initialize(self, version: str, build_data_: dict[str, Any]) -> None:
        if self.target_name != "wheel":
            return
        build_data(Path(self.root))
        platform = sysconfig.get_platform().replace("-", "_").replace(".", "_")
        build_data_["pure_python"] = False
        build_data_["tag"] = f"py3-none-{platform}"


if __name__ == "__main__":
    build_data(Path(__file__).resolve().parent.parent)
