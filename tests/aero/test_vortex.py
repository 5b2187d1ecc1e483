"""The model vortex: which edge trails, what it tells of itself, what it refuses, runs with it."""

import hashlib

import numpy as np
import pytest

import linkwind
from linkwind.aero import build
from linkwind.errors import ProtocolError, ScenarioError, SimulationError
from linkwind.scenario import loads
from linkwind.spatial import Motion, Wrench

WING = """
[time]
end = 0.2
[environment]
gravity = [0.0, 0.0, 0.0]
wind = [2.0, 0.1, 0.0]
[[bodies]]
name = "wing"
mass = 0.05
inertia = [0.01, 0.01, 0.004, 0.0, 0.0, 0.0]
shape = { type = "plate", length = 0.4, span = 1.2 }
[coupling]
step = 0.02
[bus]
transport = "inprocess"
[aero]
model = "vortex"
vortex = { chordwise = 3, spanwise = 4, wake = 10 }
"""


def made(*overrides):
    scenario = loads(WING, "wing.toml", overrides)
    return build(scenario, scenario.providers[0])


def ask(model, t, *, linear=(0.0, 0.0, 0.0), angular=(0.0, 0.0, 0.0), angle=0.0):
    motion, wrench = Motion.at_rest(1), Wrench.zeros(1)
    motion.position[0] = np.multiply(t, linear)
    motion.orientation[0] = np.cos(0.5 * angle), 0.0, 0.0, np.sin(0.5 * angle)
    motion.linear[0], motion.angular[0] = linear, angular
    wrench.response, wrench.diagnostics = np.zeros((6, 6)), np.zeros(3)
    model.evaluate(t, motion, wrench)
    return motion, wrench


@pytest.mark.parametrize(
    ("overrides", "angle", "front"),
    [
        ((), 0.0, -1.0),  # the wind goes along +x, and the leading edge is at -x
        ((), np.pi, 1.0),
        (("environment.wind=[-2,0.1,0]",), 0.0, 1.0),
        (('aero.vortex.trailing_edge.wing="-x"',), 0.0, 1.0),
    ],
)
def test_the_downstream_edge_trails_unless_another_is_stated(overrides, angle, front):
    model = made(*overrides)
    ask(model, 0.0, angle=angle)
    leading = model.lattice.table.corner[0, 0, :, 0]
    np.testing.assert_allclose(leading, front * (0.2 - 0.25 * 0.4 / 3), rtol=1e-12)


@pytest.mark.parametrize("wind", [[0, 0, 0], [0, 2, 0]])
def test_without_air_along_the_chord_the_edge_must_be_stated(wind):
    model = made(f"environment.wind={wind}")
    with pytest.raises(
        ScenarioError, match=r"wing\.toml: aero\.vortex\.trailing_edge: expected which edge of "
    ):
        ask(model, 0.0)
    ask(made(f"environment.wind={wind}", 'aero.vortex.trailing_edge.wing="+x"'), 0.0)


def test_it_tells_of_the_angle_of_attack_and_how_fine_the_wake_is():
    """3 m/s along the chord and 0.9 across at the tips, by a turn of 1 rad/s about x: atan(0.9/3) = 16.7°."""
    model = made("environment.wind=[3,0.3,0]")
    motion, wrench = ask(model, 0.0, angular=(1.0, 0.0, 0.0))
    incidence, advance, rows = wrench.diagnostics
    assert incidence == pytest.approx(np.degrees(np.arctan2(0.9, 3.0)))
    assert advance == pytest.approx(np.hypot(3.0, 0.9) * 0.02 * 3 / 0.4)
    assert rows == 0
    model.commit(0.0, motion)
    _, wrench = ask(model, 0.02)
    assert wrench.diagnostics[2] == 1


def test_another_iteration_starts_from_what_was_committed():
    model = made()
    model.commit(0.0, ask(model, 0.0)[0])
    first = ask(model, 0.02, linear=(0.0, 0.3, 0.0))[1]
    ask(model, 0.02, linear=(0.1, -0.3, 0.2))
    again = ask(model, 0.02, linear=(0.0, 0.3, 0.0))[1]
    assert (
        first.force.tobytes() + first.response.tobytes() == again.force.tobytes() + again.response.tobytes()
    )


def test_a_checkpoint_holds_the_wake_and_the_edges():
    model, fresh = made(), made("environment.wind=[-2,0.1,0]")
    model.commit(0.0, ask(model, 0.0)[0])
    model.commit(0.02, ask(model, 0.02, linear=(0.0, 0.3, 0.0))[0])
    blob = model.save()
    fresh.restore(blob)
    assert fresh.save() == blob
    model.restore(blob)
    fresh = made()
    fresh.restore(blob)
    one, other = (ask(each, 0.04, linear=(0.1, 0.2, 0.0))[1] for each in (model, fresh))
    assert one.force.tobytes() == other.force.tobytes()
    for wrong in (b"abc", blob[:-8], b"\0" * 16 + blob[16:]):
        with pytest.raises(ProtocolError, match="model vortex: expected a checkpoint of"):
            fresh.restore(wrong)
    fresh.restore(b"")
    assert fresh.save() == b""


