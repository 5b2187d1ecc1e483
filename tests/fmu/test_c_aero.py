"""Force models as FMUs: the service's bits, the field's memory, derivatives."""

from __future__ import annotations

import ctypes

import numpy as np
import pytest

from linkwind.aero.field import field_table, initial_angles
from linkwind.aero.plate import plate_table
from linkwind.native.forces import Field, Plates
from linkwind.scenario import load, loads
from linkwind.spatial import Motion, Wrench
from tests.fmu.c_model import DISCARD, ERROR, Instance, aero, pointer
from tests.fmu.test_c_derivatives import extrapolated

OUTPUTS = ["FORCE", "TORQUE", "ADDED_INERTIA"]
INPUTS = ["POSITION", "ORIENTATION", "LINEAR", "ANGULAR"]
FIELD = """
[time]
end = 1.0
[[bodies]]
name = "a"
mass = 1.0
inertia = 1.0
position = [0.0, 0.0]
angle_deg = 350.0
[[bodies]]
name = "b"
mass = 1.0
inertia = 1.0
position = [1.0, 0.0]
[aero]
model = "field"
[aero.field.a]
fx = "theta"
ty = "exp(x)*sin(3*t)"
[aero.field.b]
fy = "vx*vy - wz"
[coupling]
step = 1e-3
"""


def motions(n: int, count: int):
    random = np.random.default_rng(8)
    for k in range(count):
        angle = 0.3 * k + np.arange(n)
        quaternion = np.stack([np.cos(angle / 2), 0 * angle, 0 * angle, np.sin(angle / 2)], axis=1)
        linear, angular = random.normal(size=(n, 3)) * [3, 3, 0], random.normal(size=(n, 3)) * [0, 0, 2]
        yield Motion(random.normal(size=(n, 3)), quaternion, linear, angular)


def set_motion(fmu: Instance, motion: Motion) -> None:
    for name in INPUTS:
        fmu.set(name, getattr(motion, name.lower()))


GUSTS = (
    "environment.gusts=[{amplitude=[0.5,0.2,0],frequency=2,wavenumber=[0.3,0,0.2]},"
    "{shape='one_minus_cosine',amplitude=[0.5,0.2,0],frequency=2,wavenumber=[0.3,0,0],phase_deg=90}]"
)
POINTS = "[[0,1],[0.01,-2],[0.04,1]]"
TABLE = "[[0,0,0.05,0],[10,0.8,0.1,0],[45,1,1,-0.25],[90,0,1.9,-0.475]]"
WINGS = [
    f'bodies.link{i}.shape={{type="wing",points=[[{i},0],[0.5,1],[-0.2,0.7],[-0.1,-0.3]]}}' for i in (1, 2)
]
WIND = [
    f"environment.wind=['-5*(max(y,0.1)/10)**0.14 + sin(3*t)*z', {{table={POINTS},periodic=true}}, 0.5]",
    "aero.plate.strips=2",
]
STRIPS = ["aero.plate.strips=3", "aero.plate.coefficients=table", f"aero.plate.table={TABLE}"]


@pytest.fixture(scope="module", params=[[], STRIPS, STRIPS + WINGS[:1], WINGS, WIND])
def plate(compiler, request):
    scenario = load("two_link", [GUSTS, *request.param])
    table = plate_table(scenario, scenario.providers[0])
    model = aero(table)
    return table, model, compiler.library(model, 3, f"plate{table.strips}{table.planform.size}")


@pytest.fixture(scope="module")
def field(compiler):
    scenario = loads(FIELD, "field")
    table, theta = (
        field_table(scenario, scenario.providers[0]),
        initial_angles(scenario, scenario.providers[0]),
    )
    model = aero(table, theta)
    return table, theta, model, compiler.library(model, 3, "field")


