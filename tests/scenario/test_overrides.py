"""--set KEY=VALUE changes one key, whatever its type and wherever it is."""

import pytest

from linkwind.errors import ScenarioError
from linkwind.scenario import load, loads
from tests.scenario.texts import BUILTIN, SMALL, TWO_LINK

GUST = "environment.gusts=[{ amplitude = [1, 0], frequency = 2.5 }]"


@pytest.mark.parametrize(
    ("arguments", "read", "value"),
    [
        (["coupling.step=5e-4"], lambda s: s.coupling.step_ns, 500_000),
        (["bodies.0.mass=3"], lambda s: s.bodies[0].mass, 3.0),
        (["bodies.link2.mass=3"], lambda s: s.bodies[1].mass, 3.0),
        (["joints.hinge.type=fixed", "bodies.1.position=[0, 1]"], lambda s: s.joints[0].type, "fixed"),
        (["aero.model=none"], lambda s: s.providers[0].model, "none"),
        (["providers.aero.model=none"], lambda s: s.providers[0].model, "none"),
        (["providers.0.model=none"], lambda s: s.providers[0].model, "none"),
        (["coupling.adaptive=false"], lambda s: s.coupling.adaptive, False),
        (['coupling.scheme="explicit"'], lambda s: s.coupling.scheme, "explicit"),
        (["coupling.scheme = explicit"], lambda s: s.coupling.scheme, "explicit"),
        (["environment.wind.0=-3"], lambda s: s.environment.wind, (-3.0, 0.0, 0.0)),
        (["environment.wind=[-3, 1]"], lambda s: s.environment.wind, (-3.0, 1.0, 0.0)),
        (["bus.transport=inprocess"], lambda s: s.bus.transport, "inprocess"),
        (["bus.start_timeout=10"], lambda s: s.bus.start_timeout, 10.0),
        (["description=two words = fun"], lambda s: s.description, "two words = fun"),
        (["name=other"], lambda s: s.name, "other"),
        ([GUST, "environment.gusts.0.phase_deg=90"], lambda s: s.environment.gusts[0].phase_deg, 90.0),
        (["aero.field.link1.fx=2*t"], lambda s: s.providers[0].field["link1"].fx, "2*t"),
        (["time.end=0.1", "time.end=0.2"], lambda s: s.time.end, 0.2),
    ],
)
def test_an_override_takes_effect_and_nothing_else_changes(arguments, read, value):
    plain, changed = load("two_link"), load("two_link", arguments)
    assert read(changed) == value
    untouched = {"bodies", "joints", "environment", "providers", "coupling", "dynamics", "bus", "time"}
    untouched -= {argument.split(".")[0].split("=")[0].replace("aero", "providers") for argument in arguments}
    for name in untouched:
        assert getattr(changed, name) == getattr(plain, name)


def test_aero_can_be_set_where_the_file_has_no_provider():
    text = SMALL + 'shape = { type = "plate", length = 1 }'
    assert loads(text, "x", ["aero.model=plate"]).providers[0].model == "plate"


@pytest.mark.parametrize(
    ("argument", "line"),
    [
        ("coupling.stepp=3",
         "coupling.stepp: expected a key among scheme, order, adaptive, acceleration, tolerance, "
         "iterations, step, timeout; "
         'got "stepp". Use "step".'),
        ("couplin.step=3",
         "couplin: expected a key among name, description, time, environment, bodies, joints, events, "
         'forces, providers, dynamics, coupling, bus, log, aero; got "couplin". Use "coupling".'),
        ("coupling", 'expected KEY=VALUE; got "coupling". For example coupling.step=5e-4.'),
        ("=3", 'expected KEY=VALUE; got "=3". For example coupling.step=5e-4.'),
        ("coupling..step=3", 'expected KEY=VALUE; got "coupling..step=3". For example coupling.step=5e-4.'),
        ("bodies.link3.mass=2",
         'bodies: expected the index or name of an entry: link1, link2; got "link3". Use "link2".'),
        ("bodies.2.mass=2",
         'bodies: expected the index or name of an entry: link1, link2; got "2". Use one of these.'),
        ("bodies.-1.mass=2",
         'bodies: expected the index or name of an entry: link1, link2; got "-1". Use one of these.'),
        ("cfd.model=plate",
         "cfd: expected a key among name, description, time, environment, bodies, joints, events, "
         'forces, providers, dynamics, coupling, bus, log, aero; got "cfd". Remove it.'),
        ("environment.wind.3=2",
         'environment.wind: expected an index from 0 to 2; got "3". Use one of these.'),
        ("events.release.at=1",
         'events: expected the index or name of an entry: (there is none); got "release". '
         "Leave it out."),
        ("environment.gusts.0.frequency=1",
         'environment.gusts: expected the index or name of an entry: (there is none); got "0". '
         "Leave it out."),
        ("coupling.step.x=1",
         "coupling.step: expected a table with the key x; got 0.001. "
         "Set it as a whole, or name one of its own keys."),
        ("bodies.0.mass=x",
         'bodies[0] "link1".mass: expected a number [kg]; got "x". '
         "Write the number alone, without quotes and unit."),
        ("coupling.adaptive=True",
         'coupling.adaptive: expected true or false; got "True". Write true or false, without quotes.'),
        ("bodies.link1.mass=inf",
         'bodies[0] "link1".mass: expected a finite number [kg]; got inf. Change the value.'),
        ("aero.model=plats",
         'aero.model: expected one of none, field, plate, flow, vortex, fmu, python; got "plats". '
         'Use "plate".'),
        ("bodies=3", "bodies: expected a list; got 3. Write it as [[table]] or [a, b]."),
    ],
)  # fmt: skip
def test_a_wrong_override_is_named_instead_of_the_file(argument, line):
    with pytest.raises(ScenarioError) as error:
        loads(TWO_LINK, "two_link.toml", [argument])
    assert str(error.value) == f"--set {argument}: {line}"


def test_a_line_break_sets_no_second_key():
    with pytest.raises(ScenarioError) as error:
        loads(TWO_LINK, "x", ["bodies.0.mass=1\ntime.end=2"])
    assert str(error.value) == (
        '--set bodies.0.mass=1 time.end=2: bodies[0] "link1".mass: expected a number [kg]; got '
        '"1\\ntime.end=2". '
        "Write the number alone, without quotes and unit."
    )


def test_an_error_elsewhere_is_still_the_file_s():
    text = TWO_LINK.replace("order = 3", "order = 7")
    with pytest.raises(ScenarioError, match=r"^x: coupling\.order: "):
        loads(text, "x", ["coupling.step=5e-4"])


def test_every_key_of_every_builtin_can_be_set_to_what_it_is():
    import json

    def leaves(value, path=""):
        if isinstance(value, dict) and "expression" in value:
            yield path[1:], value["expression"]  # as the file has it
        elif isinstance(value, dict):
            for key, inner in value.items():
                yield from leaves(inner, f"{path}.{key}")
        elif isinstance(value, list) and value and isinstance(value[0], dict):
            for i, inner in enumerate(value):
                yield from leaves(inner, f"{path}.{inner.get('name', i)}")
        else:
            yield path[1:], value

    def toml(value):
        return "[" + ", ".join(map(toml, value)) + "]" if isinstance(value, list) else json.dumps(value)

    for name in BUILTIN:
        scenario = load(name)
        arguments = [f"{key}={toml(value)}" for key, value in leaves(json.loads(scenario.to_json()))]
        assert len(arguments) > 30
        assert load(name, arguments) == scenario
