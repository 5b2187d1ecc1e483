"""Every wrong input gets one exact line: file, item, expected, got, what to do."""

import json

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from linkwind.errors import ScenarioError
from linkwind.scenario import from_json, load, loads
from tests.scenario.texts import SMALL, TWO_LINK, edited

BODY_KEYS = (
    "name, mass, inertia, shape, picture, position, angle_deg, orientation, velocity, angular_velocity"
)
TOP_KEYS = (
    "name, description, time, environment, bodies, joints, events, forces, providers, dynamics, coupling, "
    "bus, log, aero"
)
PLATE = 'shape = { type = "plate", length = 0.5, span = 1.0 }'

WRONG = [
    # keys
    ("angle_deg = 200.0", "angle = 200.0",
     f'bodies[0] "link1".angle: expected a key among {BODY_KEYS}; got "angle". Use "angle_deg".'),
    ("mass = 2.0", "mas = 2.0",
     f'bodies[0] "link1".mas: expected a key among {BODY_KEYS}; got "mas". Use "mass".'),
    ("[aero.plate]", "[aero.plat]",
     'aero.plat: expected a key among name, model, bodies, every, plate, field, flow, vortex, fmu, python; '
     'got "plat". Use "plate".'),
    ("[dynamics]", "[dynamic]",
     f'dynamic: expected a key among {TOP_KEYS}; got "dynamic". Use "dynamics".'),
    ("order = 3", "order = 3\nqqq = 1",
     "coupling.qqq: expected a key among scheme, order, adaptive, acceleration, tolerance, "
     "iterations, step, timeout; "
     'got "qqq". Remove it.'),
    ("[aero]", '[aero]\nname = "wind"',
     'aero.name: expected no name besides aero; got "wind". Remove it, or write [[providers]].'),
    ("mass = 2.0 ", "",
     'bodies[0] "link1".mass: expected a value (Mass [kg]); got nothing. Add mass.'),
    # names of choices
    ('"revolute"', '"hinge"',
     'joints[0] "hinge".type: expected one of fixed, revolute, prismatic, planar, spherical, free, distance; '
     'got "hinge". Use "revolute".'),
    ('"pec"', '"strong"', 'coupling.scheme: expected one of explicit, pec, implicit; '
    'got "strong". Use one of these.'),
    ('"rk4"', '"ode45"',
     'dynamics.integrator: expected one of euler, semi_implicit_euler, rk4, dopri5, radau5; got "ode45". '
     'Use "dopri5".'),
    ('integrator = "rk4"', 'method = "incremental"',
     "dynamics.integrator: expected euler or semi_implicit_euler: the method incremental is of first order; "
     'got "rk4". Use "semi_implicit_euler".'),
    ('integrator = "rk4"', 'method = "cfe"\nstabilisation = "baumgarte"\nstabilisation_time = 1e-4',
     "dynamics.stabilisation_time: expected at least an integrator step, 0.001 s: less would be unstable; "
     "got 0.0001. Take ten steps or more."),
    ('model = "plate"', 'model = "lbm"',
     'aero.model: expected one of none, field, plate, flow, vortex, fmu, python; got "lbm". '
     'Use one of these; for a program of your own that keeps to schemas/README.md "none": it takes part '
     "under the provider's name."),
    # types
    ("mass = 2.0", 'mass = "2 kg"',
     'bodies[0] "link1".mass: expected a number [kg]; got "2 kg". Write the number alone, without '
     'quotes and unit.'),
    ("mass = 2.0", "mass = true", 'bodies[0] "link1".mass: expected a number [kg]; got true. Change the '
     'value.'),
    ("adaptive = true", 'adaptive = "yes"',
     'coupling.adaptive: expected true or false; got "yes". Write true or false, without quotes.'),
    ("order = 3", "order = 3.0",
     "coupling.order: expected a whole number; got 3.0. Write it without a decimal point."),
    ('name = "link1"', "name = 1", 'bodies[0].name: expected text in quotes; got 1. Write it as "…".'),
    ("gravity = [0.0, -9.81, 0.0]", "gravity = -9.81",
     "environment.gravity: expected a list of 2 or 3 numbers; got -9.81. "
     "Write [x, y, z], or [x, y] where z is 0."),
    ("gravity = [0.0, -9.81, 0.0]", 'gravity = [0, "down"]',
     'environment.gravity: expected a list of 2 or 3 numbers; got [0, "down"]. '
     "Write numbers without units or quotes."),
    ("angle_deg = 200.0", "orientation = [1, 0, 0]",
     'bodies[0] "link1".orientation: expected a unit quaternion of 4 numbers [w, x, y, z]; got [1, 0, 0]. '
     "Write [w, x, y, z], body to world."),
    (PLATE, "shape = 1", 'bodies[0] "link1".shape: expected a table; got 1. Write it as [table] or { '
     'key = value }.'),
    # units and ranges
    ("mass = 2.0", "mass = nan", 'bodies[0] "link1".mass: expected a finite number [kg]; got nan. '
     'Change the value.'),
    ("wind = [-5.0", "wind = [inf",
     "environment.wind: expected a list of 2 or 3 finite numbers; got [inf, 0.0, 0.0]. "
     "Write finite numbers."),
    ("mass = 2.0", "mass = -2.0",
     'bodies[0] "link1".mass: expected a number of at least 0 [kg]; got -2.0. Change the value.'),
    (PLATE, PLATE.replace("0.5", "0"),
     'bodies[0] "link1".shape.length: expected a number above 0 [m]; got 0. Change the value.'),
    ("order = 3", "order = 4", "coupling.order: expected a number of at most 3; got 4. Change the value."),
    ("step = 1e-3", "step = 1.5e-10",
     "coupling.step: expected a whole number of nanoseconds; got 1.5e-10. Use 1e-09."),
    ("step = 1e-3", "step = 1e19",
     "coupling.step: expected a number of at most 1e+09 [s]; got 1e+19. Change the value."),
    ("step = 1e-3", "step = 0.00033333333333",
     "coupling.step: expected a whole number of nanoseconds; got 0.00033333333333. Use 0.000333333."),
    ("end = 1.2 ", "end = 1.2345 ",
     "time.end: expected a multiple of coupling.step = 0.001 s; got 1.2345. Use 1.234 or 1.235."),
    ("end = 1.2 ", "end = 0.0004 ",
     "time.end: expected a multiple of coupling.step = 0.001 s; got 0.0004. Use 0.001."),
    ("angle_deg = 200.0", "orientation = [2, 0, 0, 0]",
     'bodies[0] "link1".orientation: expected a unit quaternion of 4 numbers [w, x, y, z]; got [2, 0, 0, 0]. '
     "Its norm is 2; use [1, 0, 0, 0]."),
    ("angle_deg = 200.0", "angle_deg = 200.0\norientation = [1, 0, 0, 0]",
     'bodies[0] "link1".angle_deg: expected angle_deg or orientation, not both; got 200.0 besides '
     'orientation. '
     "Remove one of the two."),
    ('type = "revolute"', 'type = "revolute"\naxis = [0, 0]',
     'joints[0] "hinge".axis: expected a vector that is not zero; got [0.0, 0.0, 0.0]. The default is '
     '[0, 0, 1].'),
    ('type = "revolute"', 'type = "revolute"\ndamping = -1',
     'joints[0] "hinge".damping: expected no number below 0; got -1.0. A negative one would feed energy.'),
    # inertia
    ("inertia = 1.4", "inertia = 0",
     'bodies[0] "link1".inertia: expected a number above 0, or 6 numbers [Ixx, Iyy, Izz, Ixy, Ixz, '
     'Iyz]; got 0. '
     "Give the inertia about the centre of mass."),
    ("inertia = 1.4", "inertia = [1, 1]",
     'bodies[0] "link1".inertia: expected a number above 0, or 6 numbers [Ixx, Iyy, Izz, Ixy, Ixz, Iyz]; '
     "got [1, 1]. Give one number for a planar body."),
    ("inertia = 1.4", "inertia = [1, 1, 3, 0, 0, 0]",
     'bodies[0] "link1".inertia: expected principal moments of which two add up to at least the third; '
     "got principal moments 1, 1, 3. No body has these: the largest is at most 2."),
    ("inertia = 1.4", "inertia = [1, 1, 1, 2, 0, 0]",
     'bodies[0] "link1".inertia: expected an inertia without negative moments; got principal moments '
     '-1, 1, 3. '
     "No body has these; check signs and units."),
    ("inertia = 1.4", "inertia = [1, 1, 1, 0, 0, 0]",
     'bodies[1] "link2".inertia: expected 6 numbers, because link1 is 3-D; got 1.4. '
     "Give [Ixx, Iyy, Izz, Ixy, Ixz, Iyz]."),
    # names
    ('name = "link1"', 'name = "link 1"',
     'bodies[0].name: expected a name; got "link 1". Start with a letter; go on with letters, digits and _.'),
    ('name = "link1"', 'name = "world"',
     'bodies[0].name: expected a name other than world; got "world". The world is there already.'),
    ('name = "link1"', 'name = "link2"',
     'bodies[1].name: expected a name of its own (bodies[0] has it); got "link2". Rename one of the two.'),
    ('child = "link2"', 'child = "link3"',
     'joints[0] "hinge".child: expected one of the bodies link1, link2; got "link3". Use "link2".'),
    ('child = "link2"', 'child = "world"',
     'joints[0] "hinge".child: expected one of the bodies link1, link2; got "world". Use one of these.'),
    ('parent = "link1"', 'parent = "lnk1"',
     'joints[0] "hinge".parent: expected one of the bodies link1, link2, world; got "lnk1". Use "link1".'),
    ("[aero]", '[aero]\nbodies = ["link1", "lnk2"]',
     'aero.bodies[1]: expected one of the bodies link1, link2; got "lnk2". Use "link2".'),
    ("[aero]", '[aero]\nbodies = ["link1", "link1"]',
     'aero.bodies[1]: expected each body once; got "link1". Remove one of the two.'),
    ("[aero.plate]", '[aero.field.link3]\nfx = "1"\n[aero.plate]',
     'aero.field.link3: expected one of its bodies link1, link2; got "link3". Use "link2".'),
    ("[aero]", '[[providers]]\nname = "cfd"\nmodel = "plats"\n[aero]',
     'providers[0] "cfd".model: expected one of none, field, plate, flow, vortex, fmu, python; got "plats". '
     'Use "plate".'),
    # topology
    ('child = "link2"', 'child = "link1"',
     'joints[0] "hinge".parent: expected another body than the child; got "link1". '
     "Name the body that carries it, or world."),
    # what a model needs
    (PLATE, "", 'bodies[0] "link1".shape: expected a plate or a wing, which the model of provider "aero" '
     'needs; got nothing. Add shape = { type = "plate", length = … }.'),
    ('model = "plate"', 'model = "field"',
     "aero.field: expected a table for at least one body; got nothing. "
     'Add a table for a body, such as link1, with fx = "…".'),
    # the file
    ("[dynamics]", "[dynamics",
     "expected valid TOML; got: Expected ']' at the end of a table declaration (at line 49, column 10): "
     "[dynamics. Correct it."),
    ("[dynamics]", "[time]",
     "expected valid TOML; got: Cannot declare ('time',) twice (at line 49, column 6): [time]. Correct it."),
    ('type = "revolute"', "type = revolute",
     "expected valid TOML; got: Invalid value (at line 37, column 8): type = revolute. "
     "Write text in quotes, numbers with a point and without unit."),
]  # fmt: skip


