"""Binaries for other machines: their formats, what they need, and that they run."""

from __future__ import annotations

import os
import re
import shutil
import struct
import subprocess
import sys
import zipfile
from pathlib import Path

import numpy as np
import pytest

from linkwind.fmi import build
from linkwind.fmi.slave import Slave, read_description
from linkwind.fmi.toolchain import PLATFORMS

WINE = shutil.which("wine64") or shutil.which("wine") or "/usr/lib/wine/wine64"
QEMU = shutil.which("qemu-aarch64-static") or shutil.which("qemu-aarch64")
ARM_ROOT = Path("/usr/aarch64-linux-gnu")  # Debian's libc6-arm64-cross
STEPS, H = 50, 1e-3
ELF_MACHINES = {"x86_64-linux": 62, "aarch64-linux": 183}
MACH_O = {"x86_64-darwin": 0x01000007, "aarch64-darwin": 0x0100000C}


def binaries(exported) -> dict[str, bytes]:
    with zipfile.ZipFile(exported.file) as archive:
        return {name.split("/")[1]: archive.read(name) for name in archive.namelist() if "binaries/" in name}


def test_formats_of_fmi_3(everywhere):
    images = binaries(everywhere)
    assert set(images) == {*ELF_MACHINES, *MACH_O, "x86_64-windows"}
    for name, machine in ELF_MACHINES.items():
        assert images[name][:5] == b"\x7fELF\x02"
        assert struct.unpack_from("<HH", images[name], 16) == (3, machine)  # shared object
    for name, processor in MACH_O.items():
        magic, kind, _, filetype = struct.unpack_from("<IIII", images[name])
        assert (magic, kind, filetype) == (0xFEEDFACF, processor, 6)  # dynamic library
    image = images["x86_64-windows"]
    (at,) = struct.unpack_from("<I", image, 0x3C)
    assert image[:2] == b"MZ"
    assert image[at : at + 6] == b"PE\0\0\x64\x86"


def test_folders_of_fmi_2(everywhere, monkeypatch):
    """FMI 2 knows one folder for macOS: its binary is for both processors. The images are those of FMI 3."""
    images = binaries(everywhere)
    monkeypatch.setattr(build, "_compile", lambda sources, name, command: images[name])
    found = build.binaries({}, PLATFORMS, "model", "2", portable=True)
    assert set(found) == {
        "binaries/linux64/model.so", "binaries/win64/model.dll", "binaries/darwin64/model.dylib",
        "binaries/aarch64-linux/model.so",
    }  # fmt: skip
    both = found["binaries/darwin64/model.dylib"]
    assert struct.unpack_from(">II", both) == (0xCAFEBABE, 2)
    for entry, (name, processor) in enumerate(MACH_O.items()):
        kind, _, offset, size, align = struct.unpack_from(">IIIII", both, 8 + 20 * entry)
        assert kind == processor
        assert offset % 2**align == 0
        assert both[offset : offset + size] == images[name]


@pytest.mark.parametrize("name", ELF_MACHINES)
def test_linux_binaries_run_on_systems_of_2012(everywhere, name):
    image = binaries(everywhere)[name]
    versions = {tuple(map(int, found)) for found in re.findall(rb"GLIBC_(\d+)\.(\d+)", image)}
    assert versions
    assert max(versions) <= (2, 17)
    needed = set(re.findall(rb"lib[\w-]+\.so\.\d", image))
    assert needed <= {b"libc.so.6", b"libm.so.6"}


def test_windows_binary_needs_only_the_universal_runtime(everywhere):
    image = binaries(everywhere)["x86_64-windows"]
    assert set(re.findall(rb"[\w-]+\.dll", image)) <= {b"ucrtbase.dll", b"binary.dll"}


def test_only_the_standard_is_exported(everywhere):
    with zipfile.ZipFile(everywhere.file) as archive:
        header = archive.read("sources/fmi3.h").decode()
    image = binaries(everywhere)["x86_64-linux"]
    exported = dynamic_symbols(image)
    assert {"fmi3DoStep", "fmi3GetVersion"} <= exported
    assert {name for name in exported if not re.fullmatch(r"fmi3\w+", name)} == set()
    assert all(name in header or name[4:7] in ("Get", "Set") for name in exported)


def dynamic_symbols(image: bytes) -> set[str]:
    """Return the names of the symbols that a 64-bit ELF library defines for others."""
    (sections,) = struct.unpack_from("<Q", image, 0x28)
    size, count = struct.unpack_from("<HH", image, 0x3A)
    tables = [struct.unpack_from("<IIQQQQIIQQ", image, sections + i * size) for i in range(count)]
    symbols = next(table for table in tables if table[1] == 11)  # SHT_DYNSYM
    strings = tables[symbols[6]][4]
    names = set()
    for at in range(symbols[4], symbols[4] + symbols[5], 24):
        name, info, _, section = struct.unpack_from("<IBBH", image, at)
        if section and info >> 4:
            names.add(image[strings + name : image.index(b"\0", strings + name)].decode())
    return names


