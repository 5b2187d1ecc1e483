"""A disk of its own for a run, that fails when it is told to."""

from __future__ import annotations

import os
import shutil
import subprocess
import tempfile
from pathlib import Path

SIZE = 64 * 2**20  # bytes


def reason() -> str:
    """Return why there can be no such disk here; empty if there can."""
    missing = [name for name in ("mkfs.ext4", "mount", "umount") if shutil.which(name) is None]
    if missing:
        return f"needs the commands {', '.join(missing)} (e2fsprogs, mount)"
    if os.geteuid() != 0:
        return "a disk is mounted by root alone"
    with tempfile.TemporaryDirectory() as folder:
        try:
            Disk(Path(folder)).end()
        except subprocess.CalledProcessError as error:
            return f"no disk can be mounted here: {error.stderr.strip()}"
    return ""


class Disk:
    """An ext4 file system in a file."""

    def __init__(self, folder: Path) -> None:
        """Make and mount it at ``folder/disk``."""
        self.place = folder / "disk"
        self.place.mkdir()
        image = folder / "disk.img"
        with image.open("wb") as file:
            file.truncate(SIZE)
        _do("mkfs.ext4", "-q", "-O", "^has_journal", str(image))
        _do("mount", "-o", "loop,errors=remount-ro", str(image), str(self.place))

    def fail(self) -> None:
        """Do what the kernel does with a disk that has errors: it cannot be written any more."""
        _do("mount", "-o", "remount,abort", str(self.place))

    def end(self) -> None:
        """Take it away, with whatever still uses it."""
        _do("umount", "--lazy", str(self.place))


def _do(*command: str) -> None:
    subprocess.run(command, check=True, capture_output=True, text=True)