def test_plate_bit_for_bit(plate):
    table, model, library = plate
    fmu, native, wrench = (
        Instance(library, model).initialize(),
        Plates(table),
        Wrench.zeros(2, added_inertia=True),
    )
    for k, motion in enumerate(motions(2, 50)):
        set_motion(fmu, motion)
        native.evaluate(fmu.get_time(), motion, wrench)
        expected = [wrench.force, wrench.torque, wrench.added_inertia]
        assert fmu.get(*OUTPUTS).tobytes() == np.concatenate([part.ravel() for part in expected]).tobytes()
        fmu.step(k * 0.001, 0.001)
    fmu.free()


def test_an_input_of_the_wind_is_the_constant_of_the_scenario(compiler):
    """What another tool sets between steps: the library's bits with the same number in the scenario."""

    def table(u):
        settings = ["environment.wind=['u*(max(y,0.1)/10)**0.14', 'w*t - u', 3]", "time.end=1.0"]
        scenario = load("two_link", [*settings, f"environment.inputs={{ w = 0.5, u = {u!r} }}"])
        return plate_table(scenario, scenario.providers[0])

    model = aero(table(-5.0))
    fmu = Instance(compiler.library(model, 3, "blown"), model).initialize()
    assert fmu.get("WIND_INPUT").tolist() == [-5.0, 0.5]
    wrench = Wrench.zeros(2)
    for k, motion in enumerate(motions(2, 20)):
        u = -5.0 if k < 5 else 0.3 * k
        set_motion(fmu, motion)
        if k >= 5:
            fmu.set("WIND_INPUT", [u, 0.5])
        Plates(table(u)).evaluate(fmu.get_time(), motion, wrench)
        expected = np.concatenate([wrench.force.ravel(), wrench.torque.ravel()])
        assert fmu.get("FORCE", "TORQUE").tobytes() == expected.tobytes()
        fmu.step(k * 0.001, 0.001)
    by_input = fmu.derivative("Directional", ["FORCE"], ["WIND_INPUT"], [1.0, 0.0])
    lower, upper = Wrench.zeros(2), Wrench.zeros(2)
    for side, out in ((-1e-6, lower), (1e-6, upper)):
        Plates(table(u + side)).evaluate(fmu.get_time(), motion, out)
    difference = (upper.force - lower.force).ravel() / 2e-6
    np.testing.assert_allclose(by_input, difference, rtol=1e-5, atol=1e-5 * abs(difference).max())
    fmu.free()


def test_a_wind_that_is_not_finite_is_told(compiler):
    scenario = load("two_link", ["environment.wind.1=log(x + 0.5)"])
    model = aero(plate_table(scenario, scenario.providers[0]))
    fmu = Instance(compiler.library(model, 3, "blind"), model).initialize()
    fmu.set("POSITION", [1.0, 2.0, 3.0, -1.0, 5.0, 6.0])
    vrs, values = fmu.vrs("FORCE"), np.zeros(6)
    size = ctypes.c_size_t
    assert fmu.call("GetFloat64", pointer(vrs), size(len(vrs)), pointer(values), size(6)) == DISCARD
    expected = "fmi3GetFloat64: Expected a finite wind along y on body 1 but was none at 0 s, (-1, 5, 6) m."
    assert fmu.messages[-1][2] == expected
    fmu.free()


def test_plate_parameters(plate):
    _, model, library = plate
    fmu = Instance(library, model).initialize()
    set_motion(fmu, next(motions(2, 1)))
    added = fmu.get("ADDED_INERTIA")
    fmu.set("DENSITY", 2 * fmu.get("DENSITY"))
    np.testing.assert_allclose(fmu.get("ADDED_INERTIA"), 2 * added, rtol=1e-15)
    fmu.set("LENGTH", 2 * fmu.get("LENGTH"))  # the chord has the second power, and is the arm
    added = 2 * added.reshape(2, 6, 6)
    for row, column in np.ndindex(6, 6):
        turns = (row == 5) + (column == 5)
        added[:, row, column] *= 4.0 * 2.0**turns
    np.testing.assert_allclose(fmu.get("ADDED_INERTIA"), added.ravel(), rtol=1e-14)
    for section, value in (("DENSITY", [-1.0]), ("LENGTH", [0.5, 0.0]), ("SPAN", [-1.0, 1.0])):
        before = fmu.get(section)
        fmu.set(section, value)
        assert fmu.try_step(0.0, 0.1)[0] == ERROR
        assert section in fmu.messages[-1][2]
        fmu.set(section, before)
    fmu.step(0.0, 0.1)


