"""Fluids compiled in other ways, whose bits must be those of the library."""

import ctypes
import subprocess
import sys
import tempfile
from functools import cache
from pathlib import Path

import pytest

from tests.fmu.c_model import C, build_hook

CPU = Path("/proc/cpuinfo")
SETS = {"sse2": (), "avx2": ("-mavx2",), "avx512f": ("-mavx512f",)}
BUILDS = [*SETS, "zig"]


@cache
def compiled(name):
    """Compile for one set of instructions only, or with another compiler, once; return the library."""
    if name == "zig":
        pytest.importorskip("ziglang")
        command, extra = [sys.executable, "-m", "ziglang", "cc", "-mcpu=baseline"], ()
    else:
        if not CPU.exists() or name not in CPU.read_text():
            pytest.skip(f"this processor has no {name}")
        command, extra = build_hook().compiler(), ("-DLW_ONE_VERSION", *SETS[name])
    hook = build_hook()
    folders = ("core", "aero", "flow", "vortex")
    sources = [*(C / "flow").glob("*.c"), *(C / "vortex").glob("*.c")]
    sources += [C / "core" / "lw_linear.c", C / "aero" / "lw_wind.c", C / "core" / "lw_expression.c"]
    arguments = [*hook.FLAGS, *hook.WARNINGS, "-Werror", "-O3", "-pthread", "-shared", *extra]
    arguments += [*(f"-I{C / inner}" for inner in folders), *map(str, sorted(sources)), "-lm"]
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "fluids.so"
        subprocess.run([*command, *arguments, "-o", str(file)], check=True)
        return ctypes.CDLL(str(file))


def use(monkeypatch, module, library):
    """Let what a module makes from now on call another library."""

    def declare(name, arguments, result=ctypes.c_int):
        function = getattr(library, name)
        function.argtypes, function.restype = list(arguments), result
        return function

    monkeypatch.setattr(module, "declare", declare)
