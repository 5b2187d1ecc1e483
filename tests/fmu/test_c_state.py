"""States: kept, restored, carried to another process; damaged and foreign ones refused."""

from __future__ import annotations

import ctypes
import subprocess
import sys
import zlib

import numpy as np
import pytest

from tests.fmu.c_model import ERROR, OK, Instance, dynamics

H = 0.01
STEPS = 12


def advance(fmu: Instance, first: int, last: int) -> None:
    for k in range(first, last):
        fmu.set("FORCE", np.sin(np.arange(fmu.size("FORCE")) + 0.3 * k))
        fmu.step(k * H, H)


def everything(fmu: Instance) -> bytes:
    return fmu.get(*(name for name in fmu.model.sizes if fmu.model.sizes[name])).tobytes()


@pytest.fixture
def fmu(spatial_library, spatial_model):
    instance = Instance(spatial_library, spatial_model)
    instance.set_integer("INTEGRATOR", 3)  # it remembers its substep
    yield instance.initialize(0.0, STEPS * H)
    instance.free()


def test_restored_instance_goes_the_same_way(fmu):
    advance(fmu, 0, 5)
    fmu.set("MASS", 1.1 * fmu.get("MASS"))
    handle, at_5 = fmu.get_state(), everything(fmu)
    advance(fmu, 5, STEPS)
    at_end = everything(fmu)
    for _ in range(2):
        fmu.do("SetFMUState", handle)
        assert everything(fmu) == at_5
        advance(fmu, 5, STEPS)
        assert everything(fmu) == at_end
    assert fmu.try_step(STEPS * H, H)[0] == ERROR  # the stop time came back, too
    fmu.do("FreeFMUState", ctypes.byref(handle))
    assert not handle
    fmu.do("FreeFMUState", ctypes.byref(handle))  # nothing to free


def test_mode_and_parameters_come_back(fmu):
    handle = fmu.get_state()
    mass = fmu.get("MASS")
    fmu.set("MASS", 2 * mass)
    fmu.set_integer("INTEGRATOR", 0)
    fmu.do("Terminate")
    fmu.do("SetFMUState", handle)
    assert fmu.get("MASS").tobytes() == mass.tobytes()
    advance(fmu, 0, 1)
    fmu.do("Reset")
    assert fmu.try_step(0.0, H)[0] == ERROR
    fmu.do("SetFMUState", handle)
    advance(fmu, 0, 1)


def test_a_handle_may_be_used_again(fmu):
    handle = fmu.get_state()
    first = handle.value
    advance(fmu, 0, 3)
    fmu.do("GetFMUState", ctypes.byref(handle))
    assert handle.value == first
    here = everything(fmu)
    advance(fmu, 3, 5)
    fmu.do("SetFMUState", handle)
    assert everything(fmu) == here


OTHER_PROCESS = """
import sys
from pathlib import Path
from tests.fmu.c_model import Instance, OK
from tests.fmu.conftest import c_model, spatial_mechanism
from tests.fmu.test_c_state import advance, everything, STEPS
fmu = Instance(Path(sys.argv[1]), c_model.dynamics(*spatial_mechanism()))
status, handle = fmu.deserialize(sys.stdin.buffer.read())
assert status == OK, fmu.messages
fmu.do("SetFMUState", handle)
advance(fmu, 5, STEPS)
sys.stdout.buffer.write(everything(fmu))
"""


def test_bytes_go_to_another_process(fmu, spatial_library):
    advance(fmu, 0, 5)
    blob = fmu.serialize(fmu.get_state())
    advance(fmu, 5, STEPS)
    command = [sys.executable, "-c", OTHER_PROCESS, str(spatial_library)]
    done = subprocess.run(command, input=blob, capture_output=True, check=True)
    assert done.stdout == everything(fmu)


