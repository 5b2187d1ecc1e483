"""The matrix G of a hosted FMU is minus the derivative of its wrench by the twist at the end of the step."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from linkwind.errors import InputError
from linkwind.fmi.export import export
from linkwind.scenario import load
from tests.fmi_host.foreign import Foreign, Variable, vector

ABILITIES = (
    'canHandleVariableCommunicationStepSize="true" canGetAndSetFMUstate="true" canSerializeFMUstate="true" '
    'providesDirectionalDerivative="true"'
)
both = pytest.mark.parametrize("fmi", [2, 3])
isolations = pytest.mark.parametrize("isolation", ["process", "inprocess"])
# Forces and torques that are quadratic in all inputs, none like another.
MIXED = (
    "#define OUTPUTS(m) do { for (int o = 0; o < {outputs}; o++) {{ double s = 0; "
    "for (int i = 0; i < {inputs}; i++) s -= (1.0 + 0.3 * ((3 * o + 5 * i) % 7)) * m->v[i] * "
    "(1.0 + 0.2 * m->v[(i + o) % {inputs}]); m->v[{inputs} + o] = s; }} } while (0)"
)


def mixed(inputs: list[Variable], outputs: list[Variable], **more) -> Foreign:
    rooms = {"inputs": sum(v.room for v in inputs), "outputs": sum(v.room for v in outputs)}
    code = MIXED
    for name, room in rooms.items():
        code = code.replace(f"{{{name}}}", str(room))
    code = code.replace("{{", "{").replace("}}", "}")
    return Foreign((*inputs, *outputs), attributes=ABILITIES, code=code, **more)


def respond(hosted, k: int = 2):
    """Fly to step k, and return G at a motion of no symmetry, as (6n, 6n)."""
    n = len(hosted.motion)
    hosted.motion.position[:] = np.arange(3.0 * n).reshape(n, 3) / 7.0
    hosted.motion.orientation[:] = [np.array([0.8, 0.2 * (b + 1), -0.3, 0.4]) for b in range(n)]
    hosted.motion.orientation /= np.linalg.norm(hosted.motion.orientation, axis=1)[:, None]
    for step in range(k):
        hosted.motion.linear[:] = 0.3 * step + np.arange(3.0 * n).reshape(n, 3) / 5.0
        hosted.motion.angular[:] = 0.1 * step - np.arange(3.0 * n).reshape(n, 3) / 9.0
        hosted.step(step)
    hosted.model.commit((k - 1) * hosted.h, hosted.motion)
    hosted.motion.linear += 0.01
    hosted.motion.angular -= 0.02
    hosted.at(k)
    got = hosted.wrench.response
    if got.shape == (6 * n, 6 * n):
        return got.copy()
    whole = np.zeros((6 * n, 6 * n))
    for b in range(n):
        whole[6 * b : 6 * b + 6, 6 * b : 6 * b + 6] = got[b]
    return whole


def differences(hosted, k: int = 2):
    """The same by evaluating the model at other twists: all of it is quadratic in a twist, or nearly so."""
    n, change = len(hosted.motion), 1e-4
    columns = []
    for b in range(n):
        for part in (hosted.motion.linear, hosted.motion.angular):
            for axis in range(3):
                sides = []
                for sign in (1.0, -1.0):
                    before = part[b, axis]
                    part[b, axis] = before + sign * change
                    hosted.at(k)
                    part[b, axis] = before
                    sides.append(np.hstack([hosted.wrench.force, hosted.wrench.torque]).ravel())
                columns.append((sides[1] - sides[0]) / (2.0 * change))
    return np.array(columns).T


SHAPES = {
    "world": (vector("vel", "input") + vector("omega", "input"), vector("F", "output"), ""),
    "units": (vector("vel", "input", "km/h"), vector("F", "output", "kN"), ""),
    "body frame": (
        vector("relativeVelocity", "input") + vector("w", "input"),
        vector("fluidDynamicForce", "output") + vector("fluidDynamicMoment", "output"),
        "",
    ),
    "at a point": (vector("vel", "input"), vector("F", "output"), 'point = [0.3, -0.2, 0.1]\nframe = "body"'),
    "point of application": (
        vector("pos", "input") + vector("vel", "input"),
        vector("F", "output") + vector("point", "output"),
        "",
    ),
    "accelerations": (
        vector("acc", "input") + vector("alpha", "input"),
        vector("F", "output"),
        "point = [0.0, 0.4, 0.2]",
    ),
    "table": (
        [Variable("up", "input"), Variable("turn", "input")],
        [Variable("lift", "output")],
        '[aero.fmu.variables]\nup = { quantity = "velocity.y", frame = "body", scale = -2.0, offset = 3.0 }\n'
        'turn = { quantity = "angular_velocity.z", unit = "rpm" }\n'
        'lift = { quantity = "force.y", frame = "body", point = [0.1, 0.0, 0.2], scale = -0.5 }',
    ),
}


@both
@pytest.mark.parametrize("shape", SHAPES)
def test_g_is_the_derivative_of_the_wrench(host, fmi, shape):
    inputs, outputs, toml = SHAPES[shape]
    hosted = host(mixed(inputs, outputs, fmi=fmi), toml)
    got = respond(hosted)
    expected = differences(hosted)
    assert np.abs(expected).max() > 0.1
    assert got == pytest.approx(expected, rel=1e-6, abs=1e-7 * np.abs(expected).max())


@both
@isolations
def test_an_instance_each_body_and_one_for_all(host, fmi, isolation):
    each = mixed(vector("vel", "input"), vector("F", "output"), fmi=fmi)
    names = ("left", "right")
    inputs = [v for name in names for v in vector(f"{name}.vel", "input")]
    outputs = [v for name in names for v in vector(f"{name}.F", "output")]
    for foreign, coupled in ((each, False), (mixed(inputs, outputs, fmi=fmi), True)):
        hosted = host(foreign, f'isolation = "{isolation}"', bodies=names)
        got = respond(hosted)
        assert (hosted.wrench.response.ndim == 2) is coupled
        assert got == pytest.approx(differences(hosted), rel=1e-6, abs=1e-6)
        assert got[:6, 6:].any() is np.bool_(coupled)


def test_native_arrays_and_model_exchange(host):
    inputs, outputs = [Variable("v", "input", (3,))], [Variable("F", "output", (3,))]
    hosted = host(mixed(inputs, outputs, fmi=3, interfaces=("ModelExchange",)))
    assert respond(hosted) == pytest.approx(differences(hosted), rel=1e-6, abs=1e-6)


def test_no_response_while_the_outputs_are_held(host):
    hosted = host(mixed(vector("vel", "input"), vector("F", "output")), "step = 3e-3")
    assert not respond(hosted, 2).any()
    assert respond(host(mixed(vector("vel", "input"), vector("F", "output")), "step = 3e-3"), 3).any()


WRONG = {
    "wrong": ("#define SLANT 1.05", "differ from what a step does by 5 %"),
    "none": ("#define NO_DERIVATIVES", "cannot be had"),
}


@both
@isolations
@pytest.mark.parametrize("kind", WRONG)
def test_derivatives_that_are_wrong_are_not_used(host, fmi, isolation, kind, caplog):
    """The run goes on as if there were none, with one warning."""
    code, expected = WRONG[kind]
    right = mixed(vector("vel", "input"), vector("F", "output"), fmi=fmi)
    hosted = host(replace(right, code=f"{right.code}\n{code}"), f'isolation = "{isolation}"')
    other = host(replace(right, attributes=" ".join(ABILITIES.split()[:3])))
    assert other.model.capabilities.response_size == 0
    for k in range(4):
        for each in (hosted, other):
            each.motion.linear[0] = (0.1 * k, 0.2, -0.3 * k)
        assert hosted.step(k)[0].tolist() == other.step(k)[0].tolist()
        assert not hosted.wrench.response.any()
    warnings = [record.getMessage() for record in caplog.records if record.levelname == "WARNING"]
    assert len(warnings) == 1
    assert expected in warnings[0]


def test_when_derivatives_are_asked_for(host, tmp_path):
    """By default where they can be checked; not of linkwind's own FMUs; never where nothing depends on it."""
    foreign = mixed(vector("vel", "input"), vector("F", "output"))
    stateless = replace(
        foreign, attributes='providesDirectionalDerivative="true"' + " " + ABILITIES.split()[0]
    )
    for each, toml, size in (
        (foreign, "", 36),
        (foreign, "derivatives = false", 0),
        (stateless, "", 0),
        (stateless, "derivatives = true", 36),
        (mixed(vector("pos", "input"), vector("F", "output")), "", 0),
    ):
        assert host(each, toml).model.capabilities.response_size == size
    with pytest.raises(InputError, match=r"fmu\.derivatives: expected an FMU with directional derivatives"):
        host(replace(foreign, attributes=ABILITIES.split()[0]), "derivatives = true")
    plate = export(load("two_link"), tmp_path / "plate.fmu", part="aero").file
    assert host(plate, bodies=("link1", "link2")).model.capabilities.response_size == 0
    hosted = host(plate, "derivatives = true", bodies=("link1", "link2"))
    assert respond(hosted) == pytest.approx(differences(hosted), rel=1e-5, abs=1e-5)
