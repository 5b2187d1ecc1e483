"""Pictures of the flow: which frames, which scale, where the bodies are, what the page holds of it."""

import base64
import dataclasses
import io
import re
import subprocess
import sys

import numpy as np
import pytest
from matplotlib.colors import to_rgba
from PIL import Image

from linkwind.report import pictures
from linkwind.report.data import Diagnostics, read
from linkwind.report.film import FRAMES, film
from linkwind.report.flow import shown, speed, survey
from linkwind.report.page import render
from linkwind.runs.run import run as fly
from linkwind.scenario import load

from .synthetic import planar
from .test_log import write_log
from .test_page import HOSTILE, Page, unpack
from .wakes import wake

SMALL = {"rows": 56, "columns": 64}


@pytest.fixture(scope="module")
def run():
    return planar(1200)


@pytest.fixture(scope="module")
def frames(run):
    return list(wake(run, every=60, **SMALL))


@pytest.fixture(scope="module")
def flow(frames):
    return survey("aero", lambda: iter(frames))


def with_flow(run, flow, **changes):
    return dataclasses.replace(run, flows=(flow,), **changes)


def test_a_survey_has_the_times_and_round_scales_that_most_values_fit(frames, flow):
    assert flow.t.tolist() == [frame.time_ns / 1e9 for frame in frames]
    speeds = np.concatenate([speed(f).ravel() for f in frames])
    turning = np.abs(np.concatenate([f.vorticity.ravel() for f in frames]))
    assert 0.97 < np.mean(speeds <= flow.speed) < 1.0
    assert turning[turning <= flow.vorticity].sum() == pytest.approx(0.35 * turning.sum(), rel=0.2)
    for top in (flow.speed, flow.vorticity):
        assert float(f"{top:.2g}") == pytest.approx(top, rel=1e-12)


def test_fluid_at_rest_around_it_does_not_change_the_scale(frames, flow):
    def surrounded(frame):
        room = [(40, 40), (60, 60)]
        return dataclasses.replace(
            frame,
            velocity=np.pad(frame.velocity, [*room, (0, 0)]),
            vorticity=np.pad(frame.vorticity, room),
            pressure=np.pad(frame.pressure, room),
        )

    assert survey("aero", lambda: map(surrounded, frames)).vorticity == flow.vorticity


def test_a_frame_that_is_no_number_spoils_no_scale(frames, flow):
    poisoned = dataclasses.replace(frames[-1], vorticity=np.full_like(frames[-1].vorticity, np.nan))
    again = survey("aero", lambda: iter([*frames[:-1], poisoned]))
    assert again.vorticity == pytest.approx(flow.vorticity, rel=0.2)
    still = dataclasses.replace(frames[0], velocity=np.zeros_like(frames[0].velocity))
    assert survey("aero", lambda: iter([still])).speed == 1.0
    assert survey("aero", lambda: iter([])) is None


@pytest.mark.parametrize(
    ("end", "step", "expected"),
    [
        (1.2, 0.02, [0.3, 0.48, 0.6, 0.9, 1.14]),  # 1.2 is too near to the paper's 1.14
        (1.2, 0.025, [0.3, 0.475, 0.6, 0.9, 1.15]),
        (0.4, 0.02, [0.1, 0.2, 0.3, 0.4]),
        (0.6, 0.02, [0.14, 0.3, 0.48, 0.6]),
        (4.0, 0.1, [0.5, 1.1, 2.0, 3.0, 4.0]),
        (0.04, 0.02, [0.0, 0.02, 0.04]),
        (0.0, 0.02, [0.0]),
    ],
)
def test_pictures_are_spread_over_the_run_and_hold_the_paper_s_times(end, step, expected):
    t = np.arange(round(end / step) + 1) * step
    assert t[shown(t)].tolist() == pytest.approx(expected)


