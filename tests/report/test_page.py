"""The page as text: its data, its head, and that nothing in a log can break out of it."""

import base64
import dataclasses
import hashlib
import json
import re
import struct
from html.parser import HTMLParser

import numpy as np
import pytest

from linkwind.report import page as page_module
from linkwind.report.arrays import every_nth
from linkwind.report.data import no_trajectory
from linkwind.report.page import render, script_json
from linkwind.report.panels import POINTS, prefixed
from linkwind.report.scene import FRAMES

from .synthetic import flapper, planar, repeated, run_of, scenario

HOSTILE = "</script><img src=x onerror=alert(1)>&\u2028"


class Page(HTMLParser):
    """Elements and texts of a page; open elements must be closed in order."""

    VOID = frozenset({"meta", "link", "input", "br", "img"})

    def __init__(self, html):
        super().__init__()
        self.tags, self.stack, self.texts, self.attributes = [], [], {}, []
        self.feed(html)
        self.close()
        assert self.stack == []

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        self.attributes += attrs
        if tag not in self.VOID:
            self.stack.append((tag, dict(attrs)))

    def handle_endtag(self, tag):
        assert self.stack.pop()[0] == tag

    def handle_data(self, data):
        for tag, attrs in self.stack:
            for key in (tag, attrs.get("id"), attrs.get("role")):
                self.texts[key] = self.texts.get(key, "") + data

    @property
    def data(self):
        return json.loads(self.texts["data"], parse_constant=pytest.fail)


def unpack(packed, *shape):
    raw = np.frombuffer(base64.b64decode(packed["bdata"]), "<" + packed["dtype"])
    return raw.reshape(-1, *shape)


def rows_of(data):
    return {row["label"]: row for panel in data["panels"] for row in panel["rows"]}


