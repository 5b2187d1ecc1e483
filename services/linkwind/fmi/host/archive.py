"""Opening the file of an FMU without trusting it: a zip archive from somebody else.

Nothing of the archive is used before all of it has been looked at. Only what a run needs is unpacked: the
model description, the binaries of this platform and the resources.
"""

from __future__ import annotations

import hashlib
import stat
import sys
import zipfile
from pathlib import Path, PurePosixPath
from platform import machine
from xml.parsers import expat

from linkwind.errors import InputError
from linkwind.fmi.host import wine

DESCRIPTION = "modelDescription.xml"
MAX_ENTRIES = 20_000
MAX_SIZE = 4 << 30  # B unpacked, of all entries
MAX_RATIO = 200  # unpacked to packed, for entries above SMALL; text with long runs of spaces stays below
SMALL = 16 << 20  # B
MAX_DESCRIPTION = 128 << 20  # B
_BLOCK = 1 << 20

_MACHINES = {"amd64": "x86_64", "x86_64": "x86_64", "arm64": "aarch64", "aarch64": "aarch64"}
_FMI2_PLATFORMS = {"x86_64-linux": "linux64", "x86_64-darwin": "darwin64", "x86_64-windows": "win64"}
_PE_X86_64 = b"PE\0\0\x64\x86"
_ELF_MACHINES = {"x86_64": 62, "aarch64": 183}


def platform_name(version: int, *, windows: bool = False) -> str:
    """Return the folder of this platform's, or of Windows' binaries in an FMU of FMI ``version``."""
    if windows:
        return "win64" if version == 2 else "x86_64-windows"
    system = "darwin" if sys.platform == "darwin" else "windows" if sys.platform == "win32" else "linux"
    name = f"{_MACHINES.get(machine().lower(), machine().lower())}-{system}"
    return _FMI2_PLATFORMS.get(name, name) if version == 2 else name


def sha256(path: Path) -> str:
    """Return the SHA-256 of a file, hexadecimal.

    Raises:
        InputError: it cannot be read.
    """
    try:
        with path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as error:
        raise InputError(f"{path}: expected an FMU; got: {error.strerror}. Check the path.") from None


