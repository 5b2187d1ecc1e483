"""Variables by name and by table: the right numbers arrive in the right units, frames and places."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from linkwind.errors import InputError
from linkwind.fmi.host import description, listing, mapping
from linkwind.fmi.host.transfer import Inputs, Outputs, rotation
from linkwind.scenario.providers import FmuModel, FmuVariable
from linkwind.spatial import Motion, Wrench
from tests.fmi_host.foreign import Foreign, Variable, fmu, vector

AXES = "xyz"


def scalars(causality: str, *names: str) -> list[Variable]:
    return [Variable(name, causality) for name in names]


def resolve(tmp_path, declared, bodies=("wing",), **settings):
    read = description.read(fmu(tmp_path, Foreign(tuple(declared), code="#define OUTPUTS(m)")))
    return mapping.resolve(read, FmuModel(**settings), bodies)


def moving(n: int = 1) -> Motion:
    """A motion with no number twice, turned by 90 degrees about z: the body's x axis is the world's y."""
    motion = Motion.at_rest(n)
    motion.position[:] = np.arange(1.0, 3 * n + 1).reshape(n, 3)
    motion.linear[:] = np.arange(10.0, 3 * n + 10).reshape(n, 3)
    motion.angular[:] = np.arange(0.1, 3 * n, 1.0).reshape(n, 3)
    motion.orientation[:] = (math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5))
    return motion


def wind(t: float, position: np.ndarray) -> np.ndarray:
    return np.array([-5.0 + t, 1.0, position[2]])


def given(found, motion, t=0.0, n=1):
    """What the first instance is given, by name."""
    inputs = Inputs(found, range(n), n, wind, 1.3)
    out = np.zeros((n if found.per_body else 1, len(found.inputs)))
    inputs.fill(t, motion, out)
    return dict(zip((link.element for link in found.inputs), out[0], strict=True))


def wrench(found, values, motion, n=1):
    """The wrench of output values by name."""
    row = [values[link.element] for link in found.outputs]
    result = Wrench.zeros(n)
    Outputs(found, range(n)).wrench(np.array([row]), motion, result)
    return result


SHAPES = {
    "linkwind": ([f"wing.{q}[{i}]" for q in ("r", "v", "w") for i in (1, 2, 3)], "wing.F[1] wing.T[3]"),
    "chrono": (
        [f"wheel_state.{q}.{a}" for q in ("pos", "lin_vel", "ang_vel") for a in AXES],
        "wheel_load.force.x wheel_load.moment.z",
    ),
    "letters": ([f"{q}{a}" for q in "rvw" for a in AXES], "Fx Mz"),
    "words": (
        [f"{q}_{a}" for q in ("position", "velocity", "angular_velocity") for a in AXES],
        "force_x torque_z",
    ),
    "camel case": (
        [f"{q}_{a}" for q in ("position", "linearVelocity", "angularVelocity") for a in AXES],
        "forceX momentZ",
    ),
}


@pytest.mark.parametrize("shape", SHAPES)
def test_usual_shapes_need_no_table(tmp_path, shape):
    names, outputs = SHAPES[shape]
    found = resolve(tmp_path, [*scalars("input", *names), *scalars("output", *outputs.split())])
    motion = moving()
    expected = [*motion.position[0], *motion.linear[0], *motion.angular[0]]
    assert list(given(found, motion).values()) == expected
    force, torque = outputs.split()
    result = wrench(found, {force: 3.0, torque: -7.0}, motion)
    assert result.force.tolist() == [[3.0, 0.0, 0.0]]
    assert result.torque.tolist() == [[0.0, 0.0, -7.0]]


def test_quaternions_by_index_letter_and_euler_parameter(tmp_path):
    for names in (
        [f"wing.orientation[{i}]" for i in (1, 2, 3, 4)],
        [f"rot.e{i}" for i in range(4)],
        [f"q.{a}" for a in "wxyz"],
    ):
        found = resolve(tmp_path, [*scalars("input", *names), *scalars("output", "Fx")])
        assert list(given(found, moving()).values()) == moving().orientation[0].tolist()


def test_modelica_adaptors(tmp_path):
    found = resolve(tmp_path, scalars("input", "s", "v", "a") + scalars("output", "f"))
    motion = moving()
    assert given(found, motion) == {"s": 1.0, "v": 10.0, "a": 0.0}
    assert wrench(found, {"f": 2.0}, motion).force.tolist() == [[2.0, 0.0, 0.0]]
    found = resolve(tmp_path, scalars("input", "phi", "w", "a") + scalars("output", "tau"))
    values = given(found, motion)
    assert values == {"phi": pytest.approx(math.pi / 2, rel=1e-15), "w": motion.angular[0, 2], "a": 0.0}
    assert [link.quantity for link in found.inputs] == ["angle", "angular_velocity", "angular_acceleration"]
    assert wrench(found, {"tau": 2.0}, motion).torque.tolist() == [[0.0, 0.0, 2.0]]


def test_gazebo_bodies_speak_in_the_body_frame(tmp_path):
    variables = [Variable(f"relativeVelocity_{a}", "input") for a in AXES]
    variables += [Variable(f"fluidDynamic{q}_{a}", "output") for q in ("Force", "Moment") for a in AXES]
    found = resolve(tmp_path, variables)
    motion = moving()
    relative = motion.linear[0] - wind(0.5, motion.position[0])
    turned = [relative[1], -relative[0], relative[2]]  # 90 degrees about z, backwards
    assert list(given(found, motion, 0.5).values()) == pytest.approx(turned, rel=1e-14)
    values = {v.name: float(i) for i, v in enumerate(variables[3:], 1)}
    result = wrench(found, values, motion)
    assert result.force[0] == pytest.approx([-2.0, 1.0, 3.0], rel=1e-14)
    assert result.torque[0] == pytest.approx([-5.0, 4.0, 6.0], rel=1e-14)


def test_chrono_point_of_application(tmp_path):
    variables = [*vector("wheel_load.force", "output"), *vector("wheel_load.point", "output")]
    found = resolve(tmp_path, variables)
    motion = moving()
    point, force = np.array([4.0, -1.0, 2.0]), np.array([1.0, 2.0, -3.0])
    values = {v.name: x for v, x in zip(variables, (*force, *point), strict=True)}
    result = wrench(found, values, motion)
    assert result.torque[0] == pytest.approx(np.cross(point - motion.position[0], force), rel=1e-14)


def test_another_point_and_frame_by_table(tmp_path):
    """The motion and the force of a point of the body keep the power: F·v at the point = wrench · twist."""
    point = (0.3, -0.2, 0.1)
    names = {f"u{a}": FmuVariable(quantity=f"velocity.{a}", frame="body", point=point) for a in AXES}
    names |= {f"y{a}": FmuVariable(quantity=f"force.{a}", frame="body", point=point) for a in AXES}
    variables = scalars("input", "ux", "uy", "uz") + scalars("output", "yx", "yy", "yz")
    found = resolve(tmp_path, variables, variables=names)
    motion = moving()
    velocity = np.array(list(given(found, motion).values()))
    force = np.array([1.5, -2.5, 3.5])
    result = wrench(found, dict(zip(("yx", "yy", "yz"), force, strict=True)), motion)
    power = result.force[0] @ motion.linear[0] + result.torque[0] @ motion.angular[0]
    assert force @ velocity == pytest.approx(power, rel=1e-13)
    assert np.linalg.norm(result.force) == pytest.approx(np.linalg.norm(force), rel=1e-14)
    assert result.force[0] == pytest.approx([2.5, 1.5, 3.5], rel=1e-14)  # x of the body is y of the world


def test_units_of_the_fmu_scale_and_offset(tmp_path):
    variables = [Variable("vx", "input", unit="km/h"), Variable("vy", "input", unit="km/h")]
    variables += [Variable("Fx", "output", unit="kN"), Variable("Fy", "output", unit="kN")]
    table = {
        "vy": FmuVariable(quantity="velocity.y", scale=-1.0, offset=2.0),
        "Fy": FmuVariable(quantity="force.y", scale=-1.0, offset=5.0),
    }
    found = resolve(tmp_path, variables, variables=table)
    values = given(found, moving())
    assert values["vx"] == pytest.approx(10.0 * 3.6, rel=1e-14)
    assert values["vy"] == pytest.approx((2.0 - 11.0) * 3.6, rel=1e-14)
    result = wrench(found, {"Fx": 0.25, "Fy": 0.25}, moving())
    assert result.force[0] == pytest.approx([250.0, -245.0, 0.0], rel=1e-14)


def test_units_through_a_running_fmu(host):
    code = "#define OUTPUTS(m) (m->v[1] = m->v[0])"
    foreign = Foreign((Variable("vx", "input", unit="km/h"), Variable("Fx", "output", unit="kN")), code=code)
    hosted = host(foreign)
    hosted.motion.linear[0, 0] = 2.0
    assert hosted.step(0)[0][0] == pytest.approx(2.0 * 3.6 * 1000.0, rel=1e-14)


def test_what_is_in_si_passes_bit_for_bit(tmp_path):
    found = resolve(tmp_path, [*vector("vel", "input"), *vector("force", "output", unit="N")])
    motion = moving()
    motion.linear[0] = (0.1 + 0.2, -0.0, 5e-324)
    assert np.array(list(given(found, motion).values())).tobytes() == motion.linear[0].tobytes()


def test_added_inertia_by_name(tmp_path):
    names = [f"wing.A[{i},{j}]" for i in range(1, 7) for j in range(1, 7)]
    found = resolve(tmp_path, scalars("output", "wing.F[1]", *names))
    result = Wrench.zeros(1, added_inertia=True)
    values = np.arange(37.0)[None]
    Outputs(found, [0]).wrench(values, moving(), result)
    assert result.added_inertia[0].ravel().tolist() == list(range(1, 37))


def test_angle_is_unwrapped_from_commit_to_commit(tmp_path):
    found = resolve(tmp_path, scalars("input", "phi") + scalars("output", "tau"))
    inputs = Inputs(found, [0], 1, wind, 1.3)
    out = np.zeros((1, 1))
    motion = Motion.at_rest(1)
    for angle in np.arange(0.0, 40.0, 0.5):
        motion.orientation[0] = (math.cos(angle / 2), 0.0, 0.0, math.sin(angle / 2))
        inputs.fill(angle, motion, out)
        assert out[0, 0] == pytest.approx(angle, abs=1e-12)
        inputs.commit(angle, motion)
    blob = inputs.save()
    fresh = Inputs(found, [0], 1, wind, 1.3)
    fresh.restore(blob)
    fresh.fill(0.0, motion, out)
    assert out[0, 0] == pytest.approx(39.5, abs=1e-12)


def test_acceleration_is_differenced_at_the_point(tmp_path):
    """A body in uniform rotation: the acceleration of a point is centripetal, of the centre none."""
    table = {"ax": FmuVariable(quantity="acceleration.x", point=(2.0, 0.0, 0.0))}
    found = resolve(tmp_path, scalars("input", "ax", "ay") + scalars("output", "Fx"), variables=table)
    inputs = Inputs(found, [0], 1, wind, 1.3)
    motion, out = Motion.at_rest(1), np.zeros((1, 2))
    motion.angular[0, 2], motion.linear[0, 1] = 3.0, 1.0
    inputs.commit(0.0, motion)
    motion.linear[0, 1] = 1.5
    inputs.fill(0.1, motion, out)
    assert out[0] == pytest.approx([-18.0, 5.0], rel=1e-13)


def test_rotation_agrees_with_the_quaternion_product():
    rng = np.random.default_rng(1)
    q = rng.normal(size=4)
    q /= np.linalg.norm(q)
    v = rng.normal(size=3)
    w, u = q[0], q[1:]
    assert rotation(q) @ v == pytest.approx(v + 2.0 * np.cross(u, np.cross(u, v) + w * v), rel=1e-13)


# --- what cannot be mapped ----------------------------------------------------------------------------

REFUSED = {
    "an unknown input": (
        [*scalars("input", "Vinf_x"), *scalars("output", "Fx")],
        {},
        r"input Vinf_x: expected a name that tells.*Nearest: .*\.x.*Write \"Vinf_x\" = ",
    ),
    "an integer input": (
        [Variable("gear", "input", type="Integer"), *scalars("output", "Fx")],
        {},
        r"input gear: expected a value in fmu\.start, because it is no Float64",
    ),
    "the same twice": (
        scalars("output", "Fx", "force_x"),
        {},
        r"output force_x: expected a quantity of its own; got force\.x of the same body as Fx",
    ),
    "no force": (scalars("output", "lift"), {}, r"expected an output with a force or a torque.*lift"),
    "a wrong unit": (
        [Variable("Fx", "output", unit="km/h")],
        {},
        r'output Fx: expected a unit of force \(N, kN\); got unit "km/h"',
    ),
    "an undefined unit": (
        [Variable("Fx", "output", unit="lbf")],
        {},
        r'unit "lbf", which the FMU does not define. If it is right, write unit = "N"',
    ),
    "an entry for nothing": (
        scalars("output", "Fx"),
        {"Fz": FmuVariable(quantity="force.z")},
        r'fmu\.variables: expected inputs and outputs of the FMU; got "Fz"\. Nearest: Fx',
    ),
    "an unknown quantity": (
        scalars("output", "Fx"),
        {"Fx": FmuVariable(quantity="thrust.x")},
        r'fmu\.variables\."Fx": expected \[body\.\]quantity.*force, torque.*got "thrust\.x"',
    ),
    "no component": (
        scalars("output", "Fx"),
        {"Fx": FmuVariable(quantity="force")},
        r'expected one of the components x, y, z; got "force" for 1 value',
    ),
    "a position in the body frame": (
        scalars("input", "rx") + scalars("output", "Fx"),
        {"rx": FmuVariable(quantity="position.x", frame="body")},
        r'"rx"\.frame: expected world; got body',
    ),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_be_mapped_says_why(tmp_path, case):
    variables, table, expected = REFUSED[case]
    with pytest.raises(InputError, match=expected):
        resolve(tmp_path, variables, variables=table)


def test_a_body_without_force_and_a_variable_without_body(tmp_path):
    with pytest.raises(InputError, match="a force or a torque on right"):
        resolve(tmp_path, scalars("output", "left.F[1]"), ("left", "right"))
    with pytest.raises(InputError, match=r"input vx: expected the name of a body in it"):
        resolve(
            tmp_path, scalars("input", "vx") + scalars("output", "left.F[1]", "right.F[1]"), ("left", "right")
        )


def test_ignored_held_and_remapped(tmp_path):
    variables = scalars("input", "vx", "gain") + scalars("output", "Fx", "force_x", "power")
    table = {"force_x": FmuVariable(quantity="none"), "vx": FmuVariable(quantity="wind.x")}
    found = resolve(tmp_path, variables, variables=table, start={"gain": 2.0})
    assert found.held == ("gain",)
    assert found.ignored == ("force_x", "power")
    assert given(found, moving()) == {"vx": -5.0}


def test_the_listing_shows_everything_and_its_table_means_the_same(tmp_path):
    import tomllib

    names = [f"{b}.{q}[{i}]" for b in ("left", "right") for q in ("r", "v") for i in (1, 2, 3)]
    outputs = [f"{b}.F[{i}]" for b in ("left", "right") for i in (1, 2, 3)]
    variables = scalars("input", *names) + scalars("output", *outputs, "power")
    read = description.read(fmu(tmp_path, Foreign(tuple(variables), code="#define OUTPUTS(m)")))
    found = mapping.resolve(read, FmuModel(), ("left", "right"))
    text = listing.text(read, found)
    for part in (
        "left.r[1] … left.r[3]",
        "position x y z of left",
        "force x y z of right",
        "power",
        "not used",
    ):
        assert part in text
    table = tomllib.loads(listing.toml(read, found))["aero"]["fmu"]
    settings = FmuModel(
        sha256=table["sha256"], variables={k: FmuVariable(quantity=v) for k, v in table["variables"].items()}
    )
    again = mapping.resolve(read, settings, ("left", "right"))
    assert [replace(link, by="name") for link in again.inputs] == list(found.inputs)
    assert [replace(link, by="name") for link in again.outputs] == list(found.outputs)
    assert (
        mapping.resolve(
            read, FmuModel(variables=listing.entries(found, FmuModel())), ("left", "right")
        ).inputs
        == again.inputs
    )