@pytest.fixture(autouse=True, scope="module")
def _short_plotly():
    """Leave out the 5 MB of plotly.js, which only the browser needs and the parser is slow on."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(page_module, "get_plotlyjs", lambda: "/* plotly */")
        yield


@pytest.fixture(scope="module")
def run():
    return planar()


@pytest.fixture(scope="module")
def page(run):
    return Page(render(run))


def test_frames_are_the_trajectory(run, page):
    scene, path = page.data["scene"], run.trajectory
    assert np.array_equal(unpack(scene["t"]), path.t)
    for name, values in (("position", path.position), ("orientation", path.orientation)):
        shown = unpack(scene[name], *values.shape[1:])
        np.testing.assert_allclose(shown, values, rtol=1e-7, atol=1e-12)
    np.testing.assert_allclose(unpack(scene["force"], 2, 3), path.wrench[:, :, :3], rtol=1e-7, atol=1e-12)
    assert scene["planar"]
    assert [body["name"] for body in scene["bodies"]] == ["link1", "link2"]
    assert scene["joints"] == [{"name": "hinge", "body": 1, "point": [-0.25, 0.0, 0.0], "until": None}]


def test_curves_are_the_trajectory(run, page):
    rows, path = rows_of(page.data), run.trajectory
    expected = {
        "V<sub>x</sub> [m/s]": path.linear[:, :, 0],
        "V<sub>y</sub> [m/s]": path.linear[:, :, 1],
        "ω [rad/s]": path.angular[:, :, 2],
        "F<sub>x</sub> [N]": path.wrench[:, :, 0],
        "F<sub>y</sub> [N]": path.wrench[:, :, 1],
        "M [N·m]": path.wrench[:, :, 5],
        "R<sub>x</sub> [N]": path.reaction[:, 1:, 0],
        "R<sub>y</sub> [N]": path.reaction[:, 1:, 1],
    }
    for label, values in expected.items():
        shown = np.column_stack([unpack(curve["y"]) for curve in rows[label]["curves"]])
        np.testing.assert_allclose(shown, values, rtol=1e-7, atol=1e-12)
    assert not any("<sub>z" in label for label in rows)
    assert all(re.search(r" \[.+\]$", label) for label in rows), "a unit on every axis"


def test_a_component_of_round_off_alone_is_drawn_as_zero(run):
    path = run.trajectory
    linear = path.linear.copy()
    linear[:, :, 0] = 1e-15
    noisy = run_of(run.scenario, path._replace(linear=linear), np.ones((len(path.t), 4)))
    rows = rows_of(Page(render(noisy)).data)
    assert not unpack(rows["V<sub>x</sub> [m/s]"]["curves"][0]["y"]).any()
    assert unpack(rows["V<sub>y</sub> [m/s]"]["curves"][0]["y"]).any()


def test_the_energy_balance_of_an_exact_solution_closes(run):
    path = run.trajectory
    assert np.ptp(path.kinetic_energy) > 10.0
    assert np.abs(run.energy_residual).max() < 1e-6


def test_the_energy_residual_counts_each_part_once(run):
    path = run.trajectory
    signs = {"kinetic_energy": 1, "potential_energy": 1, "external_work": -1, "dissipated_work": 1}
    for name, sign in signs.items():
        more = path._replace(**{name: getattr(path, name) + path.t})
        changed = dataclasses.replace(run, trajectory=more).energy_residual - run.energy_residual
        np.testing.assert_allclose(changed, sign * path.t, atol=1e-12)


def test_the_head_sums_the_run_up(run, page):
    path = run.trajectory
    fields = (path.position, path.orientation, path.linear, path.angular)
    numbers = [number for b in range(2) for field in fields for number in field[-1, b]]
    digest = hashlib.sha256(struct.pack("<26d", *numbers)).hexdigest()
    head, body = page.texts["header"], page.texts["body"]
    force = max(np.hypot(*path.wrench[k, b, :2]) for k in range(len(path.t)) for b in range(2))
    for shown in ("two_link_gust", "complete", "1200 steps of 1 ms", "1.2 s", f"{force:.3g} N", digest[:8]):
        assert shown in head
    assert digest in body
    assert "alert" not in page.texts


def test_nothing_is_loaded_from_elsewhere(page):
    loads = ("src", "href", "srcset", "action")
    loading = [(name, value) for name, value in page.attributes if name in loads]
    assert loading == [("href", "data:,")]
    policy = next(value for name, value in page.attributes if name == "content" and "default-src" in value)
    assert "default-src 'none'" in policy
    assert not re.search(r"https?:|\*|connect-src", policy)
    assert "@import" not in page.texts["style"]
    assert "url(" not in page.texts["style"]


def test_hostile_names_stay_text():
    run = planar(20, name=HOSTILE, description=HOSTILE)
    for body in run.scenario["bodies"]:
        body["name"] += HOSTILE
    joint = run.scenario["joints"][0]
    joint |= {"name": HOSTILE, "parent": "link1" + HOSTILE, "child": "link2" + HOSTILE}
    run.scenario["environment"][HOSTILE] = HOSTILE
    hostile = {"complete": False, "error": HOSTILE, "versions": {HOSTILE: HOSTILE}}
    page = Page(render(dataclasses.replace(run, **hostile)))
    assert page.tags.count("script") == 3
    assert "img" not in page.tags
    assert page.texts["h1"] == page.texts["alert"].split("to t = 0.02 s.")[1] == HOSTILE
    assert page.data["scene"]["bodies"][0]["name"] == "link1" + HOSTILE


def test_data_in_a_script_element_cannot_end_it():
    text = script_json({"a": HOSTILE, "b": "<!--<script>"})
    assert not re.search("[<>&]", text)
    assert json.loads(text) == {"a": HOSTILE, "b": "<!--<script>"}


def test_a_value_that_json_lacks_is_an_error():
    with pytest.raises(ValueError, match="JSON"):
        script_json({"a": float("nan")})


def test_an_incomplete_run_says_what_ended_it():
    run = dataclasses.replace(planar(431), complete=False, error='no Wrench from "aero" for step 432')
    page = Page(render(run))
    assert "431 of 1200 steps, to t = 0.431 s" in page.texts["alert"]
    assert 'no Wrench from "aero" for step 432' in page.texts["alert"]
    assert "incomplete" in page.texts["header"]


def test_a_log_without_an_end_says_so():
    page = Page(render(dataclasses.replace(planar(3), complete=False, error=None)))
    assert "killed, or is still going on" in page.texts["alert"]


def test_a_log_without_a_state_still_has_a_page():
    run = planar(3)
    names = ("coupling_time", "order", "extrapolation_error", "interface_energy", "exchange")
    nothing = {name: getattr(run, name)[:0] for name in names}
    nothing |= {"trajectory": no_trajectory(2), "complete": False, "error": "never came"}
    page = Page(render(dataclasses.replace(run, **nothing)))
    assert page.data == {"scene": None}
    assert "not even the first state" in page.texts["alert"]
    assert "never came" in page.texts["alert"]


def test_one_state_is_enough():
    page = Page(render(planar(0)))
    assert unpack(page.data["scene"]["t"]).tolist() == [0.0]


def test_numbers_that_are_not_finite_reach_the_page():
    run = planar(9)
    linear = run.trajectory.linear.copy()
    linear[5, 0, 0], linear[6, 0, 0], linear[7, 0, 0] = np.nan, np.inf, 1e300
    wrench = np.full_like(run.trajectory.wrench, np.nan)
    broken = run.trajectory._replace(linear=linear, wrench=wrench)
    page = Page(render(dataclasses.replace(run, trajectory=broken)))
    shown = unpack(rows_of(page.data)["V<sub>x</sub> [m/s]"]["curves"][0]["y"])
    np.testing.assert_allclose(shown[:5], linear[:5, 0, 0], rtol=1e-7)
    assert np.isnan(shown[5])
    assert shown[6] == shown[7] == np.inf


def test_a_run_in_three_dimensions_has_the_third_component():
    page = Page(render(flapper(200)))
    rows = rows_of(page.data)
    symbols = {"V": "m/s", "ω": "rad/s", "F": "N", "M": "N·m", "R": "N"}
    expected = {f"{s}<sub>{axis}</sub> [{unit}]" for s, unit in symbols.items() for axis in "xyz"}
    assert expected <= set(rows)
    scene = page.data["scene"]
    assert not scene["planar"]
    assert scene["up"] == "z"
    times, air = unpack(scene["t"]), unpack(scene["air"]).reshape(-1, 3)  # -1 + sin(2π 2 t), everywhere
    np.testing.assert_allclose(air, np.sin(4 * np.pi * times)[:, None] * [1, 0, 0] - [1, 0, 0], atol=1e-6)


def test_a_wind_that_changes_is_shown_as_it_is_at_the_bodies():
    """The two links are equally heavy: their centre is the mean of their places."""
    run = planar(200)
    rows = [[0.0, 1.0], [0.6, 4.0], [1.2, 1.0]]
    wind = [{"expression": "-2 + 0.5*y*t"}, {"table": rows}, 0.5]
    environment = run.scenario["environment"] | {"wind": wind}
    page = Page(render(dataclasses.replace(run, scenario=run.scenario | {"environment": environment})))
    scene = page.data["scene"]
    air, t = unpack(scene["air"]).reshape(-1, 3), run.trajectory.t
    height = run.trajectory.position[:, :, 1].mean(axis=1)
    expected = np.stack(
        [-2.0 + 0.5 * height * t, np.interp(t, *np.transpose(rows)), np.full(201, 0.5)], axis=1
    )
    np.testing.assert_allclose(air, expected, atol=1e-6)
    np.testing.assert_allclose(scene["wind"], expected.mean(axis=0), atol=1e-9)
    assert "-2 + 0.5*y*t" in page.texts["td"]
    steady = Page(render(run)).data["scene"]
    assert (steady["wind"], steady["air"]) == ([-5.0, 0.0, 0.0], None)


def test_a_wind_has_the_inputs_of_the_scenario():
    run = planar(20)
    wind = {"wind": [{"expression": "-2*u"}, 0.0, 0.0], "inputs": {"u": 1.5}}
    scenario = run.scenario | {"environment": run.scenario["environment"] | wind}
    scene = Page(render(dataclasses.replace(run, scenario=scenario))).data["scene"]
    assert scene["wind"] == [-3.0, 0.0, 0.0]


def test_a_wind_that_cannot_be_read_is_not_shown():
    run = planar(20)
    environment = run.scenario["environment"] | {"wind": [{"expression": HOSTILE}, 0.0, 0.0]}
    scene = Page(render(dataclasses.replace(run, scenario=run.scenario | {"environment": environment}))).data[
        "scene"
    ]
    assert scene["wind"] == [0.0, 0.0, 0.0]
    assert np.isnan(unpack(scene["air"])).all()


def test_what_stands_still_is_drawn_where_it_is():
    run = planar(5)
    floor = {"type": "box", "size": [4.0, 0.2, 2.0], "position": [1.0, -3.0, 0.0]}
    environment = run.scenario["environment"] | {"picture": [floor]}
    page = Page(render(dataclasses.replace(run, scenario=run.scenario | {"environment": environment})))
    points = np.vstack([line["points"] for line in page.data["scene"]["still"]])
    assert (points.min(axis=0).tolist(), points.max(axis=0).tolist()) == ([-1, -3.1, -1], [3, -2.9, 1])
    assert Page(render(run)).data["scene"]["still"] == []


def test_without_joints_there_is_no_joint_panel():
    page = Page(render(planar(5, joints=[])))
    assert "Joint forces" not in [panel["title"] for panel in page.data["panels"]]


def test_a_long_run_is_thinned_but_keeps_its_peaks(run):
    long = repeated(run, 9)
    force = long.trajectory.wrench.copy()
    force[7777, 0, 0], force[5555, 1, 0] = 9e3, -8e3  # one sample each
    long = dataclasses.replace(long, trajectory=long.trajectory._replace(wrench=force))
    page = Page(render(long))
    scene, rows = page.data["scene"], rows_of(page.data)
    frames = every_nth(len(long.trajectory.t), FRAMES)
    assert len(frames) <= FRAMES
    assert np.array_equal(unpack(scene["t"]), long.trajectory.t[frames])
    shown = unpack(scene["position"], 2, 3)
    np.testing.assert_allclose(shown, long.trajectory.position[frames], rtol=1e-7, atol=1e-12)
    for label, axis in (("F<sub>x</sub> [N]", 0), ("F<sub>y</sub> [N]", 1)):
        for b, curve in enumerate(rows[label]["curves"]):
            x, y, all_of_it = unpack(curve["x"]), unpack(curve["y"]), force[:, b, axis].astype("f4")
            assert len(x) == len(y) <= POINTS
            assert (y.min(), y.max()) == (all_of_it.min(), all_of_it.max())
            assert (x[0], x[-1]) == (long.trajectory.t[0], long.trajectory.t[-1])
            assert np.array_equal(y, all_of_it[np.round(x * 1e3).astype(int)])
            mean = np.dot(unpack(curve["means"]), np.diff(x)) / x[-1]
            assert mean == pytest.approx(np.convolve(force[:, b, axis], [0.5, 0.5], "valid").mean(), rel=1e-5)
    assert f"The run has {len(long.trajectory.t)} states" in page.texts["body"]
    assert f"a curve at most {POINTS} points" in page.texts["body"]
    assert not unpack(page.data["t"]).size  # no curve needs them


def test_times_are_in_the_page_once_while_curves_are_whole(run):
    """2,402 states: more than a thinned curve has, but whole they take fewer bytes."""
    page = Page(render(repeated(run, 2)))
    curves = [
        c
        for panel in page.data["panels"]
        for row in panel["rows"]
        if not row.get("bars")
        for c in row["curves"]
    ]
    assert {unpack(curve["y"]).size for curve in curves} == {2402} == {unpack(page.data["t"]).size}
    assert not any("x" in curve for curve in curves)
    assert "The animation shows at most" in page.texts["body"]
    assert "a curve at most" not in page.texts["body"]


def test_curves_of_a_step_of_ten_microseconds_keep_their_times(run):
    path = run.trajectory._replace(t=1000.0 + np.arange(len(run.trajectory.t)) * 1e-5)
    page = Page(render(dataclasses.replace(run, trajectory=path)))
    assert np.array_equal(unpack(page.data["t"]), path.t)


@pytest.mark.parametrize(
    ("value", "factor", "unit"),
    [(0.0, 1.0, "m"), (2.5, 1.0, "m"), (3e-10, 1e12, "pm"), (4e-17, 1e15, "fm"), (1500.0, 1e-3, "km")],
)
def test_units_get_the_prefix_that_suits_the_value(value, factor, unit):
    assert prefixed(value, "m") == (pytest.approx(factor), unit)


def test_bodies_without_a_shape_are_drawn_by_their_joints_or_their_radius_of_gyration():
    bodies = [{"name": name, "mass": 2.0, "inertia": 0.5} for name in ("link1", "link2")]
    jointed = Page(render(planar(2, bodies=bodies))).data["scene"]["bodies"]
    assert jointed[0]["lines"][0]["points"] == [[-0.25, 0, 0], [0.25, 0, 0]]
    loose = Page(render(planar(2, bodies=bodies, joints=[]))).data["scene"]["bodies"]
    np.testing.assert_allclose(np.linalg.norm(loose[0]["lines"][0]["points"], axis=1), 0.5)


def test_a_body_without_a_shape_does_not_hide_those_that_have_one():
    """The carriage of a foil of 1 m is drawn half as wide, whatever its inertia is."""
    bodies = [
        {"name": "link1", "mass": 2.0, "inertia": 50.0},
        {
            "name": "link2",
            "mass": 2.0,
            "inertia": 0.5,
            "shape": {"type": "plate", "length": 1.0, "span": 9.0},
        },
    ]
    carriage, _ = Page(render(planar(2, bodies=bodies, joints=[]))).data["scene"]["bodies"]
    np.testing.assert_allclose(np.linalg.norm(carriage["lines"][0]["points"], axis=1), 0.25)


def test_a_wing_is_drawn_as_its_planform_and_filled_where_it_is():
    """A dart: the triangle across its notch, of the corners 1, 2 and 3, is none of those that fill it."""
    wing = {"type": "wing", "points": [[1.0, 0.0], [2.0, 3.0], [1.0, 1.0], [0.0, 3.0]]}
    bodies = [{"name": name, "mass": 2.0, "inertia": 0.5, "shape": wing} for name in ("link1", "link2")]
    body, _ = Page(render(planar(2, bodies=bodies))).data["scene"]["bodies"]
    assert body["lines"] == [{"points": [[1, 0, 0], [2, 0, 3], [1, 0, 1], [0, 0, 3]], "closed": True}]
    assert sorted(sorted(ear) for ear in body["ends"]) == [[0, 1, 2], [0, 2, 3]]
    assert body["thick"]


def test_an_ellipsoid_is_a_ball_for_views_in_space_unless_a_picture_is_there():
    shape = {"type": "ellipsoid", "size": [0.5, 0.2, 0.3]}
    bodies = [{"name": name, "mass": 2.0, "inertia": 0.5, "shape": shape} for name in ("link1", "link2")]
    bodies[1]["picture"] = [{"type": "box", "size": [1.0, 1.0, 1.0]}]
    found = Page(render(planar(2, bodies=bodies))).data["scene"]["bodies"]
    assert [body["ball"] for body in found] == [[0.5, 0.2, 0.3], None]


def test_the_tables_hold_the_scenario(page):
    described = scenario()
    raw = json.loads(page.texts["pre"])
    assert raw == described
    for text in ("hinge", "revolute", "(-0.25, 0, 0)", "plate, length 0.5 m, span 1 m", "mass [kg]", "zenoh"):
        assert text in page.texts["table"]
