"""FMUs that have only Windows binaries: the same numbers, the same errors, and no process of Wine is left."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from linkwind.errors import InputError, SimulationError
from linkwind.fmi.host import wine
from tests.fmi_host.foreign import Variable, fmu
from tests.fmi_host.test_matrix import DRAG, LAG, LEAK, WHEN, fly
from tests.fmi_host.test_stepping import OSCILLATOR

needs_wine = pytest.mark.skipif(bool(wine.needed()), reason=f"install {wine.needed()}")
both = pytest.mark.parametrize("fmi", [2, 3])


@pytest.fixture(autouse=True)
def no_wine_is_left(tmp_path):
    """Wine's processes are no children of this one: they are known by where they write."""
    yield
    for process in Path("/proc").glob("[0-9]*"):
        try:
            environment = (process / "environ").read_bytes()
        except OSError:
            continue
        assert str(tmp_path).encode() not in environment, (process / "cmdline").read_bytes()


@needs_wine
@both
def test_the_numbers_of_the_linux_binary(host, tmp_path, fmi):
    """A pendulum by Runge-Kutta in Model Exchange, without functions of libm: bit for bit."""
    foreign = replace(OSCILLATOR, fmi=fmi)
    here, there = host(foreign), host(fmu(tmp_path, foreign, "windows", windows=True))
    for k in range(6):
        for hosted in (here, there):
            hosted.motion.linear[0, 0] = 0.3 * k
        force = here.step(k)[0]
        assert there.step(k)[0].tolist() == force.tolist()
    assert force[0] != 0.0


@needs_wine
@both
def test_going_back_and_start_values(host, tmp_path, fmi):
    foreign = replace(
        LAG,
        fmi=fmi,
        variables=(*LAG.variables, Variable("k", "parameter", start=1.0)),
        code="#define STEP(m, t, h) (m->x[0] += m->v[2] * (h) * m->v[0], OK)\n"
        "#define OUTPUTS(m) (m->v[1] = m->x[0])",
    )
    hosted = host(fmu(tmp_path, foreign, "windows", windows=True), "start = { k = 4.0 }")
    hosted.motion.position[0, 0] = 2.0
    hosted.step(0)
    blob = hosted.model.save()
    assert hosted.step(1)[0][0] == 8e-3
    hosted.model.restore(blob)
    hosted.motion.position[0, 0] = 1.0
    assert hosted.at(1)[0][0] == 4e-3


FAULTS = {
    "crash": (
        WHEN.format("*(volatile int *)0 = 1, OK"),
        "",
        r"died in fmi.DoStep: exception 0xC0000005, acc",
    ),
    "abort": (WHEN.format("abort(), OK"), "", r"its Windows process died in fmi.DoStep: ex"),
    "exit": (WHEN.format("_exit(7), OK"), "", r"its Windows process died in fmi.DoStep: exit status 7"),
    "hang": (WHEN.format("Sleep(1000000), OK"), "timeout = 0.5", r"no answer within 0\.5 s in fmi.DoStep"),
    "error": (
        WHEN.format('complain(m, "out of range by %d", 7)'),
        "",
        r"fmi.DoStep returned Error\nIts last lines:\n  \| \[Error\] out of range by 7",
    ),
    "chatter": (
        WHEN.format('puts("the last words"), fflush(0), *(volatile int *)0 = 1, OK'),
        "",
        r"0xC0000005, access violation\nIts last lines:\n  \| the last words",
    ),
    "leak": (
        LEAK + "return kept ? (memset(kept, 1, 1 << 24), OK) : ERROR; }\n#define STEP(m, t, h) leak()",
        "memory = 1e8",
        r"fmi.DoStep returned Error",
    ),
}


@needs_wine
@both
@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_is_one_error_that_says_where(host, tmp_path, fmi, fault):
    code, toml, expected = FAULTS[fault]
    foreign = replace(DRAG, fmi=fmi, code=f"{DRAG.code}\n{code}")
    hosted = host(fmu(tmp_path, foreign, "windows", windows=True), toml)
    with pytest.raises(SimulationError, match=expected):
        fly(hosted, 30)


@needs_wine
def test_a_dll_that_needs_another(host, tmp_path):
    file = fmu(tmp_path, DRAG, "windows", windows=True)
    data = file.read_bytes().replace(b"ucrtbase.dll", b"elsewher.dll")
    file.write_bytes(data)
    with pytest.raises((SimulationError, InputError), match=r"a DLL that it needs is missing|intact entry"):
        host(file)


def test_what_is_missing_is_said(host, tmp_path, monkeypatch):
    file = tmp_path / "windows.fmu"
    monkeypatch.setattr("tests.fmi_host.foreign.windows_library", lambda fmi, text: b"MZ")
    fmu(tmp_path, DRAG, "windows", windows=True)
    monkeypatch.setattr(wine, "needed", lambda: "wine64 (apt-get install wine64)")
    with pytest.raises(InputError, match=r"has only Windows binaries: to run these, install wine64 \(apt"):
        host(file)
    monkeypatch.setattr(wine, "needed", lambda: "")
    with pytest.raises(InputError, match=r"foreign\.dll to be a shared library for this machine"):
        host(file)


@needs_wine
def test_not_in_the_process_of_the_host(host, tmp_path):
    with pytest.raises(InputError, match="has only Windows binaries; got inprocess"):
        host(fmu(tmp_path, DRAG, "windows", windows=True), 'isolation = "inprocess"')