@pytest.mark.parametrize(("old", "new", "line"), WRONG)
def test_a_wrong_input_gets_its_line(old, new, line):
    with pytest.raises(ScenarioError) as error:
        loads(edited(old, new), "two_link.toml")
    assert str(error.value) == f"two_link.toml: {line}"


def test_zero_mass_needs_a_model_that_adds_inertia():
    text = edited("mass = 2.0", "mass = 0")
    assert loads(text, "x").bodies[0].mass == 0.0
    assert loads(text, "x", ["aero.model=none"]).bodies[0].mass == 0.0  # it carries a body with mass
    with pytest.raises(ScenarioError) as error:
        loads(text, "x", ["aero.model=none", "joints=[]"])
    assert str(error.value) == (
        'x: bodies[0] "link1".mass: expected a number above 0 [kg], because no provider adds inertia to '
        "this body; "
        "got 0.0. Give it a mass, however small, or the model plate, flow or vortex."
    )


def test_what_carries_mass_needs_none_also_where_a_model_adds_inertia_to_that():
    text = edited("mass = 2.0", "mass = 0")
    for model in ("none", "plate"):
        found = loads(text, "x", ["aero.bodies=['link2']", f"aero.model={model}"])
        assert found.bodies[0].mass == 0.0


def test_a_rod_may_have_no_inertia_about_itself_if_something_holds_it():
    rod = edited("inertia = 0.1", "inertia = [0, 0.1, 0.1, 0, 0, 0]", SMALL)
    with pytest.raises(ScenarioError) as error:
        loads(rod, "x")
    assert str(error.value) == (
        'x: bodies[0] "a".inertia: expected principal moments above 0, because nothing holds or hangs '
        "on this "
        "body; got [0.0, 0.1, 0.1, 0.0, 0.0, 0.0]. Correct it."
    )
    held = '[[joints]]\nname = "j"\ntype = "revolute"\nparent = "world"\nchild = "a"\n'
    assert loads(f"{rod}\n{held}", "x").bodies[0].inertia[0] == 0.0