def test_the_picture_shows_the_bodies_and_the_hinge_in_their_places(run, frames, flow):
    figure, _ = pictures._figure(run, flow, [frames[8]])
    above, below, *_ = figure.axes
    state = 480
    theta = 2.0 * np.arctan2(run.trajectory.orientation[state, :, 3], run.trajectory.orientation[state, :, 0])
    for ax in (above, below):
        assert ax.get_aspect() == 1.0
        outlines = [line.get_xydata() for line in ax.lines if line.get_color() == pictures.INK]
        for body, outline in enumerate(outlines):
            along = 0.25 * np.array([np.cos(theta[body]), np.sin(theta[body])])
            at = run.trajectory.position[state, body, :2]
            np.testing.assert_allclose(outline, [at - along, at + along], atol=1e-12)
        (hinge,) = [line.get_xydata() for line in ax.lines if line.get_marker() == "o"]
        np.testing.assert_allclose(hinge[0], at - along, atol=1e-9)  # of the second link
    assert above.get_title() == "t = 0.48 s"
    assert (below.get_xlabel(), above.get_ylabel()) == ("x [m]", "y [m]")
    assert [ax.get_ylabel() for ax in figure.axes[2:]] == ["speed [m/s]", "vorticity [1/s]"]


@pytest.mark.parametrize(
    "shape",
    [
        {"type": "ellipse", "length": 0.5, "width": 0.2},
        {"type": "polygon", "points": [[-0.25, -0.1], [0.25, 0.0], [-0.25, 0.1]]},
        None,
    ],
)
def test_a_body_of_any_shape_is_drawn(frames, flow, shape):
    body = {"mass": 2.0, "inertia": 1.4} | ({"shape": shape} if shape else {})
    made = planar(60, bodies=[{"name": "link1", **body}, {"name": "link2", **body}])
    figure, _ = pictures._figure(made, flow, [frames[1]])
    filled = [p for p in figure.axes[0].patches if p.get_facecolor() == to_rgba(pictures.BODY)]
    assert len(filled) == (2 if shape else 0)


def test_a_frame_beyond_the_last_state_is_drawn_without_bodies(frames, flow):
    figure, _ = pictures._figure(planar(60), flow, [frames[-1]])
    assert not figure.axes[0].lines


def test_the_png_is_what_it_says(run, flow):
    data, width, height, times = pictures.png(run, flow)
    with Image.open(io.BytesIO(data)) as image:
        assert (image.format, image.mode, image.size) == ("PNG", "P", (width, height))
    assert times == [0.3, 0.48, 0.6, 0.9, 1.14]
    assert width > 2 * height > 800


def test_a_film_carries_the_values_at_their_places(flow, frames):
    data = film(flow)
    assert np.array_equal(unpack(data["t"]), flow.t)
    assert np.array_equal(unpack(data["extent"], 4), [frame.extent for frame in frames])
    for name, values in (("vorticity", [f.vorticity for f in frames]), ("speed", map(speed, frames))):
        quantity = data["quantities"][name]
        span = quantity["high"] - quantity["low"]
        for picture, expected in zip(quantity["pictures"], values, strict=True):
            with Image.open(io.BytesIO(base64.b64decode(picture))) as image:
                grey = np.asarray(image.convert("L"), float)[::-1]  # the first row has the lowest y
            got = quantity["low"] + grey / 255.0 * span
            off = np.abs(got - np.clip(expected, quantity["low"], quantity["high"]))
            assert np.median(off) < 0.01 * span
            assert np.mean(off) < 0.03 * span
        colours = np.frombuffer(base64.b64decode(quantity["colours"]), np.uint8).reshape(256, 4)
        assert (colours[128, 3] == 0) == (name == "vorticity")  # clear where nothing turns


def test_a_long_film_is_thinned_and_a_large_frame_as_well(run, frames):
    large = next(wake(run, rows=300, columns=600))
    many = survey("aero", lambda: (dataclasses.replace(large, step=k, time_ns=k) for k in range(150)))
    data = film(many)
    times, (picture, *_) = unpack(data["t"]), data["quantities"]["speed"]["pictures"]
    assert (len(times), times[0], times[-1]) == (FRAMES, 0.0, 149e-9)
    with Image.open(io.BytesIO(base64.b64decode(picture))) as image:
        assert image.size == (200, 100)


