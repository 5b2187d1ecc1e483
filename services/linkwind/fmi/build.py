"""The C of an FMU: which files it consists of, and binaries from them."""

from __future__ import annotations

import struct
import tempfile
from collections.abc import Iterable, Mapping
from concurrent.futures import ThreadPoolExecutor
from functools import lru_cache
from importlib.resources import files
from pathlib import Path

from linkwind.fmi import toolchain, windows
from linkwind.fmi.description import FmiVersion
from linkwind.fmi.part import Part
from linkwind.fmi.toolchain import PLATFORMS

DATA_FILE = "lw_fmu_data.c"
HIDE = "-DLW_API="  # the library itself is not exported
_AT_ONCE = 2  # compilers
# Files of the core that not every mechanism needs; one of `fmu/without` takes their place.
_OPTIONAL = {
    "closures": ("lw_closures.c", "lw_delassus.c", "lw_projection.c"),
    "events": ("lw_events.c", "lw_impulse.c"),
    "forces": ("lw_elements.c", "lw_expression.c"),
    "radau5": ("lw_radau5.c", "lw_linear.c"),
}


def c_sources(part: Part, version: FmiVersion) -> dict[str, bytes]:
    """Return the C files and headers of an FMU by name, all for one folder, without its data."""
    mechanism = part.name == "dynamics"
    other_version = "3" if version == "2" else "2"
    left_out = {
        f"lw_part_{'aero' if mechanism else 'dynamics'}.c",
        f"lw_fmi{other_version}.c",
        f"fmi{other_version}.h",
        "lw_affine.c",  # to couple is the importer's, and so is the log
        "lw_point.c",
    }
    root = files("linkwind").joinpath("_data", "fmu")
    absent = _absent(part) if mechanism else []
    left_out.update(name for what in absent for name in _OPTIONAL[what])
    shared = () if mechanism else ("lw_math.h", "lw_expression.h", "lw_expression.c")
    found = {name: root.joinpath("core", name).read_bytes() for name in shared}
    for folder in ("core" if mechanism else "aero", "fmi"):
        for file in root.joinpath(folder).iterdir():
            if file.name.endswith((".c", ".h")) and file.name not in left_out:
                found[file.name] = file.read_bytes()
    for what in absent:
        name = f"lw_without_{what}.c"
        found[name] = root.joinpath("without", name).read_bytes()
    return dict(sorted(found.items()))


def _absent(part: Part) -> list[str]:
    has = {what: getattr(part.mechanism, what) for what in ("closures", "events", "forces")}
    has["radau5"] = part.scenario.dynamics.integrator == "radau5"
    return [what for what in _OPTIONAL if not has[what]]


def flags() -> list[str]:
    """Return the flags that give the same bits from every compiler."""
    return files("linkwind").joinpath("_data", "fmu", "flags.txt").read_text(encoding="utf-8").split()


def binaries(
    sources: Mapping[str, bytes], platforms: Iterable[str], identifier: str, version: FmiVersion,
    *, portable: bool,
) -> dict[str, bytes]:  # fmt: skip
    """Compile for several platforms.

    Args:
        sources: C files and headers by name, all for one folder.
        platforms: names of `toolchain.PLATFORMS`.
        identifier: name of the binaries.
        version: of FMI, which says where a binary lies.
        portable: whether the one for this machine shall run on older systems too.

    Returns:
        Binaries by path in the FMU.

    Raises:
        InputError: a compiler is missing or fails.
    """
    names = list(platforms)
    commands = [toolchain.command(name, portable=portable) for name in names]  # all there, before any starts
    with ThreadPoolExecutor(_AT_ONCE) as pool:
        images = list(pool.map(lambda name, command: _compile(sources, name, command), names, commands))
    found: dict[str, bytes] = {}
    for name, image in zip(names, images, strict=True):
        platform = PLATFORMS[name]
        folder = platform.folder_2 if version == "2" else name
        path = f"binaries/{folder}/{identifier}{platform.suffix}"
        found[path] = universal(found[path], image) if path in found else image
    return found


def _compile(sources: Mapping[str, bytes], name: str, command: list[str]) -> bytes:
    """Return the shared library for a platform; paths are relative, so that none gets into it."""
    with tempfile.TemporaryDirectory(prefix="linkwind-") as folder:
        place = Path(folder)
        for file, content in sources.items():
            (place / file).write_bytes(content)
        extra = windows.prepare(place) if name.endswith("windows") and "-target" in command else ["-lm"]
        inputs = sorted(file for file in sources if file.endswith(".c"))
        if "-target" not in command:  # zig keeps objects by itself, and is busy with other platforms
            inputs = _objects(sources, place, command)
        arguments = [*command, *flags(), HIDE, "-shared", "-s", "-o", "binary", *inputs, *extra]
        toolchain.run(arguments, place, f"the binary for {name}")
        return (place / "binary").read_bytes()


def _objects(sources: Mapping[str, bytes], place: Path, command: list[str]) -> list[str]:
    """Compile files side by side, into the folder; return the objects."""
    headers = tuple(item for item in sources.items() if item[0].endswith(".h"))
    compiled = {
        file: (tuple(command), file, content, headers)
        for file, content in sorted(sources.items())
        if file.endswith(".c")
    }
    with ThreadPoolExecutor(_AT_ONCE) as pool:
        objects = pool.map(lambda file: _object(*compiled[file]), compiled)
        for file, content in zip(compiled, objects, strict=True):
            (place / f"{file}.o").write_bytes(content)
    return [f"{file}.o" for file in compiled]


@lru_cache(maxsize=128)
def _object(
    command: tuple[str, ...], file: str, content: bytes, headers: tuple[tuple[str, bytes], ...]
) -> bytes:
    """Return a compiled file; the next FMU of this process with the same one need not compile it again."""
    with tempfile.TemporaryDirectory(prefix="linkwind-") as folder:
        place = Path(folder)
        for name, text in ((file, content), *headers):
            (place / name).write_bytes(text)
        toolchain.run([*command, *flags(), HIDE, "-c", "-o", "object", file], place, "the binary")
        return (place / "object").read_bytes()


def universal(x86_64: bytes, arm64: bytes) -> bytes:
    """Return a macOS binary for both processors: a table of both images, then these, aligned to pages."""
    align = 14  # pages of 16 KiB
    page = 1 << align
    first = page
    second = -(-(first + len(x86_64)) // page) * page
    cpu_x86_64, cpu_arm64, any_x86, any_arm = 0x01000007, 0x0100000C, 3, 0
    header = struct.pack(">II", 0xCAFEBABE, 2)
    header += struct.pack(">IIIII", cpu_x86_64, any_x86, first, len(x86_64), align)
    header += struct.pack(">IIIII", cpu_arm64, any_arm, second, len(arm64), align)
    return header.ljust(first, b"\0") + x86_64.ljust(second - first, b"\0") + arm64