def test_field_follows_the_accepted_motion(field):
    """The heading passes several turns; what was tried and taken back leaves no trace."""
    table, theta, model, library = field
    fmu, native, wrench = Instance(library, model).initialize(), Field(table, theta.copy()), Wrench.zeros(2)
    for k, motion in enumerate(motions(2, 100)):
        before = fmu.get_state()
        set_motion(fmu, next(motions(2, 1)))
        fmu.step(k * 0.001, 0.001)
        fmu.do("SetFMUState", before)
        set_motion(fmu, motion)
        native.evaluate(fmu.get_time(), motion, wrench)
        expected = np.concatenate([wrench.force.ravel(), wrench.torque.ravel()])
        assert fmu.get("FORCE", "TORQUE").tobytes() == expected.tobytes()
        native.commit(motion)
        fmu.step(k * 0.001, 0.001)
    assert abs(native.theta[0]) > 4 * np.pi
    fmu.free()


def test_field_in_model_exchange(field):
    import ctypes

    *_, model, library = field
    fmu = Instance(library, model, exchange=True).initialize()
    fmu.do("EnterContinuousTimeMode")
    flags = (ctypes.c_bool * 2)()
    last = -np.inf
    for motion in motions(2, 60):
        set_motion(fmu, motion)
        theta = fmu.get("FORCE")[0]
        assert 0.29 < theta - last < 0.31 or last == -np.inf
        last = theta
        fmu.do("CompletedIntegratorStep", True, flags, ctypes.byref(flags, 1))
    count = ctypes.c_size_t(99)
    fmu.do("GetNumberOfContinuousStates", ctypes.byref(count))
    assert count.value == 0


def test_field_that_is_not_finite(field):
    *_, model, library = field
    fmu = Instance(library, model).initialize()
    fmu.set("POSITION", np.full(6, 1e4))
    fmu.step(0.0, 0.5)
    vrs, out = fmu.vrs("FORCE"), np.zeros(6)
    import ctypes

    from tests.fmu.c_model import pointer

    assert (
        fmu.call("GetFloat64", pointer(vrs), ctypes.c_size_t(1), pointer(out), ctypes.c_size_t(6)) == DISCARD
    )
    assert "finite wrench on body 0" in fmu.messages[-1][2]


@pytest.mark.parametrize("known", [*INPUTS, "WIND", "DENSITY", "LENGTH"])
def test_plate_derivatives(plate, known):
    _, model, library = plate
    fmu = Instance(library, model).initialize()
    set_motion(fmu, next(motions(2, 1)))
    base, seed = fmu.get(known), np.random.default_rng(2).normal(size=fmu.size(known))

    def moved(distance: float) -> np.ndarray:
        fmu.set(known, base + distance * seed)
        found = fmu.get(*OUTPUTS)
        fmu.set(known, base)
        return found

    expected = extrapolated(moved, 5e-3 if known != "LENGTH" else 1e-3)
    found = fmu.derivative("Directional", OUTPUTS, [known], seed)
    assert np.max(np.abs(found - expected)) < 1e-7 * max(1.0, np.abs(expected).max())
    weights = np.random.default_rng(3).normal(size=found.size)
    gradient = fmu.derivative("Adjoint", OUTPUTS, [known], weights)
    assert gradient @ seed == pytest.approx(weights @ found, rel=1e-8, abs=1e-8)
