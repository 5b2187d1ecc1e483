"""A scenario as a system of FMUs, read and run by FMPy."""

from __future__ import annotations

import json
import zipfile

import numpy as np
import pytest
from fmpy import extract
from fmpy.ssp.simulation import free_fmu, get_value, instantiate_fmu, set_value, simulate_ssp
from fmpy.ssp.ssd import read_ssd
from fmpy.validation import validate_fmu
from typer.testing import CliRunner

from linkwind.cli import app
from linkwind.errors import InputError
from linkwind.fmi.ssp import export_system
from linkwind.scenario import Scenario, load, loads
from tests.fmi.conftest import scenario
from tests.fmi.scenes import SERVO
from tests.fmi.test_trajectories import STEPS, H, explicit_run, poses  # noqa: F401

BODIES = ("link1", "link2")


@pytest.fixture(scope="module")
def system(tmp_path_factory):
    """Return a function: the file of a scenario as a system."""
    folder, made = tmp_path_factory.mktemp("systems"), {}

    def make(name: str):
        if name not in made:
            made[name] = export_system(scenario(name), folder / f"{name}.ssp").file
        return made[name]

    return make


@pytest.fixture
def uncompiled(monkeypatch):
    """FMUs are not made where nobody looks into them."""
    monkeypatch.setattr("linkwind.fmi.ssp.archive", lambda part, *_: part.identifier.encode())


def ends(file) -> list[tuple[str | None, str, str | None, str]]:
    found = read_ssd(str(file)).system.connections  # valid by the schema of SSP 1.0
    return [(c.startElement, c.startConnector, c.endElement, c.endConnector) for c in found]


def test_equal_names_of_mechanism_and_force_model_are_connected(system):
    inner = ends(system("two_link"))
    assert all(start == end for _, start, _, end in inner)
    assert read_ssd(str(system("two_link"))).system.connectors == []  # it is closed
    motion = {name for start, name, end, _ in inner if (start, end) == ("dynamics", "aero")}
    assert motion == {
        f"{body}.{what}[{i + 1}]"
        for body in BODIES
        for what, size in (("r", 3), ("orientation", 4), ("v", 3), ("w", 3))
        for i in range(size)
    }
    forces = {name for start, name, end, _ in inner if (start, end) == ("aero", "dynamics")}
    assert len(forces) == 2 * (3 + 3 + 36)
    assert {"link1.F[1]", "link2.T[3]", "link2.A[6,6]"} <= forces


def test_an_input_of_the_wind_is_one_of_the_system(uncompiled, tmp_path):
    """It goes to each model of plates; motion and forces are connected as ever."""
    settings = ["environment.wind=['u', 0, 0]", "environment.inputs.u=-4"]
    file = export_system(load("two_link", settings), tmp_path / "blown.ssp").file
    outer = [link for link in ends(file) if link[0] is None]
    assert outer == [(None, "environment.u", "aero", "environment.u")]
    parsed = read_ssd(str(file)).system
    assert [c.name for c in parsed.connectors if c.kind == "input"] == ["environment.u"]
    (values,) = parsed.parameterBindings[0].parameterValues
    assert [(p.name, p.value) for p in values.parameters] == [("environment.u", "-4.0")]


def test_every_input_is_connected_once_and_types_and_units_come_along(system):
    file = system("servo")
    targets = [(end, name) for _, _, end, name in ends(file)]
    assert len(set(targets)) == len(targets)
    parsed = read_ssd(str(file))
    for component in parsed.system.elements:
        inputs = {(component.name, each.name) for each in component.connectors if each.kind == "input"}
        assert inputs <= set(targets)
    given = {each.name for each in parsed.system.connectors if each.kind == "input"}
    assert given == {
        "motor.u", "spring.gain", "spring.target", "jet.throttle", "brake.command", "drop.command",
    }  # fmt: skip
    assert "shoulder.q" in {each.name for each in parsed.system.connectors if each.kind == "output"}
    (values,) = parsed.system.parameterBindings[0].parameterValues
    starts = {each.name: each.value for each in values.parameters}
    assert (starts["spring.gain"], starts["drop.command"], starts["motor.u"]) == ("2.0", "false", "0.0")
    with zipfile.ZipFile(file) as archive:
        text = archive.read("SystemStructure.ssd").decode()
    assert '<ssd:Connector name="drop.command" kind="input">\n' in text
    assert '<ssc:Real unit="N.m" />' in text
    assert {unit.name: (unit.kg, unit.m, unit.s) for unit in parsed.units}["N.m"] == (1, 2, -2)


def test_the_fmus_are_good_ones(system, tmp_path):
    with zipfile.ZipFile(system("servo")) as archive:
        names = sorted(name for name in archive.namelist() if name.endswith(".fmu"))
        assert names == ["resources/aero.fmu", "resources/dynamics.fmu"]
        for name in names:
            archive.extract(name, tmp_path)
            assert validate_fmu(str(tmp_path / name)) == []


