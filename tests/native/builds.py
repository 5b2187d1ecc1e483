"""Fluids compiled in other ways, whose bits must be those of the library."""

import ctypes
import subprocess
import sys
from pathlib import Path

import pytest

from tests.fmu.c_model import C, build_hook

CPU = Path("/proc/cpuinfo")
SETS = {"sse2": (), "avx2": ("-mavx2",), "avx512f": ("-mavx512f",)}
BUILDS = [*SETS, "zig"]


def compiled(name, folder):
    """Compile for one set of instructions only, or with another compiler; return the library."""
    if name == "zig":
        pytest.importorskip("ziglang")
        command, extra = [sys.executable, "-m", "ziglang", "cc", "-mcpu=baseline"], ()
    else:
        if not CPU.exists() or name not in CPU.read_text():
            pytest.skip(f"this processor has no {name}")
        command, extra = build_hook().compiler(), ("-DLW_ONE_VERSION", *SETS[name])
    hook, file = build_hook(), folder / "fluids.so"
    folders = ("core", "aero", "flow", "vortex")
    sources = [*(C / "flow").glob("*.c"), *(C / "vortex").glob("*.c")]
    sources += [C / "core" / "lw_linear.c", C / "aero" / "lw_wind.c"]
    arguments = [*hook.FLAGS, *hook.WARNINGS, "-Werror", "-O3", "-pthread", "-shared", *extra]
    arguments += [
        *(f"-I{C / inner}" for inner in folders),
        "-o",
        str(file),
        *map(str, sorted(sources)),
        "-lm",
    ]
    subprocess.run([*command, *arguments], check=True)
    return ctypes.CDLL(str(file))


def use(monkeypatch, module, library):
    """Let what a module makes from now on call another library."""

    def declare(name, arguments, result=ctypes.c_int):
        function = getattr(library, name)
        function.argtypes, function.restype = list(arguments), result
        return function

    monkeypatch.setattr(module, "declare", declare)
