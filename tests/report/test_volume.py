"""Fluid in a box in the report: scales, what the page holds of the vortices, what is drawn."""

import base64
import dataclasses
import io
import re

import numpy as np
import pytest
from PIL import Image

from linkwind import aero
from linkwind.frames import VolumeFrame
from linkwind.log.isosurface import between
from linkwind.log.vortices import criterion, gradient, vortices
from linkwind.report.data import Diagnostics, read
from linkwind.report.gallery import gallery
from linkwind.report.page import render
from linkwind.report.volume import survey_volume
from linkwind.report.volumefilm import TRIANGLES, volume_film
from linkwind.report.volumepicture import slice_png, vortices_png
from linkwind.runs.run import run as fly
from linkwind.scenario import load
from tests.volumes import AXIS, RADIUS, SPEED, START, VolumeModel, hill

from .test_page import Page

STEPS, EVERY = 40, 10
SETTINGS = ["bus.transport=inprocess", f"time.end={STEPS / 1000}", "aero.model=none"]


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(aero.MODELS, "none", lambda scenario, provider: VolumeModel(every=EVERY))
        log = fly(load("two_link", SETTINGS), tmp_path_factory.mktemp("run") / "out", report=False).log
    return read(log)


@pytest.fixture(scope="module")
def page(run):
    return Page(render(run))


def test_a_survey_has_the_times_and_scales(run):
    (volume,) = run.volumes
    assert (volume.provider, volume.t.tolist()) == ("aero", [0.0, 0.01, 0.02, 0.03, 0.04])
    fastest = 2.5 * SPEED  # in the middle of the vortex, in still fluid
    assert 0.7 * fastest < volume.speed < 1.1 * fastest
    assert volume.scale.axis in (1, 2)
    # Of a vortex whose vorticity is 7.5 U r/R² and ends at R.
    assert 0.2 < volume.scale.top / (7.5 * SPEED / RADIUS) < 1.5
    assert survey_volume("aero", lambda: iter([])) is None


def numbers(text, kind):
    return np.frombuffer(base64.b64decode(text), kind)


def test_a_frame_on_the_page_is_the_frame_s_vortices(run, page):
    data, (volume,) = page.data["vortices"], run.volumes
    assert data["t"] == volume.t.tolist()
    assert (data["top"], data["axis"]) == (volume.scale.top, "xyz"[volume.scale.axis])
    assert len(base64.b64decode(data["colours"])) == 3 * 255
    low, high = np.array(data["room"])
    for frame, on_page in zip(volume.frames(), data["frames"], strict=True):
        shown = vortices(frame, volume.scale, TRIANGLES)
        assert on_page["t"] == frame.time_ns / 1e9
        points = np.array(on_page["middle"]) + on_page["unit"] * numbers(on_page["point"], "<i2").reshape(
            -1, 3
        )
        assert np.abs(points - shown.point).max() <= 0.51 * on_page["unit"] + 1e-7
        assert on_page["unit"] < 1e-4 * RADIUS
        assert (points > low - on_page["unit"]).all()
        assert (points < high + on_page["unit"]).all()
        speeds = on_page["fastest"] * numbers(on_page["velocity"], "i1").reshape(-1, 3)
        assert np.abs(speeds - shown.velocity).max() <= 0.51 * on_page["fastest"]
        levels = numbers(on_page["level"], "i1") / 127.0 * data["top"]
        inside = np.abs(shown.vorticity) < data["top"]
        assert np.abs(levels - shown.vorticity)[inside].max() <= 0.51 / 127.0 * data["top"]
        triangles = numbers(on_page["triangle"], "<u2").reshape(-1, 3)
        assert np.array_equal(triangles, shown.triangle)
        assert len(triangles) <= TRIANGLES


def test_between_two_frames_the_surfaces_go_with_the_vortex(run):
    """The fluid of a vortex stays in it: what goes with it is on the surface of a later frame."""
    (volume,) = run.volumes
    since, size = 0.02, {"size": (36, 40, 48), "cell": 0.03}
    now, later = (hill(t, 1_000_000, **size) for t in (0.02, 0.02 + since))
    shown = vortices(now, volume.scale, 10**6)

    def off(point):
        place = ((point - later.origin) / later.cell)[:, ::-1].astype("f4")
        return np.median(np.abs(between(criterion(gradient(later)), place) / volume.scale.level - 1.0))

    assert off(shown.point + since * shown.velocity) < 0.5 * off(shown.point)