def test_bytes_are_the_documented_ones(fmu):
    """Header and checksum, with Python's CRC-32."""
    advance(fmu, 0, 2)
    blob = fmu.serialize(fmu.get_state())
    assert blob[:8] == b"LWFMU\0\0\1"
    assert len(blob) == 24 + 8 * int.from_bytes(blob[16:20], "little")
    assert int.from_bytes(blob[20:24], "little") == zlib.crc32(blob[:20] + blob[24:])
    assert fmu.get("Q").tobytes() in blob


def test_every_damaged_byte_is_seen(fmu):
    blob = bytearray(fmu.serialize(fmu.get_state()))
    for at in [*range(30), *range(30, len(blob), 97), len(blob) - 1]:
        blob[at] ^= 0x10
        status, handle = fmu.deserialize(bytes(blob))
        assert (status, handle.value) == (ERROR, None)
        blob[at] ^= 0x10
    assert fmu.deserialize(bytes(blob))[0] == OK
    for bad in (b"", blob[:23], blob[:-1], blob + b"\0", b"x" * len(blob)):
        assert fmu.deserialize(bytes(bad))[0] == ERROR
    assert "Expected a state of this model but was other bytes" in fmu.messages[-1][2]


def signed(blob: bytes) -> bytes:
    return blob[:20] + zlib.crc32(blob[:20] + blob[24:]).to_bytes(4, "little") + blob[24:]


@pytest.mark.parametrize(
    ("index", "value", "flaw"),
    [
        (0, 0.0, "another interface type"),
        (1, 3.0, "unknown mode"),
        (1, 8.0, "unknown mode"),
        (2, np.nan, "not finite"),
        (5, 1e10, "broken integers"),
        (20, np.inf, "not finite"),
    ],
)
def test_nonsense_with_a_good_checksum(fmu, index, value, flaw):
    blob = bytearray(fmu.serialize(fmu.get_state()))
    blob[24 + 8 * index : 32 + 8 * index] = np.float64(value).tobytes()
    assert fmu.deserialize(signed(bytes(blob)))[0] == ERROR
    assert flaw in fmu.messages[-1][2]


def test_state_of_another_model(compiler, fmu, planar_library, planar_model, two_link):
    planar = Instance(planar_library, planar_model).initialize()
    other = dynamics(two_link.tables, two_link.q0, two_link.v0, token="{other}")
    stranger = Instance(compiler.library(other, 3, "other_token"), other, token="{other}").initialize()
    assert stranger.deserialize(planar.serialize(planar.get_state()))[0] == ERROR
    assert "another model" in stranger.messages[-1][2]
    assert fmu.deserialize(planar.serialize(planar.get_state()))[0] == ERROR  # the same token, another size
    assert "another length" in fmu.messages[-1][2]


def test_freed_and_foreign_handles(fmu, spatial_library, spatial_model):
    other = Instance(spatial_library, spatial_model).initialize()
    foreign, freed = other.get_state(), fmu.get_state()
    stale = ctypes.c_void_p(freed.value)
    fmu.do("FreeFMUState", ctypes.byref(freed))
    size, data = ctypes.c_size_t(), ctypes.create_string_buffer(8)
    for handle in (foreign, stale, ctypes.c_void_p(1), ctypes.c_void_p(None)):
        assert fmu.call("SetFMUState", handle) == ERROR
        assert fmu.call("SerializedFMUStateSize", handle, ctypes.byref(size)) == ERROR
        assert fmu.call("SerializeFMUState", handle, data, ctypes.c_size_t(8)) == ERROR
        if handle:
            assert fmu.call("FreeFMUState", ctypes.byref(handle)) == ERROR
            assert fmu.call("GetFMUState", ctypes.byref(handle)) == ERROR
    other.do("SetFMUState", foreign)
    mine = fmu.get_state()
    assert fmu.call("SerializeFMUState", mine, data, ctypes.c_size_t(8)) == ERROR
    assert fmu.messages[-1][2].endswith("but was 8.")