def test_a_master_that_passes_values_on_is_the_explicit_run(system, explicit_run):  # noqa: F811
    """Connections one by one, in the order of the file, then a step of every component: all bits."""
    file = system("two_link")
    parsed, folder = read_ssd(str(file)), extract(str(file))
    components = {each.name: each for each in parsed.system.elements}
    for component in components.values():
        instantiate_fmu(component, folder, 0.0)
    links = [c for c in parsed.system.connections if c.startElement and c.endElement]
    for k in range(STEPS):
        for link in links:
            value = get_value(components[link.startElement], link.startConnector)
            set_value(components[link.endElement], link.endConnector, value)
        for component in components.values():
            component.fmu.doStep(currentCommunicationPoint=k * H, communicationStepSize=H)
    whats = (("r", 3), ("orientation", 4), ("v", 3), ("w", 3))
    names = [f"{body}.{what}[{i + 1}]" for what, size in whats for body in BODIES for i in range(size)]
    found = np.array([get_value(components["dynamics"], name) for name in names])
    for component in components.values():
        free_fmu(component)
    assert found.tobytes() == poses(explicit_run[0][STEPS].motion)


def test_fmpy_runs_it(system):
    """A command from outside lets the arm drop its load; before its first step FMPy knows no values but 0."""
    given = {
        "drop.command": lambda t: t > 0.0495,
        "spring.gain": lambda _: 2.0,
        "spring.target": lambda _: 0.4,
    }
    result = simulate_ssp(str(system("servo")), stop_time=0.2, step_size=1e-3, input=given)
    dropped = result["dynamics.drop.time"]
    assert dropped[40] == -1.0
    assert dropped[-1] == pytest.approx(0.05, abs=2e-3)
    after = result[100:]  # it falls on its own, with the drag of the field, which is a step or two late
    drag = -0.1 * after["dynamics.load.v[2]"] / 0.3
    np.testing.assert_allclose(after["dynamics.load.a[2]"], drag - 9.81, atol=0.01)


def with_providers(*rows: tuple[str, str, str]) -> Scenario:
    """The arm with other providers: name, model and body of each."""
    text = SERVO[: SERVO.index("[aero]")]
    for name, model, body in rows:
        text += f'[[providers]]\nname = "{name}"\nmodel = "{model}"\nbodies = ["{body}"]\n'
        if model == "field":
            text += f'[providers.field.{body}]\nfx = "1"\n'
    return loads(text, "servo.toml")


def test_two_forces_on_a_body_are_refused(tmp_path):
    case = with_providers(("one", "field", "load"), ("two", "field", "load"))
    with pytest.raises(InputError, match=r'expected one for each body.*got "one" and "two" for load'):
        export_system(case, tmp_path / "two.ssp")


def test_several_force_models_and_those_that_are_not_in_c(uncompiled, tmp_path):
    case = with_providers(("one", "field", "load"), ("two", "field", "upper"), ("three", "fmu", "lower"))
    done = export_system(case, tmp_path / "several.ssp")
    assert (done.components, done.left_out) == (("dynamics", "one", "two"), ("three",))
    assert done.bytes == done.file.stat().st_size
    with zipfile.ZipFile(done.file) as archive:
        assert archive.read("resources/two.fmu") == b"servo_two"  # the names of the binaries differ
    found = ends(done.file)
    assert ("two", "upper.F[1]", "dynamics", "upper.F[1]") in found
    assert ("one", "load.F[1]", "dynamics", "load.F[1]") in found
    for name in ("lower.F[1]", "lower.A[6,6]"):
        assert (None, name, "dynamics", name) in found


def test_the_same_scenario_is_the_same_bytes(system, tmp_path):
    again = export_system(scenario("servo"), tmp_path / "again.ssp")
    assert again.file.read_bytes() == system("servo").read_bytes()


def invoke(*arguments: str):
    return CliRunner().invoke(app, ["fmu", "export", *map(str, arguments)], env={"COLUMNS": "200"})


def test_command(uncompiled, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    done = invoke("two_link", "--ssp", "--json")
    assert done.exit_code == 0
    summary = json.loads(done.stdout)
    assert (summary["file"], summary["components"], summary["left_out"]) == (
        "two_link.ssp",
        ["dynamics", "aero"],
        [],
    )
    told = invoke("two_link_flow", "--ssp", "-o", "flow.ssp").stdout
    assert "left out: provider aero" in told
    assert invoke("two_link", "--ssp", "--part", "aero").exit_code == 2
    assert invoke("two_link", "--ssp", "--fmi", "3").exit_code == 2