def test_the_gallery_shows_vortices_and_a_cut_and_says_what_is_seen(run, page):
    assert page.tags.count("figure") == 2
    caption = page.texts["figcaption"]
    assert "t = 0.01, 0.02, 0.03, 0.04 s" in caption
    assert "The log holds 5 frames." in caption
    assert "60% of all rotation" in caption
    assert f"On the surfaces Q = {run.volumes[0].scale.level:g} 1/s²" in caption
    assert "through the middle of the mechanism" in caption
    sources = [value for name, value in page.attributes if name == "src"]
    images = [
        Image.open(io.BytesIO(base64.b64decode(re.sub("^data:image/png;base64,", "", each))))
        for each in sources
    ]
    vortex, cut = (np.asarray(image.convert("RGB")).reshape(-1, 3).astype(int) for image in images)
    assert min(image.width for image in images) > 1200
    red, blue = ((vortex[:, a] - vortex[:, b] > 60).mean() for a, b in ((0, 2), (2, 0)))
    assert min(red, blue) > 0.001  # both ways around
    assert (vortex.min(axis=1) > 250).mean() < 0.97  # not empty
    assert ((cut[:, 1] - cut[:, 2] > 60).mean()) > 0.01  # the fast fluid is yellow and green


def test_the_cut_is_along_the_stream_and_has_the_speed_of_the_fluid(run):
    (volume,) = run.volumes
    picture, axis = slice_png(run, volume)
    assert axis in "yz"  # the vortex goes along x
    assert picture[3] == [0.01, 0.02, 0.03, 0.04]


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_layer_lies_between_two_of_cells(axis):
    from linkwind.report.volumepicture import _layer

    place = np.stack(np.meshgrid(*(np.arange(float(n)) for n in (4, 5, 6)), indexing="ij"), axis=-1)
    frame = VolumeFrame(0, 0, (1.0, 2.0, 3.0), 0.5, place[..., ::-1].astype("f4"), place[..., 0].astype("f4"))
    found = _layer(frame, axis, frame.origin[axis] + 0.5 * 1.25)
    assert (found[..., axis] == 1.25).all()
    rest = [2 - i for i in range(3) if i != 2 - axis]  # axes of W of what is left, rows first
    assert found[2, 1, rest[0]] == 2.0
    assert found[2, 1, rest[1]] == 1.0
    assert (_layer(frame, axis, 99.0)[..., axis] == frame.shape[2 - axis] - 1).all()


def test_what_is_no_number_and_what_does_not_turn_do_not_end_the_report(run):
    frames = list(run.volumes[0].frames())
    wild = dataclasses.replace(frames[2], velocity=np.full_like(frames[2].velocity, np.nan))
    volume = survey_volume("aero", lambda: iter([*frames[:2], wild]))
    assert len(vortices_png(run, volume)[3]) == 3  # of the last the bodies alone
    still = dataclasses.replace(frames[1], velocity=np.zeros_like(frames[1].velocity))
    alone = survey_volume("aero", lambda: iter([still]))
    page = Page(render(dataclasses.replace(run, volumes=(alone,))))
    assert page.data["vortices"]["room"] is None
    assert numbers(page.data["vortices"]["frames"][0]["triangle"], "<u2").size == 0


def test_a_log_without_the_states_shows_the_vortices_alone(run):
    path = run.trajectory
    nothing = dataclasses.replace(run, trajectory=path._replace(step=path.step + np.uint64(10**6)))
    assert len(vortices_png(nothing, run.volumes[0])[3]) == 4
    assert slice_png(nothing, run.volumes[0]) is None


def test_the_page_is_in_space_and_small(run, page):
    assert page.data["scene"]["planar"] is False
    said = "the surfaces of the vortices go with the fluid"
    assert said in render(run)
    without = dataclasses.replace(run, volumes=())
    assert said not in render(without)
    assert Page(render(without)).data["vortices"] is None
    frames = [hill(1e-3 * k, 1_000_000, size=(60, 60, 70), cell=0.018) for k in range(0, 64, 8)]
    film = volume_film(survey_volume("aero", lambda: iter(frames)))
    largest = max(len(str(frame)) for frame in film["frames"])
    assert 64 * largest < 4e6  # characters: with all that a report may have
    assert np.abs(np.mean(film["room"], axis=0)[1:] - AXIS).max() < 0.05
    assert film["room"][0][0] > START - RADIUS


@pytest.mark.parametrize(("of_a_cell", "said"), [(20.0, False), (400.0, True)])
def test_boundary_layers_thinner_than_a_cell_are_said(run, of_a_cell, said):
    """Of 24 cells along a body a Reynolds number of 400 a cell is one of 9,600."""
    numbers = Diagnostics("aero", ("cell_reynolds",), np.array([0.0, 1.0]), np.array([[1.0], [of_a_cell]]))
    providers = [{**run.scenario["providers"][0], "model": "flow", "flow": {"cells": 24.0}}]
    scenario = {**run.scenario, "providers": providers}
    caption = gallery(dataclasses.replace(run, scenario=scenario, diagnostics=(numbers,)))
    assert f"up to {24.0 * of_a_cell:,.0f}." in caption
    assert ("That of a cell is 400: boundary layers are thinner than a cell" in caption) == said
