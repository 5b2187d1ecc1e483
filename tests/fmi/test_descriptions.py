"""The XML files, against the standard's rules and against the mechanism."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET

import numpy as np
import pytest
from fmpy.validation import validate_fmu

from linkwind.fmi.part import dynamics_part
from linkwind.fmi.picture import png, strokes
from linkwind.fmi.units import DEGREES
from linkwind.mechanism import build
from tests.fmi.conftest import FORMS, SCENARIOS, scenario

SI = {"kg": 0, "m": 0, "s": 0, "rad": 0}


@pytest.mark.parametrize(("part", "fmi", "arrays"), FORMS)
@pytest.mark.parametrize("name", SCENARIOS)
def test_fmpy_finds_nothing(unpacked, name, part, fmi, arrays):
    assert validate_fmu(str(unpacked(name, part, fmi, arrays))) == []


@pytest.fixture(params=["2", "3"])
def description(unpacked, request):
    return ET.parse(
        unpacked("spatial", "dynamics", request.param, "native") / "modelDescription.xml"
    ).getroot()


@pytest.fixture
def arrays_3(unpacked):
    """Variables of the 3-D mechanism in FMI 3, by name."""
    return named(unpacked("spatial", "dynamics", "3", "native"))


def named(folder) -> dict[str, ET.Element]:
    root = ET.parse(folder / "modelDescription.xml").getroot()
    return {variable.get("name"): variable for variable in root.find("ModelVariables")}


def shape(variable: ET.Element) -> tuple[int, ...]:
    return tuple(int(dimension.get("start")) for dimension in variable.iter("Dimension"))


def test_dimensions_of_arrays(arrays_3):
    expected = {
        "hub.F": (3,), "hub.T": (3,), "hub.A": (6, 6), "hub.r": (3,), "hub.orientation": (4,),
        "hub.v": (3,), "hub.w": (3,), "hub.a": (3,), "hub.alpha": (3,), "hub.mass": (), "hub.inertia": (6,),
        "gravity": (3,),
        "world_hub.q_translation": (3,), "world_hub.q_rotation": (4,), "world_hub.v_translation": (3,),
        "world_hub.v_rotation": (3,), "ball.q": (4,), "ball.v": (3,), "der(ball.q)": (4,),
        "der(ball.v)": (3,),
        "flap_joint.q": (), "flap_joint.v": (), "rail.q": (), "ground.q_translation": (2,),
        "ground.q_rotation": (), "ball.F": (3,), "ball.T": (3,), "glue.F": (3,), "ball.parent_point": (3,),
        "ball.stiffness": (3,), "ball.rest": (4,), "ground.stiffness_rotation": (), "solver.substeps": (),
    }  # fmt: skip
    assert {name: shape(arrays_3[name]) for name in expected} == expected


def test_what_an_automatic_joint_and_a_fixed_joint_do_not_have(arrays_3):
    assert not {"world_hub.F", "world_hub.stiffness_rotation", "glue.q", "glue.v"} & set(arrays_3)


def test_force_and_torque_have_units_of_their_own(description):
    found = {v.get("name"): v.find("Real") if v.tag == "ScalarVariable" else v
             for v in description.find("ModelVariables")}  # fmt: skip
    suffix = "[1]" if description.get("fmiVersion") == "2.0" else ""
    assert found["arm.F" + suffix].get("unit") == found["ball.F" + suffix].get("unit") == "N"
    assert found["arm.T" + suffix].get("unit") == found["ball.T" + suffix].get("unit") == "N.m"
    assert found["rail.stiffness"].get("unit") == "N/m"
    assert found["flap_joint.stiffness"].get("unit") == "N.m/rad"


def test_blocks_of_the_added_inertia_have_units_of_their_own(unpacked):
    found = named(unpacked("spatial", "dynamics", "2", "native"))
    units = [found[f"arm.A[{i},{j}]"].find("Real").get("unit") for i, j in ((1, 2), (3, 4), (6, 1), (5, 6))]
    assert units == ["kg", "kg.m", "kg.m", "kg.m2"]


@pytest.mark.parametrize("name", ["N", "N.m", "J", "kg.m2", "N.m.s/rad", "rad/s2"])
def test_units_in_base_units(description, name):
    """The exponents follow from the name: N = kg m/s2, J = N m."""
    unit = next(entry for entry in description.iter("Unit") if entry.get("name") == name)
    base = {key: int(unit.find("BaseUnit").get(key, 0)) for key in SI}
    spelled = name.replace("N", "kg.m.s-2").replace("J", "kg.m2.s-2")
    above, _, below = spelled.partition("/")
    expected = dict(SI)
    for text, sign in ((above, 1), (below, -1)):
        for symbol, power in re.findall(r"([a-z]+)(-?\d*)", text):
            expected[symbol] += sign * int(power or 1)
    assert base == expected


def test_angles_can_be_shown_in_degrees(description):
    display = {unit.get("name"): unit.find("DisplayUnit") for unit in description.iter("Unit")}
    for name in ("rad", "rad/s", "rad/s2"):
        assert display[name].get("name") == name.replace("rad", "deg")
        assert float(display[name].get("factor")) == DEGREES == pytest.approx(360.0 / (2.0 * np.pi))
    assert display["m"] is None


def test_every_state_has_its_derivative(description):
    """Derivatives refer to their states, in FMI 2 by index from 1, in FMI 3 by value reference."""
    fmi_2 = description.get("fmiVersion") == "2.0"
    variables = list(description.find("ModelVariables"))
    inner = [v.find("Real") if fmi_2 else v for v in variables]
    pairs = {
        v.get("name"): variables[int(e.get("derivative")) - fmi_2].get("name")
        for v, e in zip(variables, inner, strict=True)
        if e is not None and e.get("derivative")
    }
    states = [v.get("name") for v in variables if re.match(r"\w+\.[qv](_\w+)?(\[\d\])?$", v.get("name"))
              and v.get("causality") == "output" and v.get("initial") == "exact"]  # fmt: skip
    assert pairs == {f"der({state})": state for state in states}
    listed = description.findall(".//Derivatives/Unknown" if fmi_2 else ".//ContinuousStateDerivative")
    assert len(listed) == len(pairs)


def test_continuous_states_are_all_coordinates(arrays_3):
    mechanism = build(scenario("spatial"))
    sizes = [int(np.prod(shape(v) or (1,))) for name, v in arrays_3.items() if v.get("derivative")]
    assert sum(sizes) == len(mechanism.q0) + len(mechanism.v0)


def test_start_values_are_the_scenario_s(arrays_3):
    mechanism = build(scenario("spatial"))
    assert arrays_3["slider.mass"].get("start") == "0.5"
    rail = mechanism.joints.index("rail")
    q = float(mechanism.q0[mechanism.tables.q_index[rail]])
    assert float(arrays_3["rail.q"].get("start")) == q
    inertia = [float(x) for x in arrays_3["hub.inertia"].get("start").split()]
    assert inertia == [0.3, 0.5, 0.6, 0.02, -0.01, 0.03]


def test_default_experiment_and_names(description):
    experiment = description.find("DefaultExperiment")
    assert (experiment.get("stopTime"), experiment.get("stepSize")) == ("0.2", "0.001")
    assert description.get("variableNamingConvention") == "structured"
    assert description.get("generationDateAndTime") is None


def test_what_may_be_tuned(arrays_3):
    parameters = {
        name: v.get("variability") for name, v in arrays_3.items() if v.get("causality") == "parameter"
    }
    fixed = {name for name, variability in parameters.items() if variability == "fixed"}
    assert fixed == {f"{joint}.{side}_point" for joint in ("ball", "flap_joint", "rail", "glue", "ground")
                     for side in ("parent", "child")}  # fmt: skip


def test_terminals_of_mechanism_and_force_model_fit(unpacked):
    ports = {}
    for part in ("dynamics", "aero"):
        folder = unpacked("two_link", part, "3", "native")
        root = ET.parse(folder / "terminalsAndIcons" / "terminalsAndIcons.xml").getroot()
        variables = named(folder)
        for terminal in root.iter("Terminal"):
            members = {
                m.get("memberName"): m.get("variableName") for m in terminal.iter("TerminalMemberVariable")
            }
            assert set(members.values()) <= set(variables)
            ports[part, terminal.get("name")] = {
                member: variables[name].get("causality") for member, name in members.items()
            }
            icon = terminal.find("TerminalGraphicalRepresentation").get("iconBaseName")
            assert (folder / "terminalsAndIcons" / f"{icon}.png").exists()
    for body in ("link1", "link2"):
        aero, dynamics = ports["aero", body], ports["dynamics", body]
        assert {"F", "T", "A"} == {member for member, causality in aero.items() if causality == "output"}
        for member, causality in aero.items():
            assert {causality, dynamics[member]} == {"input", "output"}


def test_terminals_follow_the_schema(unpacked):
    from importlib.resources import files

    from lxml import etree

    folder = unpacked("two_link", "dynamics", "3", "scalar")
    for path, schema in (
        ("terminalsAndIcons/terminalsAndIcons.xml", "fmi3TerminalsAndIcons.xsd"),
        ("sources/buildDescription.xml", "fmi3BuildDescription.xsd"),
    ):
        xsd = etree.XMLSchema(etree.parse(str(files("fmpy").joinpath("schema", "fmi3", schema))))
        xsd.assertValid(etree.parse(str(folder / path)))


def test_sources_are_all_listed(unpacked):
    folder = unpacked("two_link", "dynamics", "3", "native")
    listed = {
        file.get("name") for file in ET.parse(folder / "sources/buildDescription.xml").iter("SourceFile")
    }
    assert listed == {file.name for file in (folder / "sources").glob("*.c")}
    folder = unpacked("two_link", "aero", "2", "native")
    for interface in ("ModelExchange", "CoSimulation"):
        root = ET.parse(folder / "modelDescription.xml").getroot().find(interface)
        assert {file.get("name") for file in root.iter("File")} == {
            f.name for f in (folder / "sources").glob("*.c")
        }


def test_manifest_names_files_that_exist(unpacked):
    folder = unpacked("two_link", "dynamics", "2", "native") / "extra" / "org.fmi-standard.fmi-ls-ref"
    root = ET.parse(folder / "fmi-ls-manifest.xml").getroot()
    assert root.get("{http://fmi-standard.org/fmi-ls-manifest}fmi-ls-name") == "org.fmi-standard.fmi-ls-ref"
    roles = {
        related.get("role"): (folder / related.get("source")).resolve() for related in root.iter("Related")
    }
    assert set(roles) == {"experiment/smoke-test", "testcase", "result", "document"}
    assert all(file.is_file() for file in roles.values())


def test_documentation_tells_every_variable_and_expression(unpacked):
    folder = unpacked("spatial", "aero", "3", "native")
    text = (folder / "documentation" / "index.html").read_text(encoding="utf-8")
    assert "<svg" in text
    assert all(f"<code>{name}</code>" in text for name in named(folder) if name != "time")
    assert "0.1*sin(7*t)" in text


def test_icon_shows_the_bodies():
    """The middle of each plate is opaque, the corners are not."""
    drawing = strokes(scenario("two_link"), build(scenario("two_link")))
    image = decode_png(png(drawing, 50))
    plates = [s for s in drawing if s.start != s.end]
    assert len(plates) == 2
    for plate in plates:
        x, y = ((a + b) / 2.0 for a, b in zip(plate.start, plate.end, strict=True))
        assert image[int(y * 50), int(x * 50), 3] == 255
    assert image[0, 0, 3] == image[-1, -1, 3] == 0


def decode_png(data: bytes) -> np.ndarray:
    import struct
    import zlib

    width, height = struct.unpack(">II", data[16:24])
    at = data.index(b"IDAT")
    (length,) = struct.unpack(">I", data[at - 4 : at])
    rows = np.frombuffer(zlib.decompress(data[at + 4 : at + 4 + length]), dtype=np.uint8)
    return rows.reshape(height, 1 + 4 * width)[:, 1:].reshape(height, width, 4)


def test_names_of_joints_never_meet_those_of_bodies():
    part = dynamics_part(scenario("spatial"), native_arrays=True)
    names = [variable.name for variable in part.variables]
    assert len(set(names)) == len(names)
    assert {"flap.F", "flap_joint.F"} <= set(names)
    assert part.identifier == "spatial"