@pytest.mark.parametrize(
    ("picture", "line"),
    [
        ('{ type = "ball" }', "type: expected one of box, ellipsoid, cylinder, capsule, mesh; got"),
        ('{ type = "box", size = [0, 0, 0] }', "size: expected 3 numbers of at least 0, not all 0; got"),
        ('{ type = "box", sice = [1, 1, 1] }', "sice: expected a key among position, orientation, size"),
        ('{ type = "mesh" }', "file: expected a value"),
    ],
)  # fmt: skip
def test_a_picture_is_checked(picture, line):
    with pytest.raises(ScenarioError) as error:
        loads(edited("inertia = 0.1", f"inertia = 0.1\npicture = [{picture}]", SMALL), "x")
    assert str(error.value).startswith(f'x: bodies[0] "a".picture[0].{line}')


def test_a_flat_body_fulfils_the_triangle_inequality_with_equality():
    thin = "inertia = [0.1, 0.2, 0.30000000000000004, 0, 0, 0]"
    assert not loads(edited("inertia = 0.1", thin, SMALL), "x").planar


def test_several_problems_are_reported_a_line_each_the_first_few():
    text = TWO_LINK.replace("mass = 2.0", "mass = -1").replace("inertia = 1.4", "inertia = 0")
    text = text.replace("[-0.25, 0.0]", '"here"').replace("order = 3", "order = 9")
    text = text.replace("adaptive = true", "adaptive = 1")
    with pytest.raises(ScenarioError) as error:
        loads(text, "x")
    lines = str(error.value).splitlines()
    assert [line.split(": ")[1] for line in lines[:-1]] == [
        'bodies[0] "link1".mass',
        'bodies[0] "link1".inertia',
        'bodies[1] "link2".mass',
        'bodies[1] "link2".inertia',
        'joints[0] "hinge".parent_point',
    ]
    assert lines[-1] == "x: and 3 more"