class Archive:
    """The checked archive of an FMU.

    Attributes:
        path: the file.
        names: of its files.
    """

    def __init__(self, path: Path) -> None:
        """Open and check an archive.

        Raises:
            InputError: the file is no zip archive, or one that an FMU must not be.
        """
        self.path = path
        try:
            self._zip = zipfile.ZipFile(path)
            entries = self._zip.infolist()
        except OSError as error:
            raise InputError(f"{path}: expected an FMU; got: {error.strerror}. Check the path.") from None
        except Exception as error:  # zipfile raises many kinds for damaged archives
            raise self._refuse("an FMU (a zip archive)", f"a file that is none: {error}") from None
        try:
            self._check(entries)
        except InputError:
            self._zip.close()
            raise
        self.names = frozenset(entry.filename for entry in entries if not entry.is_dir())

    def _refuse(
        self, expected: str, got: str, advice: str = "Get the file again from its source."
    ) -> InputError:
        return InputError(f"{self.path}: expected {expected}; got {got}. {advice}")

    def _check(self, entries: list[zipfile.ZipInfo]) -> None:
        if len(entries) > MAX_ENTRIES:
            raise self._refuse(f"at most {MAX_ENTRIES} entries", f"{len(entries)}")
        if sum(entry.file_size for entry in entries) > MAX_SIZE:
            size = sum(entry.file_size for entry in entries)
            raise self._refuse(
                f"at most {MAX_SIZE >> 30} GiB unpacked", f"{size / 2**30:.1f} GiB: a zip bomb?"
            )
        seen: dict[str, tuple[int, int]] = {}  # some tools write an entry twice; twice the same is harmless
        for entry in entries:
            self._check_entry(entry)
            content = (entry.CRC, entry.file_size)
            if seen.setdefault(entry.filename, content) != content:
                raise self._refuse("each entry once", f'two different entries "{entry.filename}"')

    def _check_entry(self, entry: zipfile.ZipInfo) -> None:
        # orig_filename: zipfile itself turns backslashes and NULs of the name into something harmless.
        name, parts = entry.orig_filename, PurePosixPath(entry.orig_filename).parts
        got = f"entry {name!r}"
        if "\\" in name:
            raise self._refuse("entries with forward slashes", got)
        if name.startswith("/") or ":" in name or "\0" in name:
            raise self._refuse("entries with relative paths", got)
        if ".." in parts or not parts:
            raise self._refuse("entries that stay in the folder of the FMU", got)
        mode = stat.S_IFMT(entry.external_attr >> 16)
        if mode not in (0, stat.S_IFREG, stat.S_IFDIR):
            kind = "a link" if mode == stat.S_IFLNK else "a special file"
            raise self._refuse("entries that are files", f"{got}, {kind}")
        if entry.flag_bits & 1:
            raise self._refuse("entries that are not encrypted", got)
        if entry.file_size > SMALL and entry.file_size > MAX_RATIO * entry.compress_size:
            ratio = entry.file_size / max(1, entry.compress_size)
            raise self._refuse(
                f"entries packed at most {MAX_RATIO} to 1", f"{got}, {ratio:.0f} to 1: a zip bomb?"
            )

    def description(self) -> bytes:
        """Return the model description, checked to be well-formed XML without a document type.

        Raises:
            InputError: it is missing, damaged, or defines entities.
        """
        if DESCRIPTION not in self.names:
            raise self._refuse(f"{DESCRIPTION} in the archive", "none", "Is it an FMU at all?")
        if self._zip.getinfo(DESCRIPTION).file_size > MAX_DESCRIPTION:
            raise self._refuse(f"{DESCRIPTION} of at most {MAX_DESCRIPTION >> 20} MiB", "a larger one")
        try:
            text = self._zip.read(DESCRIPTION)
        except Exception as error:
            raise self._refuse(f"an intact {DESCRIPTION}", f"{error}") from None
        parser = expat.ParserCreate()

        def doctype(*_: object) -> None:
            raise self._refuse(f"{DESCRIPTION} without a document type", "one, which can define entities")

        parser.StartDoctypeDeclHandler = doctype
        try:
            parser.Parse(text, True)
        except (expat.ExpatError, LookupError, ValueError) as error:  # also an encoding that nobody knows
            raise self._refuse(f"{DESCRIPTION} to be well-formed XML", f"{error}") from None
        return text

    def platforms(self) -> list[str]:
        """Return the folders with binaries, and ``sources`` where there is C code."""
        found = {PurePosixPath(name).parts[1] for name in self.names if name.startswith("binaries/")}
        sources = any(name.startswith("sources/") and name.endswith(".c") for name in self.names)
        return sorted(found) + ["sources"] * sources

    def library(self, version: int, identifier: str) -> tuple[str, bool]:
        """Return the entry of the shared library for this platform, or for Windows if there is no other.

        Returns:
            the entry's name, and whether it is for Windows.

        Raises:
            InputError: there is none, or it is made for another machine.
        """
        if (
            not identifier.replace("_", "").replace("-", "").replace(".", "").isalnum()
            or identifier[0] == "."
        ):
            raise self._refuse("a modelIdentifier of letters, digits and _", f"{identifier!r}")
        suffix = {"darwin": "dylib", "win32": "dll"}.get(sys.platform, "so")
        name = f"binaries/{platform_name(version)}/{identifier}.{suffix}"
        for_windows = f"binaries/{platform_name(version, windows=True)}/{identifier}.dll"
        windows = name not in self.names and for_windows in self.names and machine() == "x86_64"
        if windows and not wine.needed():
            name = for_windows
        if name not in self.names:
            advice = self._advice(version, runs_in_wine=windows)
            raise self._refuse(f"{name}", f"binaries for {self._have()}", advice)
        with self._zip.open(name) as file:
            self._check_library(name, file.read(4096))
        return name, windows

    def _check_library(self, name: str, head: bytes) -> None:
        if name.endswith(".so"):
            code = _ELF_MACHINES.get(_MACHINES.get(machine().lower(), ""))
            right = head[:4] == b"\x7fELF" and int.from_bytes(head[18:20], "little") == code
        else:
            at = int.from_bytes(head[60:64], "little")
            right = not name.endswith(".dll") or (head[:2] == b"MZ" and head[at : at + 6] == _PE_X86_64)
        if not right:
            raise self._refuse(f"{name} to be a shared library for this machine", "another file")

    def _have(self) -> str:
        return ", ".join(name for name in self.platforms() if name != "sources") or "no platform"

    def _advice(self, version: int, *, runs_in_wine: bool) -> str:
        platforms = self.platforms()
        if "sources" in platforms:
            return f"It carries its C sources; build them with: python -m fmpy compile {self.path}"
        if runs_in_wine:
            return f"It has only Windows binaries: to run these, install {wine.needed()}."
        return f"Ask its author for a binary for {platform_name(version)}."

    def unpack(self, version: int, folder: Path, *, windows: bool = False) -> None:
        """Write model description, binaries of this platform (or Windows) and resources below ``folder``.

        Raises:
            InputError: an entry is damaged or larger than it says.
        """
        wanted = (DESCRIPTION, f"binaries/{platform_name(version, windows=windows)}/", "resources/")
        (folder / "resources").mkdir(parents=True, exist_ok=True)  # FMUs are told its path
        for entry in self._zip.infolist():
            target = folder / entry.filename
            if not entry.is_dir() and entry.filename.startswith(wanted) and not target.exists():
                self._write(entry, target)

    def _write(self, entry: zipfile.ZipInfo, target: Path) -> None:
        target.parent.mkdir(parents=True, exist_ok=True)
        left = entry.file_size
        try:
            with self._zip.open(entry) as source, target.open("xb") as file:
                while block := source.read(_BLOCK):
                    left -= len(block)
                    if left < 0:
                        raise zipfile.BadZipFile("it is larger than it says")
                    file.write(block)
        except Exception as error:
            raise self._refuse(f'an intact entry "{entry.filename}"', f"{error}") from None

    def close(self) -> None:
        """Close the file."""
        self._zip.close()
