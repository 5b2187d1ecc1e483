"""When an FMU steps: its own step, events, early returns; Model Exchange integrated by the host."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from linkwind.errors import InputError, SimulationError
from linkwind.fmi.host import description
from linkwind.fmi.host.planning import own_step_ns, stepping
from linkwind.scenario.providers import FmuModel
from tests.fmi_host.foreign import Foreign, Variable, fmu

COUNT = Foreign(
    (Variable("vx", "input"), Variable("Fx", "output"), Variable("Fy", "output")),
    code="#define OUTPUTS(m) (m->v[1] = m->calls, m->v[2] = m->t)\n#define STEP(m, t, h) (m->calls++, OK)",
)


@pytest.fixture
def host(host):
    """Without a process, unless a test asks for one: what is tested here is the same in both."""

    def start(foreign, toml="", **more):
        return host(foreign, toml if "isolation" in toml else f'isolation = "inprocess"\n{toml}', **more)

    return start


both = pytest.mark.parametrize("fmi", [2, 3])
isolations = pytest.mark.parametrize("isolation", ["process", "inprocess"])


@both
def test_times_meet_without_round_off(host, fmi):
    """foreign.c compares the time that it reached with the one of the next step, to the last bit."""
    hosted = host(replace(COUNT, fmi=fmi), coupling="[coupling]\nstep = 1e-4")
    for k in range(2000):
        force, _ = hosted.step(k)
        assert force[0] == k
        assert force[1] == k * 100_000 / 1e9


@both
def test_sub_cycling(host, fmi):
    hosted = host(replace(COUNT, fmi=fmi), "step = 2.5e-4")
    assert hosted.model.capabilities.own_step_ns == 250_000
    assert [hosted.step(k)[0][0] for k in range(4)] == [0.0, 4.0, 8.0, 12.0]


@both
def test_holding(host, fmi):
    hosted = host(replace(COUNT, fmi=fmi), "step = 3e-3")
    assert [hosted.step(k)[0][0] for k in range(8)] == [0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 2.0, 2.0]


def test_holding_survives_going_back(host):
    attributes = COUNT.attributes + ' canGetAndSetFMUstate="true" canSerializeFMUstate="true"'
    hosted = host(replace(COUNT, attributes=attributes), "step = 2e-3")
    seen = []
    for k in range(7):
        if k:
            hosted.model.commit((k - 1) / 1000, hosted.motion)
            blob = hosted.model.save()
            hosted.at(k)
            hosted.model.restore(blob)
        seen.append(hosted.at(k)[0][0])
        assert hosted.at(k)[0][0] == seen[-1]
    assert seen == [0.0, 0.0, 1.0, 1.0, 2.0, 2.0, 3.0]


FIXED = replace(
    COUNT,
    attributes="",
    experiment='<DefaultExperiment stepSize="0.002"/>',
    code=COUNT.code + "\n#define FIXED_STEP 0.002",
)


@both
def test_an_fmu_of_one_step_gets_exactly_that_step(host, fmi):
    hosted = host(replace(FIXED, fmi=fmi))
    assert [hosted.step(k)[0][0] for k in range(5)] == [0.0, 0.0, 1.0, 1.0, 2.0]
    with pytest.raises(InputError, match=r"a part or a multiple of coupling\.step = 0\.005 s; got 0\.002 s"):
        host(replace(FIXED, fmi=fmi), "step = 0.002", coupling="[coupling]\nstep = 0.005")


def test_fmi3_fixed_internal_step(host):
    attributes = 'fixedInternalStepSize="0.0005"'
    foreign = replace(COUNT, fmi=3, attributes=attributes, code=COUNT.code + "\n#define FIXED_STEP 0.0005")
    assert [host(foreign).step(k)[0][0] for k in range(1)] == [0.0]
    hosted = host(foreign)
    assert [hosted.step(k)[0][0] for k in range(3)] == [0.0, 2.0, 4.0]


def test_stepping_in_words(tmp_path):
    read = description.read(fmu(tmp_path, FIXED))
    assert "every 2 communication steps, outputs held" in stepping(read, FmuModel(), 1_000_000)
    assert "4 steps of 0.0005 s in each" in stepping(read, FmuModel(step=5e-4), 2_000_000)
    assert "one step in each" in stepping(read, FmuModel(), 2_000_000)
    assert own_step_ns(read, FmuModel(step=1 / 3000), 1_000_000 // 3) == 333_333


@isolations
def test_early_return_is_gone_on_from(host, isolation):
    """Half a step at a time; the time that is reported without early return (-1) is not believed."""
    code = (
        COUNT.code.replace("m->calls++, OK", "m->x[3]++, OK").replace("= m->calls", "= m->x[3]")
        + "\n#define EARLY"
    )
    hosted = host(replace(COUNT, fmi=3, code=code), f'isolation = "{isolation}"')
    assert [hosted.step(k)[0][0] for k in range(4)] == [0.0, 2.0, 4.0, 6.0]


def test_an_early_return_without_end(host):
    code = COUNT.code + "\n#define STUCK"
    hosted = host(replace(COUNT, fmi=3, code=code))
    hosted.step(0)
    with pytest.raises(SimulationError, match=r"fmi3DoStep returned early 1000 times before 0\.001 s"):
        hosted.step(1)


def test_event_mode_of_co_simulation(host):
    """An event at 2.25 ms ends a step early; event mode counts it, and the rest of the step follows."""
    code = "#define EVENT_AT 0.00225\n#define EVENT(m) (m->calls++)\n#define OUTPUTS(m) (m->v[1] = m->calls)"
    attributes = COUNT.attributes + ' hasEventMode="true" mightReturnEarlyFromDoStep="true"'
    hosted = host(replace(COUNT, fmi=3, code=code, attributes=attributes))
    assert [hosted.step(k)[0][0] for k in range(5)] == [0.0, 1.0, 1.0, 2.0, 2.0]


def test_event_mode_that_the_fmu_claims_to_have_and_refuses(host):
    attributes = COUNT.attributes + ' hasEventMode="true"'
    hosted = host(replace(COUNT, fmi=3, code=COUNT.code + "\n#define NO_EVENT_MODE", attributes=attributes))
    assert [hosted.step(k)[0][0] for k in range(3)] == [0.0, 1.0, 2.0]


# --- Model Exchange -----------------------------------------------------------------------------------

# A pendulum of the input: x'' = -400 x + 100 vx, force = x.
OSCILLATOR = Foreign(
    (Variable("vx", "input"), Variable("Fx", "output")),
    interfaces=("ModelExchange",),
    states=2,
    code="#define DERIVATIVES(m) (m->dx[0] = m->x[1], m->dx[1] = -400.0 * m->x[0] + 100.0 * m->v[0])\n"
    "#define OUTPUTS(m) (m->v[1] = m->x[0])",
)


def flown(host, foreign, step: str, end: float = 0.1):
    """The force at ``end`` under an input that grows linearly."""
    hosted = host(foreign, coupling=f"[coupling]\nstep = {step}")
    steps = round(end / hosted.h)
    for k in range(steps + 1):
        if k:
            hosted.model.commit((k - 1) * hosted.h, hosted.motion)
        hosted.motion.linear[0, 0] = k * hosted.h
        force = hosted.at(k)[0][0]
    return force


@both
def test_model_exchange_has_order_four(host, fmi):
    foreign = replace(OSCILLATOR, fmi=fmi)
    exact = 0.25 * (0.1 - math.sin(20.0 * 0.1) / 20.0)
    errors = [abs(flown(host, foreign, step) - exact) for step in ("5e-3", "2.5e-3")]
    assert math.log2(errors[0] / errors[1]) == pytest.approx(4.0, abs=0.2)


@both
def test_model_exchange_without_states_is_the_force_of_the_motion(host, fmi):
    foreign = replace(OSCILLATOR, fmi=fmi, states=0, code="#define OUTPUTS(m) (m->v[1] = -3.0 * m->v[0])")
    hosted = host(foreign)
    for k in range(4):
        hosted.motion.linear[0, 0] = 0.1 * k
        assert hosted.step(k)[0][0] == -3.0 * (0.1 * k)


@both
@isolations
def test_model_exchange_goes_back(host, fmi, isolation):
    attributes = 'canGetAndSetFMUstate="true" canSerializeFMUstate="true"'
    hosted = host(replace(OSCILLATOR, fmi=fmi, attributes=attributes), f'isolation = "{isolation}"')
    hosted.motion.linear[0, 0] = 1.0
    for k in range(5):
        hosted.step(k)
    hosted.model.commit(4 * hosted.h, hosted.motion)
    blob = hosted.model.save()
    first = hosted.at(5)[0][0]
    hosted.motion.linear[0, 0] = -1.0
    hosted.model.restore(blob)
    assert hosted.at(5)[0][0] != first
    hosted.motion.linear[0, 0] = 1.0
    hosted.model.restore(blob)
    hosted.model.commit(4 * hosted.h, hosted.motion)
    assert hosted.at(5)[0][0] == first
    hosted.motion.linear[0, 0] = -1.0
    assert hosted.at(5)[0][0] != first
    hosted.motion.linear[0, 0] = 1.0
    assert hosted.at(5)[0][0] == first


@both
def test_time_events_are_met_exactly(host, fmi):
    """A force that switches on at 2.5 ms, integrated: the impulse at 4 ms is 1.5 ms to round-off."""
    code = (
        "#define DERIVATIVES(m) (m->dx[0] = m->x[2])\n#define OUTPUTS(m) (m->v[1] = m->x[0])\n"
        "#define EVENT(m) do { if (m->t >= 0.0025) m->x[2] = 1.0; } while (0); "
        "if (m->t < 0.0025) { m->next_event = 0.0025; return; }"
    )
    hosted = host(replace(OSCILLATOR, fmi=fmi, states=1, code=code))
    forces = [hosted.step(k)[0][0] for k in range(5)]
    assert forces == pytest.approx([0.0, 0.0, 0.0, 0.0005, 0.0015], abs=1e-15)


@both
def test_state_events_are_noticed_at_the_end_of_the_step(host, fmi):
    code = (
        "#define DERIVATIVES(m) (m->dx[0] = 1.0)\n#define INDICATORS(m) (m->z[0] = m->x[0] - 0.0025)\n"
        "#define EVENT(m) (m->calls++)\n#define OUTPUTS(m) (m->v[1] = m->calls)"
    )
    hosted = host(replace(OSCILLATOR, fmi=fmi, states=1, indicators=1, code=code))
    assert [hosted.step(k)[0][0] for k in range(5)] == [0.0, 1.0, 1.0, 2.0, 2.0]


@both
def test_discrete_inputs_are_set_at_events_and_held(host, fmi):
    """An integral of a force that jumps at each communication point."""
    foreign = Foreign(
        (Variable("vx", "input", discrete=True), Variable("Fx", "output")),
        fmi=fmi,
        interfaces=("ModelExchange",),
        attributes='canGetAndSetFMUstate="true"',
        states=1,
        code="#define DISCRETE_INPUTS\n#define DERIVATIVES(m) (m->dx[0] = m->v[0])\n"
        "#define OUTPUTS(m) (m->v[1] = m->x[0])",
    )
    hosted = host(foreign)
    forces = []
    for k in range(4):
        hosted.motion.linear[0, 0] = 1000.0 * k
        forces.append(hosted.step(k)[0][0])
        hosted.motion.linear[0, 0] = -5.0
        hosted.at(k)
        hosted.motion.linear[0, 0] = 1000.0 * k
        assert hosted.at(k)[0][0] == forces[-1]
    assert forces == pytest.approx([0.0, 1.0, 3.0, 6.0], rel=1e-14)


def test_the_interface_asked_for(host):
    foreign = replace(OSCILLATOR, interfaces=("ModelExchange", "CoSimulation"))
    assert host(foreign, 'interface = "me"').step(0)[0][0] == 0.0
    with pytest.raises(InputError, match=r"fmu\.interface: expected me; got cs"):
        host(OSCILLATOR, 'interface = "cs"')


def test_a_time_that_goes_backwards(host):
    hosted = host(COUNT)
    hosted.step(0)
    hosted.step(1)
    with pytest.raises(SimulationError, match=r"expected a time after 0\.001 s; got 0 s"):
        hosted.at(0)
