"""Windows binaries on Linux: Wine for one run, in the run's own folder.

The loader is Debian's wine64. Its "C:" is a few links to the DLLs that Wine is installed with, which takes a
tenth of a second; a full one takes eight, and 700 MB. There is no registry but an empty one, and no display.
"""

from __future__ import annotations

import importlib.util
import logging
import os
import shutil
import subprocess
import sys
from collections.abc import Mapping
from importlib.resources import files
from pathlib import Path

from linkwind.fmi import toolchain

CALLER = "lw_call.exe"
PREFIX = "wine"  # name of the folder beside the unpacked FMU
_LOADERS = ("/usr/lib/wine/wine64", "/usr/lib64/wine/wine64", "/opt/wine-stable/bin/wine64")
_DLLS = ("lib/x86_64-linux-gnu/wine", "lib64/wine", "lib/wine")  # below /usr or /opt/wine-stable
_END_TIMEOUT = 10.0  # s
_KERNEL = (
    "DuplicateHandle ExitProcess GetCurrentProcess GetLastError GetProcAddress GetStdHandle LoadLibraryExA "
    "ReadFile SetErrorMode SetStdHandle SetUnhandledExceptionFilter TerminateProcess WriteFile"
)
_RUNTIME = "__stdio_common_vsprintf _dup2 calloc free malloc memcpy memset"
_log = logging.getLogger("linkwind.fmu")


def loader() -> str | None:
    """Return the program that runs 64-bit Windows programs, or None where there is none."""
    return shutil.which("wine64") or next((path for path in _LOADERS if Path(path).exists()), None)


def needed() -> str:
    """Return what has to be installed before Windows binaries run here; empty if nothing is missing."""
    missing = ["wine64 (apt-get install wine64)"] if loader() is None else []
    if not toolchain.has_zig():
        missing.append(f"the ziglang wheel ({toolchain.INSTALL_ZIG})")
    return " and ".join(missing)


def environment(folder: Path, base: Mapping[str, str]) -> dict[str, str]:
    """Return the environment of Windows programs of a run.

    Args:
        folder: of the run, for all that Wine writes.
        base: environment to start from.
    """
    own = {
        "WINEPREFIX": str(folder / PREFIX),
        "WINEDEBUG": "-all",
        "WINEDLLOVERRIDES": "mscoree,mshtml=",
        "TMPDIR": str(folder),  # of wineserver
    }
    return {key: value for key, value in base.items() if not key.startswith(("WINE", "DISPLAY"))} | own


class Wine:
    """Wine in the folder of a run, and the program that calls DLLs there.

    Attributes:
        command: starts that program.
    """

    def __init__(self, folder: Path) -> None:
        """Set up, compile; nothing of Wine runs yet.

        Raises:
            InputError: the compiler fails.
        """
        found = loader()
        assert found is not None
        self._folder = folder
        self._set_up(Path(found).resolve())
        compile_caller(folder)
        self.command = (found, str(folder / CALLER))

    def _set_up(self, program: Path) -> None:
        """Write a minimal "C:", unless the DLLs are not where they are expected: Wine then writes its own."""
        roots = [folder / below for folder in program.parents for below in _DLLS]
        dlls = next((root for root in roots if (root / "x86_64-windows" / "kernel32.dll").exists()), None)
        prefix = self._folder / PREFIX
        prefix.mkdir()
        if dlls is None:
            return
        windows, devices = prefix / "drive_c" / "windows", prefix / "dosdevices"
        windows.mkdir(parents=True)
        devices.mkdir()
        (windows / "system32").symlink_to(dlls / "x86_64-windows")
        (devices / "c:").symlink_to("../drive_c")
        (devices / "z:").symlink_to("/")
        (prefix / ".update-timestamp").write_text("disable")

    def close(self) -> None:
        """End every process of this Wine, its server too."""
        server = shutil.which("wineserver") or str(Path(self.command[0]).with_name("wineserver"))
        try:
            subprocess.run(
                [server, "-k"],
                env=environment(self._folder, os.environ),
                stdin=subprocess.DEVNULL,
                capture_output=True,
                timeout=_END_TIMEOUT,
                check=False,
            )
        except (OSError, subprocess.TimeoutExpired) as error:
            _log.warning("wineserver -k: %s", error)


def compile_caller(folder: Path) -> None:
    """Compile the Windows program that calls DLLs, straight on the libraries that every Windows has.

    Raises:
        InputError: the compiler fails.
    """
    zig, purpose = [sys.executable, "-m", "ziglang"], "the program that calls Windows DLLs"
    source = files("linkwind").joinpath("_data", "fmu", "host", "lw_call.c")
    (folder / "lw_call.c").write_bytes(source.read_bytes())
    for name, functions in (("kernel32", _KERNEL), ("ucrtbase", _RUNTIME)):
        text = "\n".join([f"LIBRARY {name}.dll", "EXPORTS", *functions.split()])
        (folder / f"{name}.def").write_text(text + "\n")
        arguments = ["-m", "i386:x86-64", "-d", f"{name}.def", "-l", f"lib{name}.a"]
        toolchain.run([*zig, "dlltool", *arguments], folder, purpose)
    spec = importlib.util.find_spec("ziglang")
    assert spec is not None
    assert spec.origin is not None
    headers = Path(spec.origin).parent / "lib" / "libc" / "include" / "any-windows-any"
    flags = ["-target", "x86_64-windows-gnu", "-nostdlib", "-isystem", str(headers), "-O1", "-s"]
    link = ["-Wl,-e,mainCRTStartup", "-o", CALLER, "lw_call.c", "libkernel32.a", "libucrtbase.a"]
    toolchain.run([*zig, "cc", *flags, *link], folder, purpose)
