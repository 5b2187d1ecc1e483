"""What a user is told before a run that may not do what was meant."""

from __future__ import annotations

import logging
import math

import pytest

from linkwind import aero
from linkwind.aero.doubts import doubts, doubts_after
from linkwind.errors import LinkwindError
from linkwind.report.data import read
from linkwind.report.gallery import gallery
from linkwind.runs.run import run
from linkwind.scenario import builtin_names, load

LIGHT = [
    "coupling.step=1e-3",
    "aero.flow.cells=16",
    *(f"bodies.link{i}.{setting}" for i in (1, 2) for setting in ("mass=0.1", "inertia=0.002")),
]


@pytest.mark.parametrize("name", builtin_names())
def test_there_are_none_about_what_comes_along(name: str) -> None:
    assert list(doubts(load(name))) == []


@pytest.mark.parametrize(
    ("settings", "told"),
    [
        (["environment.wind=[-50,0,0]"], True),
        (["environment.gusts=[{amplitude=[1,0,0],frequency=1}]"], True),
        (["environment.wind=['y',0,0]"], True),
        (["environment.wind=[-50,0,0]", "aero.model=none"], False),
        (["environment.wind=[-50,0,0]", "aero.model=plate"], False),
    ],
)
def test_a_wind_that_nobody_reads(settings: list[str], told: bool, caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.WARNING, "linkwind"):
        aero.check(load("two_link_field", settings))
    expected = "note: two_link_field.toml: environment: the wind moves nothing here"
    assert [record.getMessage().startswith(expected) for record in caplog.records] == [True] * told


def test_bodies_too_light_for_several_lattice_steps(tmp_path, caplog: pytest.LogCaptureFixture) -> None:
    """The doubt names a step that helps, and the run without that step does diverge."""
    scenario = load("two_link_flow", ["bus.transport=inprocess", "time.end=0.2", *LIGHT])
    with caplog.at_level(logging.WARNING, "linkwind"), pytest.raises(LinkwindError):
        run(scenario, tmp_path / "out", lambda step: None)
    first, second = (record.getMessage() for record in caplog.records[:2])
    assert 'aero.flow.cells: "link1", 0.1 kg, accelerates about 0.24 kg of fluid' in first
    assert '"link2"' in second
    advised = float(first.rsplit("use at most ", 1)[1].split(" s")[0])
    assert list(doubts(load("two_link_flow", [*LIGHT, f"coupling.step={advised}"]))) == []


def test_heavy_ones_go_on(caplog: pytest.LogCaptureFixture) -> None:
    assert list(doubts(load("two_link_flow", LIGHT[:2]))) == []


@pytest.mark.parametrize(
    ("cells", "told"),
    [
        (24.0, '_wing" has 7.53 cells, and with less than 10 forces are far off'),
        (31.8, "Use at least 32."),
        (32.0, None),
    ],
)
def test_wings_of_few_cells_in_space(cells: float, told: str | None) -> None:
    """The mean chord of the wings is 0.848 mm of the body's 2.7: 10 cells along it are 31.9 along that."""
    found = list(doubts(load("fruit_fly", [f"aero.flow.cells={cells}"])))
    assert len(found) == (told is not None)
    assert all(doubt.startswith("fruit_fly.toml: aero.flow.cells: ") and told in doubt for doubt in found)


def test_in_the_plane_few_cells_are_nothing_to_tell() -> None:
    assert list(doubts(load("two_link_flow", ["aero.flow.cells=9"]))) == []


@pytest.mark.parametrize(
    ("settings", "told"),
    [
        (["coupling.step=2e-3"], None),
        (
            ["coupling.step=1e-2"],
            "in a step, and as long are the rings of its wake; one is enough. Use about",
        ),
        (["coupling.step=2e-3", "aero.vortex.spanwise=90"], "a step asks for 1620 equations to be solved"),
        (["coupling.step=1e-3", "aero.vortex.wake=30"], "30 rows reach 2.7 chords behind the wings"),
    ],
)
def test_wakes_that_are_coarse_or_short(settings: list[str], told: str | None) -> None:
    """At 9 m/s the chord of the tail, 0.1 m, takes 11 ms, a panel of six 1.9 ms."""
    found = list(doubts(load("flapper", ["aero.model=vortex", *settings])))
    assert len(found) == (told is not None)
    assert all(told in doubt for doubt in found if told)


@pytest.mark.parametrize(("frequency", "told"), [(100.0, False), (-300.0, True), (5000.0, True)])
def test_gusts_that_are_over_in_a_few_steps(frequency: float, told: bool) -> None:
    """At 1 ms a gust of 300 Hz takes 3.3 steps; 8 of them would be 0.42 ms."""
    gust = f"environment.gusts=[{{amplitude=[1,0,0],frequency={frequency}}}]"
    found = list(doubts(load("two_link", [gust])))
    assert [doubt.startswith("two_link.toml: environment.gusts[0].frequency:") for doubt in found] == [
        True
    ] * told
    if frequency == -300.0:
        assert "takes 3.3 steps of 0.001 s" in found[0]
        assert "coupling.step of 0.00042 s or less" in found[0]