def test_everything_is_small(everywhere):
    assert everywhere.bytes == everywhere.file.stat().st_size <= 350_000


# ---- running them ----


def zig(*arguments: str, folder: Path) -> None:
    subprocess.run([sys.executable, "-m", "ziglang", *arguments], cwd=folder, check=True, capture_output=True)


def prepare(everywhere, folder: Path, platform: str, suffix: str) -> np.ndarray:
    """Put library, inputs and driver source into a folder; return what this machine computes."""
    file = everywhere.file
    (folder / f"model{suffix}").write_bytes(binaries(everywhere)[platform])
    shutil.copy(Path(__file__).with_name("driver.c"), folder)
    description = read_description(file)
    reference = {variable.name: variable.valueReference for variable in description.modelVariables}
    inputs, outputs = ["link1.F", "link2.T"], ["link1.r", "link2.orientation", "hinge.v", "hinge.F"]
    phase = np.arange(6.0).reshape(2, 3)
    rows = [5.0 * np.sin(0.2 * k + phase) for k in range(STEPS)]
    numbers = [reference[name] for name in (*inputs, *outputs)]
    head = struct.pack("<64sIIIIIId", description.instantiationToken.encode(), 2, 4, 6, 11, STEPS, 0, H)
    head += struct.pack(f"<{len(numbers)}I", *numbers) + bytes(4 * (256 - len(numbers)))
    (folder / "input.bin").write_bytes(head + np.array(rows).tobytes())
    expected = []
    with Slave(file) as slave:
        for k, row in enumerate(rows):
            slave.set(dict(zip(inputs, row, strict=True)))
            slave.step(k, H)
            expected.append(np.concatenate(list(slave.get(outputs).values())))
    return np.array(expected)


def compare(folder: Path, expected: np.ndarray) -> None:
    """The C libraries' sines differ in the last bit, nothing else does."""
    got = np.frombuffer((folder / "output.bin").read_bytes()).reshape(STEPS, -1)
    assert np.isfinite(got).all()
    assert np.ptp(got, axis=0).max() > 0.01  # something moves
    np.testing.assert_allclose(got, expected, rtol=1e-11, atol=1e-11)


@pytest.mark.skipif(not Path(WINE).exists(), reason="wine64 is not installed: apt-get install wine64")
def test_windows_binary_runs_under_wine(everywhere, tmp_path):
    expected = prepare(everywhere, tmp_path, "x86_64-windows", ".dll")
    for library, functions in (("kernel32", "LoadLibraryA GetProcAddress ExitProcess"),
                               ("ucrtbase", "fopen fread fwrite fclose memcpy memset")):  # fmt: skip
        text = "\n".join([f"LIBRARY {library}.dll", "EXPORTS", *functions.split()])
        (tmp_path / f"{library}.def").write_text(text + "\n")
        arguments = ("-m", "i386:x86-64", "-d", f"{library}.def", "-l", f"lib{library}.a")
        zig("dlltool", *arguments, folder=tmp_path)
    target = ("-target", "x86_64-windows-gnu", "-nostdlib", "-Wl,-e,mainCRTStartup", "-O1")
    zig("cc", *target, "-o", "driver.exe", "driver.c", "libkernel32.a", "libucrtbase.a", folder=tmp_path)
    quiet = os.environ | {
        "WINEPREFIX": str(tmp_path / "prefix"),
        "WINEDEBUG": "-all",
        "WINEDLLOVERRIDES": "mscoree,mshtml=",
    }
    quiet.pop("DISPLAY", None)
    done = subprocess.run(
        [WINE, "driver.exe"], cwd=tmp_path, env=quiet, capture_output=True, timeout=300, check=False
    )
    assert done.returncode == 0, done.stderr.decode()
    compare(tmp_path, expected)


@pytest.mark.skipif(
    not QEMU or not (ARM_ROOT / "lib" / "libm.so.6").exists(),
    reason="qemu or the ARM libc is not installed: apt-get install qemu-user-static libc6-arm64-cross",
)
def test_arm_binary_runs_under_qemu(everywhere, tmp_path):
    expected = prepare(everywhere, tmp_path, "aarch64-linux", ".so")
    target = ("-target", "aarch64-linux-gnu.2.17", "-O1")
    zig("cc", *target, "-o", "driver", "driver.c", "-ldl", folder=tmp_path)
    command = [QEMU, "-L", str(ARM_ROOT), "./driver"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr.decode()
    compare(tmp_path, expected)
