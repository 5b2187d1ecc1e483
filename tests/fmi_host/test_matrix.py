"""FMUs that work and FMUs that fail in every way: the forces are right, or one error says what happened."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from linkwind.errors import InputError, SimulationError
from tests.fmi_host.foreign import Foreign, Variable, fmu, vector

DRAG = Foreign(
    (*vector("vel", "input"), *vector("force", "output")),
    code="#define OUTPUTS(m) do { for (int i = 0; i < 3; i++) m->v[3 + i] = -2.0 * m->v[i]; } while (0)",
)
STATE = (
    'canHandleVariableCommunicationStepSize="true" canGetAndSetFMUstate="true" canSerializeFMUstate="true"'
)
both = pytest.mark.parametrize("fmi", [2, 3])
isolations = pytest.mark.parametrize("isolation", ["process", "inprocess"])


@both
@isolations
def test_feedthrough_is_the_force_of_the_motion_asked_for(host, fmi, isolation):
    hosted = host(replace(DRAG, fmi=fmi), f'isolation = "{isolation}"')
    for k in range(5):
        hosted.motion.linear[0] = (k, -0.1 * k, 3.0)
        force, torque = hosted.step(k)
        assert force.tolist() == [-2.0 * k, 0.2 * k, -6.0]
        assert torque.tolist() == [0.0, 0.0, 0.0]


@both
def test_one_instance_for_each_body(host, fmi):
    hosted = host(replace(DRAG, fmi=fmi), bodies=("left", "right"))
    hosted.motion.linear[:] = [(1.0, 2.0, 3.0), (4.0, 5.0, 6.0)]
    hosted.step(0)
    assert hosted.wrench.force.tolist() == [[-2.0, -4.0, -6.0], [-8.0, -10.0, -12.0]]


def test_a_process_for_each_body_where_the_fmu_wants_one(host):
    foreign = replace(DRAG, attributes=DRAG.attributes + ' canBeInstantiatedOnlyOncePerProcess="true"')
    hosted = host(foreign, bodies=("left", "right"))
    hosted.motion.linear[:] = [(1.0, 2.0, 3.0), (4.0, 5.0, 6.0)]
    for k in range(3):
        hosted.step(k)
    assert hosted.wrench.force.tolist() == [[-2.0, -4.0, -6.0], [-8.0, -10.0, -12.0]]
    with pytest.raises(InputError, match=r"only once per process and 2 instances.*got inprocess"):
        host(foreign, 'isolation = "inprocess"', bodies=("left", "right"))


# A spring on a first-order lag: y' = (x - y) / 0.01, force = -100 y; with the input held, each step is exact.
LAG = Foreign(
    (Variable("pos.x", "input"), Variable("force.x", "output")),
    attributes=STATE,
    code="#define STEP(m, t, h) (m->x[0] = m->v[0] + (m->x[0] - m->v[0]) * exp(-(h) / 0.01), OK)\n"
    "#define OUTPUTS(m) (m->v[1] = -100.0 * m->x[0])",
)


@both
@isolations
def test_memory_of_a_spring_damper_and_going_back(host, fmi, isolation):
    hosted = host(replace(LAG, fmi=fmi), f'isolation = "{isolation}"')
    assert hosted.model.capabilities.rollback
    lag, fresh = 0.0, hosted.model.save()
    for k in range(1, 4):
        hosted.motion.position[0, 0] = 7.0
        hosted.step(k - 1)
        lag = lag if k == 1 else 7.0 + (lag - 7.0) * np.exp(-0.1)
    blob = hosted.model.save()
    before = hosted.step(3)[0][0]
    assert before == pytest.approx(-100.0 * (7.0 + (lag - 7.0) * np.exp(-0.1)), rel=1e-12)
    hosted.motion.position[0, 0] = -1.0
    hosted.model.restore(blob)
    other = hosted.at(3)[0][0]
    assert other == pytest.approx(-100.0 * (-1.0 + (lag + 1.0) * np.exp(-0.1)), rel=1e-12)
    hosted.motion.position[0, 0] = 7.0
    hosted.model.restore(blob)
    assert hosted.at(3)[0][0] == before
    hosted.model.restore(fresh)
    assert hosted.at(0)[0][0] == 0.0


@both
@isolations
def test_an_evaluation_again_starts_from_the_last_commit(host, fmi, isolation):
    """With and without serialisation of its state: what the first trial left behind is gone."""
    for attributes in (STATE, STATE.replace(' canSerializeFMUstate="true"', "")):
        hosted = host(replace(LAG, fmi=fmi, attributes=attributes), f'isolation = "{isolation}"')
        lag = 0.0
        for k in range(8):
            hosted.motion.position[0, 0] = 2.0
            expected = lag if k == 0 else 2.0 + (lag - 2.0) * np.exp(-0.1)
            first = hosted.step(k)[0][0]
            assert first == pytest.approx(-100.0 * expected, rel=1e-12)
            for trial in (-1.0, 5.0):
                hosted.motion.position[0, 0] = trial
                lag_then = lag if k == 0 else trial + (lag - trial) * np.exp(-0.1)
                assert hosted.at(k)[0][0] == pytest.approx(-100.0 * lag_then, rel=1e-12)
            hosted.motion.position[0, 0] = 2.0
            assert hosted.at(k)[0][0] == first
            lag = expected


def test_an_evaluation_again_without_state_takes_the_new_inputs(host):
    hosted = host(DRAG)
    for k in range(3):
        hosted.motion.linear[0, 0] = 1.0
        assert hosted.step(k)[0][0] == -2.0
        hosted.motion.linear[0, 0] = 3.0
        assert hosted.at(k)[0][0] == -6.0


@both
def test_a_checkpoint_goes_to_another_process(host, tmp_path, fmi):
    file = fmu(tmp_path, replace(LAG, fmi=fmi))
    first, second = host(file), host(file)
    for hosted in (first, second):
        hosted.motion.position[0, 0] = 2.0
    for k in range(6):
        first.step(k)
    second.model.restore(first.model.save())
    assert second.step(6)[0].tolist() == first.step(6)[0].tolist()


def test_state_that_stays_in_the_process(host, tmp_path):
    """canGetAndSetFMUstate without serialisation: iterations work, another process refuses."""
    file = fmu(tmp_path, replace(LAG, attributes=STATE.replace(' canSerializeFMUstate="true"', "")))
    hosted, other = host(file), host(file)
    hosted.motion.position[0, 0] = 2.0
    hosted.step(0)
    blob = hosted.model.save()
    before = hosted.step(1)[0][0]
    hosted.model.restore(blob)
    assert hosted.at(1)[0][0] == before != 0.0
    with pytest.raises(SimulationError, match="no longer kept"):
        other.model.restore(blob)


def test_without_state_there_is_no_rollback(host):
    assert not host(DRAG).model.capabilities.rollback


@both
def test_start_values_are_set(host, fmi):
    foreign = Foreign(
        (Variable("vel.x", "input"), Variable("k", "parameter", start=1.0), Variable("force.x", "output")),
        fmi=fmi,
        code="#define OUTPUTS(m) (m->v[2] = m->v[1] * m->v[0])",
    )
    hosted = host(foreign, "start = { k = 4 }")
    hosted.motion.linear[0, 0] = 3.0
    assert hosted.step(0)[0][0] == 12.0
    with pytest.raises(InputError, match=r'fmu\.start\."kk": expected a parameter or an input, such as k'):
        host(foreign, "start = { kk = 4 }")
    with pytest.raises(InputError, match=r'fmu\.start\."k": expected 1 values; got 2'):
        host(foreign, "start = { k = [1, 2] }")


def test_integer_and_boolean_start_values(host):
    extra = (Variable("n", "parameter", type="Integer", start=1), Variable("on", "parameter", type="Boolean"))
    code = "#define OUTPUTS(m) (m->v[3] = 10 * m->v[1] + m->v[2])"
    foreign = Foreign((Variable("v", "input"), *extra, Variable("f", "output")), code=code)
    assert host(foreign, "start = { n = 3, on = true }").step(0)[0][0] == 31.0
    with pytest.raises(InputError, match=r"expected a value of type Integer; got 1\.5"):
        host(foreign, "start = { n = 1.5 }")


def test_native_arrays_of_all_bodies(host):
    """FMI 3: shape (n, 3), and n a structural parameter that says how many rows there are."""
    foreign = Foreign(
        (
            Variable("n", "structuralParameter"),
            Variable("v", "input", ("n", 3)),
            Variable("F", "output", ("n", 3)),
        ),
        fmi=3,
        code="#define OUTPUTS(m) do { for (int i = 0; i < 48; i++) m->v[49 + i] = -m->v[1 + i]; } while (0)",
    )
    hosted = host(foreign, "structural = { n = 2 }", bodies=("left", "right"))
    hosted.motion.linear[:] = [(1.0, 2.0, 3.0), (4.0, 5.0, 6.0)]
    for k in range(2):
        hosted.step(k)
    assert hosted.wrench.force.tolist() == [[-1.0, -2.0, -3.0], [-4.0, -5.0, -6.0]]
    with pytest.raises(InputError, match=r"input v\[3,1\]: expected a name that tells"):
        host(foreign, bodies=("left", "right"))  # its default n is 3


def test_a_structural_parameter_that_is_no_number(host):
    """As in the Robertson problem of the Reference FMUs."""
    foreign = Foreign(
        (Variable("on", "structuralParameter", type="Boolean"), Variable("f", "output")),
        fmi=3,
        code="#define OUTPUTS(m) (m->v[1] = 5.0 * m->v[0])",
    )
    assert host(foreign).step(0)[0][0] == 0.0
    assert host(foreign, "structural = { on = 1 }").step(0)[0][0] == 5.0


@both
@isolations
def test_outputs_of_initialisation_mode_are_the_first_forces(host, fmi, isolation):
    """foreign.c refuses to give values before initialisation mode, and steps before its end."""
    code = "#define OUTPUTS(m) (m->v[0] = m->mode)"
    hosted = host(Foreign((Variable("f", "output"),), fmi=fmi, code=code), f'isolation = "{isolation}"')
    assert hosted.step(0)[0][0] == 2.0  # INITIALISATION
    assert hosted.step(1)[0][0] == 3.0  # STEP_MODE


def fly(hosted, steps: int) -> None:
    for k in range(steps):
        hosted.step(k)


# --- those that fail ----------------------------------------------------------------------------------

WHEN = "#define STEP(m, t, h) (t > 0.0025 ? ({}) : OK)"
LEAK = "static void *volatile kept; static status_t leak(void) { kept = malloc(1 << 24); "
FAULTS = {
    "crash": (WHEN.format("raise(SIGSEGV), OK"), "", r"process died in fmi.DoStep: signal SIGSEGV"),
    "abort": (WHEN.format("abort(), OK"), "", r"process died in fmi.DoStep: signal SIGABRT"),
    "exit": (WHEN.format("_exit(7), OK"), "", r"process died in fmi.DoStep: exit status 7"),
    "hang": (WHEN.format("sleep(1000), OK"), "timeout = 0.2", r"no answer within 0\.2 s in fmi.DoStep"),
    "discard": (WHEN.format("DISCARD"), "", r"fmi.DoStep returned Discard"),
    "error": (
        WHEN.format('complain(m, "out of range by %d", 7)'),
        "",
        r"fmi.DoStep returned Error\nIts last lines:\n  \| \[Error\] out of range by 7",
    ),
    "nan": (WHEN.format("m->v[6] = NAN, OK"), "", r"output torque\.x: expected a finite number; got nan"),
    "leak": (
        LEAK + "memset(kept, 1, 1 << 24); return OK; }\n#define STEP(m, t, h) leak()",
        "memory = 1e8",
        r"died in fmi.DoStep: signal SIGSEGV.*; it had taken \d+ MB of the 100 MB that fmu\.memory allows",
    ),
    "leak, noticed": (
        LEAK + "return kept ? (memset(kept, 1, 1 << 24), OK) : ERROR; }\n#define STEP(m, t, h) leak()",
        "memory = 1e8",
        "fmi.DoStep returned Error",
    ),
    "children": (WHEN.format('system("sleep 1000 &"), raise(SIGSEGV), OK'), "", "signal SIGSEGV"),
    "chatter": (
        WHEN.format(
            'system("yes | head -c 300000"), puts("the last words"), fflush(stdout), raise(SIGSEGV), OK'
        ),
        "",
        r"\| the last words$",
    ),
}


@both
@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_is_one_error_that_says_where(host, fmi, fault):
    code, toml, expected = FAULTS[fault]
    foreign = replace(
        DRAG, fmi=fmi, code=DRAG.code + "\n" + code, variables=(*DRAG.variables, *vector("torque", "output"))
    )
    hosted = host(foreign, toml)
    with pytest.raises(SimulationError, match=expected) as error:
        fly(hosted, 30)
    assert "foreign0.fmu: step " in str(error.value)
    if not fault.startswith("leak"):
        assert "step 4 (t = 0.004 s)" in str(error.value)


STARTS = {
    "refuses": ("#define INSTANTIATE(m) return NULL", r"fmi.Instantiate\w* returned no instance"),
    "crashes": (
        "#define INSTANTIATE(m) raise(SIGSEGV)",
        r"process died in fmi.Instantiate\w*: signal SIGSEGV",
    ),
    "hangs": ("#define INSTANTIATE(m) sleep(1000)", r"no answer within 1 s in fmi.Instantiate"),
    "constructor": (
        "__attribute__((constructor)) static void begin(void) { raise(SIGSEGV); }",
        r"process died in dlopen: signal SIGSEGV",
    ),
    "missing library": (
        "extern void nowhere(void);\n#define INSTANTIATE(m) nowhere()",
        "undefined symbol|lazy|nowhere",
    ),
}


@both
@pytest.mark.parametrize("start", STARTS)
def test_a_start_that_fails(host, fmi, start):
    code, expected = STARTS[start]
    with pytest.raises(SimulationError, match=expected):
        host(
            replace(DRAG, fmi=fmi, code=DRAG.code + "\n" + code),
            "start_timeout = 1.0" if start == "hangs" else "",
        )


@both
@pytest.mark.parametrize("end", ["raise(SIGSEGV)", "sleep(1000)"])
def test_an_end_that_fails_takes_nothing_along(host, fmi, end, monkeypatch):
    monkeypatch.setattr("linkwind.fmi.host.process._CLOSE_TIMEOUT", 0.2)
    hosted = host(replace(DRAG, fmi=fmi, code=f"{DRAG.code}\n#define FREE(m) {end}"))
    hosted.step(0)
    hosted.model.close()


@isolations
def test_errors_of_a_trusted_fmu(host, isolation):
    hosted = host(replace(DRAG, code=DRAG.code + "\n" + FAULTS["error"][0]), f'isolation = "{isolation}"')
    with pytest.raises(
        SimulationError, match=r"step 4 .*fmi2DoStep returned Error\nIts last lines:\n.*out of range by 7"
    ):
        fly(hosted, 9)


def test_the_worker_knows_no_bus(host, monkeypatch):
    """Its environment, its descriptors, its modules: nothing leads to the bus."""
    monkeypatch.setenv("ZENOH_CONFIG", "secret")
    hosted = host(DRAG)
    part = hosted.model._instances._parts[0]
    proc = Path(f"/proc/{part.worker.pid}")
    assert b"ZENOH" not in (proc / "environ").read_bytes()
    assert "zenoh" not in (proc / "maps").read_text()
    targets = [str(entry.readlink()) for entry in (proc / "fd").iterdir()]
    assert sum(target.startswith("socket:") for target in targets) == 1


def test_a_host_that_is_killed_takes_its_worker_along(tmp_path):
    file = fmu(tmp_path, DRAG)
    code = (
        "import sys, os, signal\nfrom pathlib import Path\nfrom tests.fmi_host.conftest import Host\n"
        f"h = Host(Path({str(file)!r}), '', ('wing',), '')\n"
        "print(h.model._instances._parts[0].worker.pid, flush=True)\nos.kill(os.getpid(), signal.SIGKILL)\n"
    )
    environment = os.environ | {"TMPDIR": str(tmp_path)}
    command = [sys.executable, "-c", code]
    done = subprocess.run(
        command, capture_output=True, text=True, env=environment, cwd=Path(__file__).parents[2]
    )
    worker = Path(f"/proc/{int(done.stdout)}/stat")
    deadline = time.monotonic() + 5.0
    while not dead(worker):
        assert time.monotonic() < deadline, "the worker lives on"


def dead(stat: Path) -> bool:
    """Whether a process has ended; its new parent may have yet to reap it."""
    try:
        return stat.read_text().rsplit(")", 1)[1].split()[0] == "Z"
    except OSError:
        return True