@pytest.mark.parametrize(
    ("table", "told"),
    [
        (
            "[[0, 1], [0.9, 2]]",
            ["goes from 0 to 0.9 s and the run from 0 to 1.2 s; beyond 0.9 s it stays at 2"],
        ),
        (
            "[[0.3, 1], [1.2, 2]]",
            ["goes from 0.3 to 1.2 s and the run from 0 to 1.2 s; beyond 0.3 s it stays"],
        ),
        ("[[0, 1], [1.2, 2]]", []),
        ("[[0, 1], [0.5, 2], [0.6, 2]]", []),  # meant to stay there
        ("[[0, 1], [0.5, 2], [0.6, 1]], periodic = true", []),
    ],
)
def test_tables_that_are_shorter_than_the_run(table: str, told: list[str]) -> None:
    found = list(doubts(load("two_link", [f"environment.wind.0={{ table = {table} }}"])))
    assert len(found) == len(told)
    assert all(doubt.startswith("two_link.toml: environment.wind[0].table: it ") for doubt in found)
    assert all(text in doubt for text, doubt in zip(told, found, strict=True))


@pytest.mark.parametrize(("frequency", "told"), [(110.0, False), (300.0, True), (4900.0, True)])
def test_winds_that_are_over_in_a_few_steps(frequency: float, told: bool) -> None:
    """As gusts: eight steps of 1 ms in a cycle are 125 Hz, and 300 Hz want 0.42 ms."""
    found = list(doubts(load("two_link", [f"environment.wind.1=2 + 0.5*sin(2*pi*{frequency}*t)"])))
    expected = "two_link.toml: environment.wind[1]: within a step of 0.001 s it goes up to "
    assert [doubt.startswith(expected) for doubt in found] == [True] * told
    if frequency == 300.0:
        assert 0.35e-3 < float(found[0].rsplit("of about ", 1)[1].split(" s")[0]) < 0.45e-3


def test_a_profile_over_height_is_nothing_to_tell() -> None:
    assert list(doubts(load("two_link", ["environment.wind.0=-5*(max(y,0.1)/10)**0.14"]))) == []


@pytest.mark.parametrize(
    ("setting", "told"),
    [
        ("joints.hinge.rest=45", 'joints[0] "hinge".rest: 45 rad is 2578°, more than a turn'),
        ("joints.hinge.stop=[-90,90]", "If it is meant in degrees, write -1.571."),
        ("joints.hinge.rest=0.785", None),
    ],
)
def test_angles_that_look_like_degrees(setting: str, told: str | None) -> None:
    found = list(doubts(load("two_link", [setting])))
    assert bool(found) == (told is not None)
    assert told is None or any(told in doubt for doubt in found)


@pytest.mark.parametrize(("angle", "told"), [(30.0, True), (17.0, False)])
def test_a_wing_far_beyond_what_the_wake_model_knows(angle: float, told: bool, tmp_path, caplog) -> None:
    """The wing hardly moves in two steps: its angle of attack is that of the wind."""
    wind = [7.5, 7.5 * math.tan(math.radians(angle)), 0.0]
    changes = [
        "bus.transport=inprocess",
        "time.end=5e-3",
        f"environment.wind={wind}",
        "aero.vortex.spanwise=2",
    ]
    with caplog.at_level(logging.WARNING, "linkwind"):
        done = run(load("flutter", changes), tmp_path / "out", report=False)
    assert done.result.reported_max["aero"]["incidence_deg"] == pytest.approx(angle, abs=0.4)
    notes = [note for note in (record.getMessage() for record in caplog.records) if "angle of attack" in note]
    expected = (
        "note: flutter.toml: aero.model: the largest angle of attack was 30°; from some 15° on a real flow "
        "separates, which model vortex does not know."
    )
    assert notes == [expected] * told
    caption = gallery(read(done.log))
    assert f"Largest angle of attack: {angle:.0f}°." in caption
    assert ("a real flow separates" in caption) == told


@pytest.mark.parametrize(
    ("changes", "advance", "told"),
    [
        ([], 2.5, 'coupling.step: the fastest point of a wing went 2.5 panels of "aero" in a step'),
        ([], 0.2, "aero.vortex.wake: 60 rows reach 2.4 chords behind the fastest point"),  # 60 · 0.2 / 5
        ([], 0.9, None),
        ([], math.nan, None),
        (["environment.wind=[-50,0,0]"], 8.0, None),  # was told before the run
    ],
)
def test_a_wake_that_is_too_coarse_or_too_short_by_the_beat_of_the_wings(changes, advance, told):
    """A wing that is at rest at the start, in still air, tells nothing of it before the run."""
    scenario = load("flapper_wake", ["bodies.body.velocity=[0,0,0]", *changes])
    found = list(doubts_after(scenario, {"aero": {"incidence_deg": 5.0, "advance": advance}}))
    assert len(found) == (told is not None)
    assert told is None or told in found[0]
