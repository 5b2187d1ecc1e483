"""Wings and wakes in the report: which frames and rings, what the page holds of them, what is drawn."""

import base64
import dataclasses
import io
import re

import numpy as np
import pytest
from PIL import Image

from linkwind.frames import WakeFrame
from linkwind.log.rings import thinned
from linkwind.report.data import read
from linkwind.report.page import render
from linkwind.report.wake import shown_times, survey_wake
from linkwind.report.wakefilm import coded
from linkwind.report.wakepicture import wake_png
from linkwind.runs.run import run as fly
from linkwind.scenario import load

from .test_page import Page

STEPS, EVERY, KEPT = 40, 10, 15
SETTINGS = [
    "bus.transport=inprocess", f"time.end={STEPS / 1000}", "aero.model=vortex", "aero.vortex.chordwise=2",
    "aero.vortex.spanwise=3", f"aero.vortex.wake={KEPT}", f"aero.vortex.frames={STEPS // EVERY}",
]  # fmt: skip


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    return read(fly(load("flapper", SETTINGS), tmp_path_factory.mktemp("run") / "out", lambda step: None).log)


@pytest.fixture(scope="module")
def frames(run):
    return list(run.wakes[0].frames())


@pytest.fixture(scope="module")
def page(run):
    return Page(render(run))


def test_a_survey_has_the_times_and_a_round_scale_that_most_rings_fit(run, frames):
    (wake,) = run.wakes
    assert (wake.provider, wake.t.tolist()) == ("aero", [0.0, 0.01, 0.02, 0.03, 0.04])
    strengths = np.abs(np.concatenate([frame.strength[:, 2:].ravel() for frame in frames]))
    assert 0.97 < np.mean(strengths <= wake.circulation) <= 1.0
    assert wake.circulation < 1.3 * strengths.max()
    assert survey_wake("aero", lambda: iter([])) is None


@pytest.mark.parametrize(
    ("t", "expected"),
    [
        (np.linspace(0.0, 2.0, 49), [10, 19, 29, 38, 48]),
        (np.array([0.0, 0.1]), [0, 1]),
        (np.array([0.0]), [0]),
    ],
)
def test_five_times_are_shown_the_last_one_among_them(t, expected):
    assert shown_times(t).tolist() == expected


def straight(step, rows, wings=2, bound=1, columns=2):
    """Edges at x = −(steps behind), rings as strong as the step at which the edge behind them was shed."""
    behind = np.arange(-bound, rows + 1, dtype="f4")
    corner = np.zeros((wings, bound + rows + 1, columns + 1, 3), "f4")
    corner[..., 0] = -behind[:, None]
    strength = np.broadcast_to((step - behind[1:])[:, None], (wings, bound + rows, columns)).astype("f4")
    return WakeFrame(step, step * 1_000_000, bound, corner, strength)


@pytest.mark.parametrize("step", [100, 101, 107])
def test_thinned_wakes_keep_the_same_edges_from_frame_to_frame(step):
    rings = thinned(straight(step, 40), 60)  # of 160: every third row
    assert rings.shed[0] == step
    assert rings.shed[-1] == step - 40
    assert all(shed % 3 == 0 for shed in rings.shed[1:-1])
    assert rings.shed == sorted(rings.shed, reverse=True)
    assert np.array_equal(rings.corner[0, 1:, 0, 0], np.array(rings.shed) - step)
    assert np.array_equal(rings.strength[0, 1:, 0], rings.shed[1:])
    whole = thinned(straight(step, 40), 160)
    assert whole.shed == list(range(step, step - 41, -1))


def test_a_frame_on_the_page_is_the_frame_to_its_last_place(run, frames, page):
    data = page.data["wake"]
    assert data["t"] == run.wakes[0].t.tolist()
    assert data["bodies"] == [run.bodies.index(name) for name in run.scenario["providers"][0]["bodies"]]
    assert (data["step"], data["top"]) == (1e-3, run.wakes[0].circulation)
    assert len(base64.b64decode(data["colours"])) == 3 * 255
    for frame, on_page in zip(frames, data["frames"], strict=True):
        assert on_page["shed"] == list(range(frame.step, frame.step - min(frame.step, KEPT) - 1, -1))
        places = np.frombuffer(base64.b64decode(on_page["corner"]), "<i2").reshape(frame.corner.shape)
        corner = np.array(on_page["middle"]) + on_page["unit"] * places
        assert np.abs(corner - frame.corner).max() <= 0.51 * on_page["unit"]
        assert on_page["unit"] < 2e-5  # m: a wake of a metre
        levels = np.frombuffer(base64.b64decode(on_page["strength"]), "i1").reshape(frame.strength.shape)
        wake = np.abs(levels[:, 2:] / 127.0 * data["top"] - frame.strength[:, 2:])
        assert not wake.size or np.median(wake) <= 0.51 * data["top"] / 127.0


def test_what_is_no_number_does_not_end_the_report(run, frames):
    wild = dataclasses.replace(
        frames[-1], corner=frames[-1].corner.copy(), strength=frames[-1].strength.copy()
    )
    wild.corner[0, 3], wild.strength[1] = (np.inf, np.nan, 1.0), np.nan
    assert np.isfinite(coded(wild, 1.0)["middle"]).all()
    wake = survey_wake("aero", lambda: iter([*frames[:-1], wild]))
    assert len(wake_png(run, wake)[3]) == 3  # of the times 0.01, 0.02, 0.03 and 0.04
    alone = survey_wake("aero", lambda: iter([wild]))
    assert wake_png(run, alone) is None
    assert "Wakes" not in Page(render(dataclasses.replace(run, wakes=(alone,)))).texts.get("figure", "")


def test_the_gallery_shows_the_wakes_and_says_what_is_seen(page):
    assert page.tags.count("figure") == 1
    assert "Wakes" in page.texts["figure"]
    caption = page.texts["figcaption"]
    assert "t = 0.01, 0.02, 0.03, 0.04 s" in caption
    assert "right_wing, left_wing and tail" in caption
    assert f"the last {KEPT} rows, 0.015 s" in caption
    assert "The log holds 5 frames." in caption
    source = next(value for name, value in page.attributes if name == "src")
    image = Image.open(io.BytesIO(base64.b64decode(re.sub("^data:image/png;base64,", "", source))))
    assert image.width > 1500
    drawn = np.asarray(image.convert("RGB")).reshape(-1, 3).astype(int)
    red, blue = ((drawn[:, a] - drawn[:, b] > 60).mean() for a, b in ((0, 2), (2, 0)))
    assert max(red, blue) > 0.002  # rings in colour
    assert (drawn.max(axis=1) < 90).mean() > 0.001  # dark wings
    assert (drawn.min(axis=1) > 250).mean() < 0.97  # not empty


def test_the_page_says_what_is_between_two_frames(run):
    said = "Between two frames of the wakes their lines go straight."
    assert said in render(run)
    assert said not in render(dataclasses.replace(run, wakes=()))


def test_wakes_are_seen_in_space_and_a_run_without_has_none(run, page):
    assert page.data["scene"]["planar"] is False
    without = Page(render(dataclasses.replace(run, wakes=())))
    assert without.data["wake"] is None
    assert "figure" not in without.tags
