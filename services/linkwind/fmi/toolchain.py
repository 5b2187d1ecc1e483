"""Compilers: for this machine the system's, for any other the ``ziglang`` wheel."""

from __future__ import annotations

import importlib.util
import os
import platform
import shutil
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from linkwind.errors import InputError

INSTALL_ZIG = "pip install 'linkwind[fmu]'"


@dataclass(frozen=True)
class Platform:
    """A platform that an FMU can carry a binary for.

    Attributes:
        name: as FMI 3 calls it, ``x86_64-linux``.
        folder_2: where FMI 2 looks for its binary; platforms that it does not know keep FMI 3's name.
        suffix: of the binary.
        target: zig's name for it.
    """

    name: str
    folder_2: str
    suffix: str
    target: str


# glibc 2.17 is of 2012: CentOS 7 and everything since.
PLATFORMS = {
    entry.name: entry
    for entry in (
        Platform("x86_64-linux", "linux64", ".so", "x86_64-linux-gnu.2.17"),
        Platform("aarch64-linux", "aarch64-linux", ".so", "aarch64-linux-gnu.2.17"),
        Platform("x86_64-windows", "win64", ".dll", "x86_64-windows-gnu"),
        Platform("x86_64-darwin", "darwin64", ".dylib", "x86_64-macos"),
        Platform("aarch64-darwin", "darwin64", ".dylib", "aarch64-macos"),
    )
}


def host() -> str:
    """Return the name of the platform that this is."""
    machine = {"amd64": "x86_64", "arm64": "aarch64"}.get(
        platform.machine().lower(), platform.machine().lower()
    )
    system = {"win32": "windows"}.get(sys.platform, sys.platform)
    return f"{machine}-{system}"


def choose(wanted: Sequence[str]) -> list[str]:
    """Return names of platforms, in the order of the table, for ``host``, ``all`` or names.

    Raises:
        InputError: an unknown name.
    """
    names = set[str]()
    for word in wanted:
        names |= set(PLATFORMS) if word == "all" else {host() if word == "host" else word}
    unknown = sorted(names - set(PLATFORMS))
    if unknown or not names:
        known = ", ".join(("host", "all", *PLATFORMS))
        raise InputError(
            f'--platforms: expected names out of {known}; got "{",".join(unknown)}". Correct the list.'
        )
    return [name for name in PLATFORMS if name in names]


def has_zig() -> bool:
    """Return whether the ziglang wheel is installed."""
    return importlib.util.find_spec("ziglang") is not None


def command(name: str, *, portable: bool) -> list[str]:
    """Return the compiler for a platform: the system's for this one unless the binary shall be portable.

    Raises:
        InputError: there is none.
    """
    if has_zig() and (portable or name != host()):
        return [*_zig(), "-target", PLATFORMS[name].target, "-fno-sanitize=undefined"]
    if name == host():
        return _system()
    raise InputError(
        f"--platforms {name}: expected the ziglang wheel, which compiles for other platforms; it is not "
        f"installed. Install it ({INSTALL_ZIG}), or use --platforms host."
    )


def _zig() -> list[str]:
    return [sys.executable, "-m", "ziglang", "cc"]


def _system() -> list[str]:
    if os.environ.get("CC"):
        return os.environ["CC"].split()
    for name in ("cc", "gcc", "clang"):
        if shutil.which(name):
            return [name]
    if has_zig():
        return _zig()
    raise InputError(
        "--platforms host: expected a C compiler ($CC, cc, gcc or clang) or the ziglang wheel; got neither. "
        f"Install a compiler, or zig with {INSTALL_ZIG}."
    )


def run(arguments: Sequence[str], folder: Path, purpose: str) -> None:
    """Run a compiler in ``folder``, which also takes what zig would keep for later.

    Raises:
        InputError: it fails; its messages are in the error.
    """
    environment = os.environ | {"ZIG_LOCAL_CACHE_DIR": str(folder / "zig-cache")}
    try:
        done = subprocess.run(
            arguments, cwd=folder, env=environment, capture_output=True, text=True, check=False
        )
    except OSError as error:
        raise InputError(
            f"{purpose}: {arguments[0]} cannot be started: {error.strerror}. Check $CC."
        ) from error
    if done.returncode:
        raise InputError(f"{purpose}: expected the compiler to succeed; got:\n{done.stderr.strip()}")
