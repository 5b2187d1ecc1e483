"""A scenario goes through JSON without losing a bit."""

import json
import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError

from linkwind.scenario import builtin_names, from_json, load, loads, template
from tests.scenario.texts import BUILTIN

FLOATS = st.floats(allow_nan=False, allow_infinity=False)
POSITIVE = st.floats(min_value=0, exclude_min=True, allow_infinity=False)
VECTORS = st.lists(FLOATS, min_size=2, max_size=3)
NAMES = st.from_regex(r"[A-Za-z][A-Za-z0-9_]{0,8}", fullmatch=True).filter(lambda name: name != "world")


@st.composite
def quaternions(draw):
    angle, height, turn = (draw(st.floats(0, 2 * math.pi)) for _ in range(3))
    axis = (
        math.sin(height) * math.cos(turn),
        math.sin(height) * math.sin(turn),
        math.cos(height),
    )
    return [math.cos(angle / 2), *(math.sin(angle / 2) * part for part in axis)]


@st.composite
def scenarios(draw):
    names = draw(st.lists(NAMES, min_size=1, max_size=5, unique=True))
    bodies = []
    for name in names:
        body = {"name": name, "mass": draw(POSITIVE), "inertia": draw(POSITIVE)}
        body |= draw(st.sampled_from([{}, {"angle_deg": draw(FLOATS)}, {"orientation": draw(quaternions())}]))
        optional = {
            "position": VECTORS,
            "velocity": VECTORS,
            "angular_velocity": FLOATS | st.lists(FLOATS, min_size=3, max_size=3),
            "shape": st.fixed_dictionaries({"type": st.just("plate"), "length": POSITIVE, "span": POSITIVE}),
        }
        body |= {key: draw(kind) for key, kind in optional.items() if draw(st.booleans())}
        bodies.append(body)
    let = draw(st.lists(st.tuples(NAMES, st.text(max_size=10)), max_size=4, unique_by=lambda pair: pair[0]))
    provider = {
        "name": draw(NAMES),
        "model": "field",
        "field": {names[0]: {"fx": draw(st.text(max_size=10)), "let": [list(pair) for pair in let]}},
    }
    step_ns, steps = draw(st.integers(1, 10**9)), draw(st.integers(1, 100))
    return {
        "name": draw(NAMES),
        "description": draw(st.text(max_size=20)),
        "time": {"end": float(f"{steps * step_ns}e-9")},
        "coupling": {"step": float(f"{step_ns}e-9"), "timeout": draw(POSITIVE)},
        "environment": {
            "gravity": draw(VECTORS),
            "gusts": [{"amplitude": draw(VECTORS), "frequency": draw(FLOATS)}],
        },
        "bodies": bodies,
        "providers": [provider],
        "joints": [
            {
                "name": f"j{i}",
                "type": draw(st.sampled_from(["fixed", "revolute"])),
                "parent": draw(st.sampled_from(["world", *names[:i]])),
                "child": names[i],
                "stiffness": draw(POSITIVE),
                "rest": draw(st.lists(FLOATS, max_size=3)),
            }
            for i in range(1, len(names))
        ],
    }, (step_ns, steps)


@settings(max_examples=100, deadline=None)
@given(scenarios())
def test_any_scenario_survives_json(drawn):
    data, (step_ns, steps) = drawn
    scenario = from_json(json.dumps(data))
    text = scenario.to_json()
    again = from_json(text)
    assert again == scenario
    assert again.to_json() == text
    assert (scenario.coupling.step_ns, scenario.steps) == (step_ns, steps)
    for body, given_body in zip(scenario.bodies, data["bodies"], strict=True):
        assert body.mass == given_body["mass"]  # every bit
        if "position" in given_body:
            assert list(body.position)[: len(given_body["position"])] == given_body["position"]
    first = data["bodies"][0]["name"]
    expressions = again.providers[0].field[first]
    assert [list(pair) for pair in expressions.let.items()] == data["providers"][0]["field"][first]["let"]


@pytest.mark.parametrize("name", sorted(BUILTIN))
def test_builtins_survive_json(name):
    scenario = load(name)
    assert from_json(scenario.to_json()) == scenario


def test_the_json_is_canonical():
    text = load("two_link").to_json()
    data = json.loads(text)
    assert text == json.dumps(data, sort_keys=True, ensure_ascii=False, separators=(",", ":"))
    reordered = json.dumps(dict(reversed(list(data.items()))))
    assert from_json(reordered).to_json() == text


def test_definitions_keep_their_order():
    let = load("two_link_gust").providers[0].field["link1"].let
    again = from_json(load("two_link_gust").to_json()).providers[0].field["link1"].let
    assert list(again) == list(let) == ["gx", "gy", "ux", "uy", "un", "ue", "u", "fn", "fe"]


def test_a_scenario_is_frozen():
    scenario = load("two_link")
    with pytest.raises(ValidationError):
        scenario.bodies[0].mass = 3.0
    with pytest.raises(ValidationError):
        scenario.time = None


def test_a_path_and_a_name_load_the_same(tmp_path):
    path = tmp_path / "two_link.toml"
    path.write_text(BUILTIN["two_link"], encoding="utf-8")
    assert load(path) == load(str(path)) == load("two_link")


def test_builtin_names():
    assert builtin_names() == [
        "andrews",
        "bricard",
        "chain",
        "cylinder",
        "falling_plate",
        "flapper",
        "flapper_wake",
        "flutter",
        "four_bar",
        "fruit_fly",
        "stage_separation",
        "two_link",
        "two_link_field",
        "two_link_flow",
        "two_link_flow_free",
        "two_link_free",
        "two_link_gust",
        "vortex_induced_vibration",
    ]


def test_the_template_loads_and_is_valid():
    scenario = loads(template(), "template.toml")
    assert scenario.name == "pendulum"
    assert scenario.steps == 2000


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("dir/my_wing.toml", "my_wing"),
        ("my wing.toml", "my_wing"),
        ("-x.toml", "_x"),
        ("v1.2.toml", "v1.2"),
    ],
)
def test_the_file_names_the_scenario(name, expected):
    assert loads(BUILTIN["two_link"], name).name == expected