def test_a_force_that_is_none_ends_the_run():
    model = made()
    model.commit(0.0, ask(model, 0.0)[0])
    with pytest.raises(
        SimulationError, match=r'aero\.vortex: expected a finite force on "wing" at t = 0.02 s'
    ):
        ask(model, 0.02, linear=(1e200, 1e200, 0.0))


@pytest.mark.parametrize(
    ("overrides", "line"),
    [
        (
            ['bodies.wing.shape={type="circle",diameter=0.4}'],
            'a plate or a wing, which the model of provider "aero" needs',
        ),
        (
            ['bodies.wing.shape={type="wing",points=[[0,0],[2,0],[2,1],[1,0.4],[0,1]]}'],
            'points: expected one chord at each z, which the model of provider "aero" needs; got more at z = '
            "0.7. Cut it along its chord into bodies on fixed joints.",
        ),
        (["environment.density=0"], "environment.density: expected a number above 0 for the model vortex"),
        (['aero.vortex.trailing_edge.wig="+x"'], 'expected one of its bodies wing; got "wig". Use "wing"'),
        (['aero.vortex.trailing_edge.wing="+y"'], "trailing_edge.wing: expected one of +x, -x"),
        (["aero.vortex.chordwise=0"], "chordwise: expected"),
    ],
)
def test_settings_that_cannot_be(overrides, line):
    with pytest.raises(ScenarioError) as error:
        loads(WING, "wing.toml", overrides)
    assert line in str(error.value)


def fly(folder, *overrides):
    outcome = linkwind.run(loads(WING, "wing.toml", overrides), folder, report=False)
    return linkwind.open_log(outcome.log).trajectory()


RAIL = 'joints=[{name="rail",type="prismatic",parent="world",child="wing",axis=[0,1,0]}]'


@pytest.mark.parametrize("mass", [5.0, 0.05, 1e-9])
def test_a_wing_of_any_mass_goes_with_the_air_across_it(tmp_path, mass):
    """On a rail across a stream it nears the air's 0.1 m/s without overshoot, with no mass of its own too."""
    path = fly(tmp_path / "out", RAIL, f"bodies.wing.mass={mass}", "aero.vortex.wake=40")
    across = path.linear[:, 0, 1]
    assert (np.diff(across) > 0.0).all()
    assert across[-1] < 0.1
    assert (across[-1] > 0.05) == (mass < 1.0)


def test_the_air_that_goes_with_a_plate_across_it_converges_to_its_added_mass():
    """0.83 π/4 ρ a² b for sides of 1 to 3 (DNV-RP-C205); the error falls with the size of the panels."""
    still = ("environment.wind=[0,0,0]", 'aero.vortex.trailing_edge.wing="+x"')
    found = []
    for fine in (1, 2):
        panels = (f"aero.vortex.chordwise={6 * fine}", f"aero.vortex.spanwise={8 * fine}")
        response = ask(made(*still, *panels), 0.0)[1].response
        found.append(response[1, 1] * 0.02 / (0.25 * np.pi * 1.225 * 0.4**2 * 1.2))
    assert found[0] - found[1] > 0.03
    assert 2.0 * found[1] - found[0] == pytest.approx(0.83, abs=0.015)


def test_verify_and_resume_give_the_same_bits(tmp_path):
    scenario = loads(WING, "wing.toml", ["log.checkpoint_every=3"])
    whole = linkwind.run(scenario, tmp_path / "whole", report=False)
    assert linkwind.verify(whole.log).identical
    digest = hashlib.sha256(linkwind.open_log(whole.log).trajectory().position.tobytes()).digest()
    resumed = linkwind.resume(whole.log, tmp_path / "resumed", from_step=6)
    path = linkwind.open_log(resumed.log).trajectory()
    assert hashlib.sha256(path.position.tobytes()).digest() == digest


# ---- wings of any planform ----

RECTANGLE = 'bodies.wing.shape={type="wing",points=[[-0.2,-0.6],[0.2,-0.6],[0.2,0.6],[-0.2,0.6]]}'
SWEPT = 'bodies.wing.shape={type="wing",points=[[-0.2,-0.5],[0.2,-0.5],[0.6,0.5],[0.2,0.5]]}'
TURNING = {"linear": (0.1, 0.3, -0.2), "angular": (0.4, -0.3, 0.5), "angle": 0.1}


@pytest.mark.parametrize("edge", ["+x", "-x"])
def test_a_rectangle_has_the_bits_of_a_plate(edge):
    trails = f'aero.vortex.trailing_edge.wing="{edge}"'
    plate, wing = made(trails), made(trails, RECTANGLE)
    for t in (0.0, 0.02, 0.04):
        motion, expected = ask(plate, t, **TURNING)
        _, found = ask(wing, t, **TURNING)
        for name in ("force", "torque", "response", "diagnostics"):
            assert getattr(found, name).tobytes() == getattr(expected, name).tobytes()
        plate.commit(t, motion)
        wing.commit(t, motion)
    assert wing.save() == plate.save()