def test_the_page_shows_the_flow_and_says_what_is_seen(run, flow):
    page = Page(render(with_flow(run, flow)))
    sources = [value for key, value in page.attributes if key == "src"]
    assert len(sources) == 1
    assert sources[0].startswith("data:image/png;base64,")
    (alternative,) = [value for key, value in page.attributes if key == "alt"]
    assert re.fullmatch(
        r"Contours of the speed with streamlines, 0 to \S+ m/s, above contours of the vorticity, ±\S+ 1/s, "
        r"at t = 0\.3, 0\.48, 0\.6, 0\.9, 1\.14 s, with the outlines of link1 and link2\.",
        alternative,
    )
    assert "The log holds 21 frames" in page.texts["figcaption"]
    assert set(page.data["flow"]["quantities"]) == {"vorticity", "speed"}


def test_a_run_without_frames_has_neither_gallery_nor_film(run):
    page = Page(render(run))
    assert "figure" not in page.tags
    assert page.data["flow"] is None


def test_a_page_with_48_large_frames_is_smaller_than_6_megabytes(run):
    rough = 0.3 * np.random.default_rng(1).standard_normal((224, 256)).astype("f4")
    some = [
        dataclasses.replace(frame, vorticity=frame.vorticity + rough)
        for frame in wake(run, every=300, rows=224, columns=256)
    ]
    frames = [dataclasses.replace(some[i // 12], step=25 * i, time_ns=25_000_000 * i) for i in range(48)]
    page = render(with_flow(run, survey("aero", lambda: iter(frames))))
    assert len(page.encode()) < 6e6


def test_numbers_of_a_provider_get_a_row_each(run):
    t = run.trajectory.t
    values = np.column_stack([np.sin(t), np.cos(t)])
    numbers = Diagnostics("aero", ("mach [1]", HOSTILE), t, values)
    page = Page(render(dataclasses.replace(run, diagnostics=(numbers,))))
    panel = page.data["panels"][-1]
    assert panel["title"] == "Reported by aero"
    assert panel["rows"][0]["label"] == "mach [1]"
    assert "<" not in panel["rows"][1]["label"]
    for i, row in enumerate(panel["rows"]):
        np.testing.assert_array_equal(unpack(row["curves"][0]["y"]), values[:, i].astype("f4"))


def test_frames_and_numbers_are_read_from_a_log(tmp_path, run, frames):
    short = planar(60)
    log = write_log(tmp_path / "log.mcap", short, states=61, end=None)
    log.diagnostics({"aero": ("mach [1]",)})
    for frame in frames[:2]:
        log.frame("aero", frame)
    log.close(final_state_sha256="00")
    again = read(tmp_path / "log.mcap")
    assert [flow.provider for flow in again.flows] == ["aero"]
    assert again.flows[0].t.tolist() == [0.0, 0.06]
    assert again.diagnostics == ()  # there is no wrench that carries any
    assert "figure" in Page(render(again)).tags


def test_matplotlib_is_loaded_for_frames_alone(tmp_path):
    code = (
        "import sys; import linkwind.cli; from linkwind.report.page import render;"
        "from tests.report.synthetic import planar; render(planar(10));"
        "assert 'matplotlib' not in sys.modules and 'PIL' not in sys.modules"
    )
    subprocess.run([sys.executable, "-W", "error", "-c", code], check=True)


@pytest.mark.parametrize(
    ("name", "settings", "reynolds"),
    [("cylinder", ("aero.flow.cells=10",), "100"), ("two_link_flow", ("aero.flow.cells=16",), "170,000")],
)
def test_a_page_states_the_reynolds_number_and_where_two_dimensions_end(tmp_path, name, settings, reynolds):
    """U L / ν: 1 · 1 / 0.01, and 5 · 0.5 / 1.5e-5."""
    step = load(name).coupling.step
    few = load(name, ["bus.transport=inprocess", f"time.end={5 * step!r}", *settings])
    page = fly(few, tmp_path / "out", lambda step: None).report.read_text()
    caption = page.split("The log holds", 1)[1].split("</figcaption>")[0]
    assert f"up to {reynolds}." in caption
    assert ("a real wake is three-dimensional" in caption) == (name == "two_link_flow")
