"""Programs that some commands use and most do not."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Iterator

from linkwind.doctor.finding import OK, WARN, Finding
from linkwind.fmi import toolchain
from linkwind.fmi.host import wine

PATIENCE = 10.0  # s for a program to tell its version


def docker() -> Finding:
    """Look for Docker and compose, and whether the daemon answers."""
    if shutil.which("docker") is None:
        change = "for docker/compose.yaml only: apt-get install docker.io docker-compose"
        return Finding("Docker", WARN, "not installed", change)
    engine = _said("docker", "info", "--format", "{{.ServerVersion}}")
    if not engine:
        return Finding("Docker", WARN, "does not run", "start dockerd, or join the group docker")
    compose = _said("docker", "compose", "version", "--short") or _said(
        "docker-compose", "version", "--short"
    )
    if not compose:
        return Finding("Docker", WARN, f"Engine {engine}, no compose", "apt-get install docker-compose")
    return Finding("Docker", OK, f"Engine {engine}, compose {compose}")


def fmu_platforms() -> Iterator[Finding]:
    """Look what FMUs can be made for, and run, here."""
    host = toolchain.host()
    if toolchain.has_zig():
        yield Finding(
            "FMU export", OK, f"{len(toolchain.PLATFORMS)} platforms: {', '.join(toolchain.PLATFORMS)}"
        )
    else:
        change = f"for the other platforms: {toolchain.INSTALL_ZIG}"
        yield Finding("FMU export", WARN, f"{host} only, if there is a C compiler", change)
    missing = wine.needed()
    yield Finding(
        "FMU of Windows",
        WARN if missing else OK,
        "cannot be run" if missing else "runs under Wine",
        f"for FMUs with Windows binaries alone: {missing}" if missing else "",
    )
    emulator = shutil.which("qemu-aarch64-static") or shutil.which("qemu-aarch64")
    change = "" if emulator else "to test ARM64 FMUs here: apt-get install qemu-user-static"
    yield Finding("qemu", OK if emulator else WARN, emulator or "not installed", change)


def _said(*command: str) -> str:
    """Return what a program prints; empty if it fails or is not there."""
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE, check=False)
    except (OSError, subprocess.TimeoutExpired):
        return ""
    return done.stdout.strip() if done.returncode == 0 else ""