TOGETHER = [
    # a table that is wrong hides nothing that the others say of each other
    (['model = "plate"', 'parent = "link1"', "end = 1.2 "],
     ['model = "plats"', 'parent = "lnk1"', "end = 1.2345 "],
     ["aero.model", "time.end", 'joints[0] "hinge".parent']),
    # of a body that is wrong, the name is known all the same
    (["mass = 2.0", 'child = "link2"'], ["mass = -1", 'child = "link3"'],
     ['bodies[0] "link1".mass', 'joints[0] "hinge".child']),
    # but what follows from the first line is not told as well: names, and tables of another name
    (['name = "link1"'], ['nom = "link1"'], ["bodies[0].nom"]),
    (['name = "link2"'], ["name = 2"], ["bodies[1].name"]),
    (["[[joints]]", "[aero]"], ["[[joint]]", '[[events]]\nname = "e"\njoint = "hinge"\n[aero]'],
     ['events[0] "e".action', "joint"]),
    (["[coupling]", "end = 1.2 "], ["[couplings]", "end = 1.2345 "], ["couplings"]),
]  # fmt: skip


@pytest.mark.parametrize(("old", "new", "items"), TOGETHER)
def test_all_that_can_be_known_is_told_at_once(old, new, items):
    text = TWO_LINK
    for before, after in zip(old, new, strict=True):
        text = edited(before, after, text)
    with pytest.raises(ScenarioError) as error:
        loads(text, "x")
    assert [line.split(": ")[1] for line in str(error.value).splitlines()] == items