def test_rings_of_a_pointed_wing_lie_within_it():
    model = made('bodies.wing.shape={type="wing",points=[[-0.4,0],[0.2,0.6],[0.2,-0.6]]}')
    ask(model, 0.0)
    x, _, z = np.moveaxis(model.lattice.table.corner[0], -1, 0)
    chord = 0.6 - np.abs(z[0])
    np.testing.assert_allclose(x[0], 0.2 - chord + 0.25 * chord / 3, rtol=0, atol=1e-15)
    np.testing.assert_allclose(np.diff(x, axis=0), np.tile(chord / 3, (3, 1)), rtol=1e-12)
    assert chord.min() == pytest.approx(0.25 * 1.2 / 4.5)
    assert model.lattice.table.core == pytest.approx(0.05 * 0.3)  # of the mean chord


def test_a_sharp_leading_edge_leaves_nothing_along_the_chord_of_a_swept_wing():
    """What it takes away is across the edge, which runs along (0.4, 0, 1)."""
    forces = []
    for suction in (1.0, 0.0):
        model = made(SWEPT, f"aero.vortex.suction={suction}")
        forces.append(ask(model, 0.0)[1].force[0])
    round_, sharp = forces
    assert abs(sharp[0]) < 1e-15 * sharp[1] < abs(round_[0])
    pull = round_ - sharp
    assert pull[0] < 0.0 < pull[2]
    assert abs(pull @ [0.4, 0.0, 1.0]) < 1e-12 * np.linalg.norm(pull)


def test_a_wing_away_from_the_centre_of_mass_meets_the_air_where_it_is():
    """A blade 2 m from its hub that turns at 3 rad/s about y: 6 m/s at its middle, 7.8 m/s at its tip."""
    blade = 'bodies.wing.shape={type="wing",points=[[-0.2,1.4],[0.2,1.4],[0.2,2.6],[-0.2,2.6]]}'
    for spin, front in ((3.0, 1.0), (-3.0, -1.0)):
        model = made(blade, "environment.wind=[0,0.3,0]")
        _, wrench = ask(model, 0.0, angular=(0.0, spin, 0.0))
        assert np.sign(model.lattice.table.corner[0, 0, 0, 0]) == front
        incidence, advance, _ = wrench.diagnostics
        assert incidence == pytest.approx(np.degrees(np.arctan2(0.3, 7.8)))
        assert advance == pytest.approx(np.hypot(7.8, 0.3) * 0.02 * 3 / 0.4)


ARM = np.array([0.3, 0.0, 0.4])
ON_AN_ARM = (ARM[[0, 2]] + [[-0.2, -0.6], [0.2, -0.6], [0.2, 0.6], [-0.2, 0.6]]).tolist()
MOVED = f'bodies.wing.shape={{type="wing",points={ON_AN_ARM}}}'


def test_a_wing_on_an_arm_bears_the_forces_of_a_plate_that_is_there():
    """F = F', T = T' + r × F', with the velocity v + ω × r; without a turn the response goes the same way."""
    for spin in (TURNING["angular"], (0.0, 0.0, 0.0)):
        motion, found = ask(made(MOVED), 0.0, **{**TURNING, "angular": spin})
        arm = motion.rotation()[0] @ ARM
        there = {**TURNING, "angular": spin, "linear": motion.linear[0] + np.cross(spin, arm)}
        _, expected = ask(made(), 0.0, **there)
        np.testing.assert_allclose(found.force, expected.force, rtol=0, atol=1e-12)
        torque = expected.torque[0] + np.cross(arm, expected.force[0])
        np.testing.assert_allclose(found.torque[0], torque, rtol=0, atol=1e-12)
    moved = np.eye(6)
    moved[:3, 3:] = -np.cross(np.eye(3), arm)  # ω × r
    response = moved.T @ expected.response @ moved
    np.testing.assert_allclose(found.response, response, rtol=0, atol=1e-11)


def test_a_wing_on_an_arm_flies_as_a_plate_on_a_fixed_joint(tmp_path):
    """But for where the mean force of a step stands in it: a difference of second order."""
    text = WING.replace("[coupling]", f"""[[bodies]]
name = "sail"
mass = 0.0
inertia = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0]
shape = {{ type = "plate", length = 0.4, span = 1.2 }}
[[joints]]
name = "weld"
type = "fixed"
parent = "wing"
child = "sail"
parent_point = {ARM.tolist()}
[coupling]""")  # fmt: skip
    off = []
    for step in (0.02, 0.01):
        same = [f"coupling.step={step}", "bodies.wing.angular_velocity=[0.5,1.0,2.0]"]
        one = fly(tmp_path / f"one{step}", *same, MOVED)
        scenario = loads(text, "wing.toml", [*same, 'aero.bodies=["sail"]'])
        outcome = linkwind.run(scenario, tmp_path / f"two{step}", report=False)
        two = linkwind.open_log(outcome.log).trajectory()
        off.append(np.abs(one.position[-1, 0] - two.position[-1, 0]).max())
    assert np.ptp(one.linear[:, 0], axis=0).max() > 0.1
    assert off[1] < 1e-4
    assert off[0] / off[1] > 3.0