@pytest.mark.parametrize(
    ("source", "start", "advice"),
    [
        ("two_lnk", "two_lnk: expected a file or one of andrews, ", 'Use "two_link".'),
        ("no/such/file.toml", "no/such/file.toml: expected a file or one of ", "Check the path."),
        ("andrew", "andrew: expected a file or one of ", 'Use "andrews".'),
        ("/", "/: expected a file or one of ", "got: Is a directory. Check the path."),
        ("a\0b", "a\0b: expected a file or one of ", "Check the path."),
    ],
)
def test_a_source_that_does_not_exist(source, start, advice):
    with pytest.raises(ScenarioError) as error:
        load(source)
    assert str(error.value).startswith(start)
    assert str(error.value).endswith(advice)


def test_files_of_other_commands(tmp_path):
    (tmp_path / "robot.urdf").write_text('<robot name="r"/>')
    (tmp_path / "log.mcap").write_bytes(b"\x89MCAP0\r\n")
    for name, line in (
        (
            "robot.urdf",
            r"expected a scenario; got XML\. Make one of a robot: linkwind mechanism import .*urdf",
        ),
        ("log.mcap", r"expected a scenario; got a log\. linkwind verify does its run again"),
    ):
        with pytest.raises(ScenarioError, match=f"{name}: {line}"):
            load(tmp_path / name)


@pytest.mark.parametrize(
    ("text", "lines"),
    [
        ("", ["time: expected a value (Simulation time); got nothing. Add [time].",
              "bodies: expected a value (The rigid bodies); got nothing. Add [[bodies]]."]),
        ("bodies = []\ntime = { end = 1.0 }",
         ["bodies: expected at least one entry; got []. Add an entry."]),
    ],
)  # fmt: skip
def test_what_every_scenario_has(text, lines):
    with pytest.raises(ScenarioError) as error:
        loads(text, "x")
    assert str(error.value).splitlines() == [f"x: {line}" for line in lines]


def test_a_file_that_is_not_text(tmp_path):
    path = tmp_path / "x.toml"
    path.write_bytes(b"name = '\xff'")
    with pytest.raises(ScenarioError) as error:
        load(path)
    assert str(error.value) == (
        f"{path}: expected text in UTF-8; got a wrong byte at position 8. Save it as UTF-8."
    )


@pytest.mark.parametrize("text", ["", "[]", "3", "{", "{}", '{"time": NaN}', "[" * 100_000, '{"bodies": {}}'])
def test_json_that_is_not_a_scenario(text):
    with pytest.raises(ScenarioError, match=r"^scenario\.json: "):
        from_json(text)


@pytest.mark.parametrize("text", ["a = " + "[" * 100_000, "a = " + "9" * 100_000, "\0"])
def test_toml_beyond_the_limits(text):
    with pytest.raises(ScenarioError, match=r"^x: "):
        loads(text, "x")


JUNK = st.recursive(
    st.none()
    | st.booleans()
    | st.integers()
    | st.integers(min_value=10**400, max_value=10**401)
    | st.floats()
    | st.text(max_size=5)
    | st.sampled_from(["link1", "world", "aero", "plate"]),
    lambda inner: (
        st.lists(inner, max_size=4)
        | st.dictionaries(st.sampled_from(["name", "mass", "fx", "let", "type", ""]), inner, max_size=3)
    ),
    max_leaves=6,
)
KEYS = [
    "bodies", "bodies.0", "bodies.0.inertia", "bodies.0.name", "bodies.0.orientation", "bodies.0.shape",
    "bodies.0.angular_velocity", "bodies.1.position", "joints", "joints.0", "joints.0.rest", "joints.0.child",
    "providers", "providers.0", "providers.0.bodies", "providers.0.field", "providers.0.field.link1",
    "providers.0.field.link1.let", "aero", "environment.gusts", "environment.wind",
    "coupling.step", "coupling.order", "time.end", "name", "time", "log", "unknown",
]  # fmt: skip


@settings(max_examples=200, deadline=None)
@given(key=st.sampled_from(KEYS), junk=JUNK)
def test_no_foreign_exception_leaks(key, junk):
    text = json.dumps(_with(json.loads(load("two_link").to_json()), key, junk))
    try:
        scenario = from_json(text)
    except ScenarioError as error:
        message = str(error)
    else:
        assert from_json(scenario.to_json()) == scenario
        return
    assert all(line.startswith("scenario.json: ") for line in message.splitlines())


def _with(data, key, value):
    """Return the data with the value at a dotted key."""
    container = data
    *parents, last = [int(part) if part.isdigit() else part for part in key.split(".")]
    for part in parents:
        container = container[part] if isinstance(part, int) else container.setdefault(part, {})
    container[last] = value
    return data
