"""The page in a real browser: it plays, pauses, scrubs, zooms, and asks the network for nothing."""

import dataclasses
import sys

import numpy as np
import pytest

from linkwind.report.flow import survey
from linkwind.report.page import render

from .chromium import PROGRAM, Chromium
from .synthetic import flapper, planar, repeated
from .wakes import wake

pytestmark = pytest.mark.skipif(
    PROGRAM is None or sys.platform == "win32", reason="needs chromium: apt-get install chromium"
)

T = "Number(document.getElementById('time').value.replace(' s', ''))"
LABEL = "document.getElementById('play').getAttribute('aria-label')"
CURSORS = "[...document.querySelectorAll('.cursor')].map(c => new DOMMatrix(getComputedStyle(c).transform).e)"


@pytest.fixture(scope="module")
def pages(tmp_path_factory):
    folder = tmp_path_factory.mktemp("pages")
    runs = {"planar": planar(400), "flapper": flapper(200), "single": planar(0, name="single")}
    linear = runs["planar"].trajectory.linear.copy()
    linear[50:] = np.nan
    diverged = runs["planar"].trajectory._replace(
        linear=linear, position=linear, wrench=np.dstack([linear] * 2)
    )
    runs["diverged"] = dataclasses.replace(
        planar(400, name="diverged"), trajectory=diverged, complete=False, error="NaN"
    )
    away = runs["planar"].trajectory.position + np.array([12345.0, 0.0, 0.0])
    runs["far"] = dataclasses.replace(
        planar(400, name="far"), trajectory=runs["planar"].trajectory._replace(position=away)
    )
    small = {"linear": 3e-4 * runs["planar"].trajectory.linear, "joint_gap": np.full(401, 6e-19)}
    runs["wide"] = dataclasses.replace(
        planar(400, name="wide"), trajectory=runs["planar"].trajectory._replace(**small)
    )
    spike = runs["planar"].trajectory.linear.copy()
    spike[:3] = 1000.0
    runs["spike"] = dataclasses.replace(
        planar(400, name="spike"), trajectory=runs["planar"].trajectory._replace(linear=spike)
    )
    wrench = runs["planar"].trajectory.wrench.copy()
    wrench[:2] *= 1000.0
    runs["impulse"] = dataclasses.replace(
        planar(400, name="impulse"), trajectory=runs["planar"].trajectory._replace(wrench=wrench)
    )
    runs["thinned"] = thinned()
    flow = survey("aero", lambda: wake(planar(400), every=50, rows=56, columns=64))
    runs["flow"] = dataclasses.replace(planar(400, name="flow"), flows=(flow,))
    for name, run in runs.items():
        (folder / f"{name}.html").write_text(render(run), encoding="utf-8")
    return folder


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    chromium = Chromium(tmp_path_factory.mktemp("profile"))
    size = {"width": 1400, "height": 1000, "deviceScaleFactor": 1, "mobile": False}
    chromium.send("Emulation.setDeviceMetricsOverride", **size)
    yield chromium
    chromium.close()


def thinned():
    """Return a run of more states than a curve has points on the page, with a spike at every 9th."""
    run = repeated(planar(400, name="thinned"), 40)
    linear = run.trajectory.linear.copy()
    linear[::9] += 50.0
    return dataclasses.replace(run, trajectory=run.trajectory._replace(linear=linear))


@pytest.fixture
def page(browser, pages):
    """The planar run at its start, paused; loaded once for all tests, because loading is what takes time."""
    if browser.evaluate("document.title") != "two_link_gust · linkwind":
        browser.open(pages / "planar.html")
    browser.evaluate("document.activeElement.blur()")
    browser.key("Home")
    assert browser.evaluate(T) == 0.0
    return browser


def scrub(browser, frame):
    browser.evaluate(f"scrub.value = {frame}; scrub.dispatchEvent(new Event('input'))")


def picture(browser):
    return browser.evaluate("document.getElementById('scene').toDataURL()")


def plot_box(browser, index=0):
    """Return left, top, width and height of the axes of a plot, in pixels of the page."""
    return browser.evaluate(
        f"""(plot => {{
          const box = plot.getBoundingClientRect(), {{ l, t, w, h }} = plot._fullLayout._size;
          return [box.left + l, box.top + t, w, h];
        }})(document.querySelectorAll('.plot')[{index}])"""
    )


def test_the_time_moves_every_view(page):
    before, cursors = picture(page), page.evaluate(CURSORS)
    readouts = page.evaluate("document.querySelector('.readout').textContent")
    scrub(page, 200)
    assert page.evaluate(T) == 0.2
    assert picture(page) != before
    after = page.evaluate(CURSORS)
    assert len(after) == len(cursors) > 8
    assert all(now > then + 50 for now, then in zip(after, cursors, strict=True))
    assert page.evaluate("document.querySelector('.readout').textContent") != readouts


def test_the_cursor_stands_where_the_plot_has_the_time(page):
    scrub(page, 300)
    gap = page.evaluate(
        """(() => {
          const plot = document.querySelector('.plot'), axis = plot._fullLayout.xaxis;
          const cursor = document.querySelector('.cursor').getBoundingClientRect().left;
          return cursor - plot.getBoundingClientRect().left - axis._offset - axis.l2p(0.3);
        })()"""
    )
    assert abs(gap) < 1.5


# Of each plot: the left edge of its axes and the gap from the title to the widest number, in pixels.
GAPS = """[...document.querySelectorAll('.plot')].map(plot => {
  const title = plot.querySelector('.ytitle').getBoundingClientRect();
  const ticks = [...plot.querySelectorAll('.ytick text')].map(text => text.getBoundingClientRect());
  const numbers = ticks.filter(box => box.width > 0).map(box => box.left);
  const edge = plot.getBoundingClientRect().left;
  return [plot._fullLayout._size.l, Math.min(...numbers) - title.right, title.left - edge];
})"""


def test_wide_numbers_stand_beside_the_title_of_their_axis(browser, pages):
    browser.open(pages / "wide.html")
    lefts, gaps, insides = zip(*browser.evaluate(GAPS), strict=True)
    assert browser.evaluate("document.querySelector('.ytick:last-of-type text').textContent.length") >= 6
    assert min(gaps) >= 0.0
    assert min(insides) >= 0.0
    assert len(set(lefts)) == 1
    assert lefts[0] > 62
    scrub(browser, 300)
    cursors = browser.evaluate(CURSORS)
    assert max(cursors) - min(cursors) < 0.5


def test_the_readout_is_the_value_at_the_cursor(page):
    scrub(page, 123)
    shown = page.evaluate("document.querySelector('.readout b').textContent").replace("−", "-")
    assert float(shown) == pytest.approx(planar(400).trajectory.linear[123, 0, 0], abs=0.006)


def test_play_pause_and_the_end(page):
    page.key(" ", " ")
    page.until(f"{T} > 0.02")
    assert page.evaluate(LABEL) == "Pause"
    page.key(" ", " ")
    assert page.evaluate(LABEL) == "Play"
    stopped = page.evaluate(T)
    page.until("true")
    page.until("true")
    assert page.evaluate(T) == stopped
    page.evaluate(
        "(s => { s.value = '1'; s.dispatchEvent(new Event('change')); })(document.getElementById('speed'))"
    )
    page.evaluate("document.getElementById('play').click()")
    page.until(f"{T} === 0.4 && {LABEL} === 'Play'")


def test_keys_step_frame_by_frame(page):
    scrub(page, 10)
    for key, t in (("ArrowRight", 0.011), ("ArrowLeft", 0.01), ("End", 0.4), ("Home", 0.0)):
        page.key(key)
        assert page.evaluate(T) == t, key


def test_a_click_and_a_hover_on_a_plot_set_the_time(page):
    left, top, width, height = plot_box(page)
    page.click(left + width / 2, top + height / 2)
    assert page.until(f"{T} > 0.1 && {T}") == pytest.approx(0.2, abs=0.002)
    page.mouse("mouseMoved", left + width / 4, top + height / 2)
    assert page.until(f"{T} < 0.15 && {T}") == pytest.approx(0.1, abs=0.002)


def test_a_zoom_is_shared_by_all_plots(page):
    left, top, width, height = plot_box(page)
    y = top + height / 2
    page.mouse("mouseMoved", left + width / 4, y)
    page.mouse("mousePressed", left + width / 4, y, 1)
    for part in (0.4, 0.6, 0.75):
        page.mouse("mouseMoved", left + width * part, y, 1)
    page.mouse("mouseReleased", left + width * 0.75, y)
    timed = "[...document.querySelectorAll('.plot')].filter(plot => plot.querySelector('.cursor'))"
    ranges = f"{timed}.map(plot => plot.layout.xaxis.range)"
    page.until(f"{ranges}.every(r => r[0] > 0.05)")
    for low, high in page.evaluate(ranges):
        assert (low, high) == pytest.approx((0.1, 0.3), abs=0.01)
    page.click(left + width / 2, y, times=2)
    page.until(f"{ranges}.every(r => r[0] === 0 && r[1] === 0.4)")


MEANS = (
    "[...document.querySelectorAll('.readout i')].map(i => Number(i.textContent.slice(5).replace('−', '-')))"
)


def look_closer(browser, low, high):
    """Type a range of time for the plots."""
    browser.evaluate(
        f"""(([from, to]) => {{
          [from.value, to.value] = [{low}, {high}];
          to.dispatchEvent(new Event("change", {{ bubbles: true }}));
        }})(document.querySelectorAll('.range input'))"""
    )


def mean(t, y, low, high):
    fine = np.linspace(low, high, 100_001)
    return np.interp(fine, t, y).mean()


@pytest.mark.parametrize(("low", "high"), [(0.1, 0.3), (0.0503, 0.3498)])
def test_means_are_those_over_the_range_that_is_typed(page, low, high):
    path = planar(400).trajectory
    before = page.evaluate(MEANS)
    assert before[:2] == pytest.approx([mean(path.t, path.linear[:, b, 0], 0, 0.4) for b in (0, 1)], abs=1e-3)
    look_closer(page, low, high)
    assert page.evaluate("document.querySelector('.plot').layout.xaxis.range") == [low, high]
    expected = [mean(path.t, path.linear[:, b, axis], low, high) for axis in (0, 1) for b in (0, 1)]
    assert page.evaluate(MEANS)[:4] == pytest.approx(expected, abs=1e-3)
    page.evaluate("document.querySelector('.range button').click()")
    assert page.evaluate(MEANS) == before


def test_a_drag_fills_the_fields_of_the_range(page):
    zoom = "{'xaxis.range[0]': 0.15, 'xaxis.range[1]': 0.25}"  # as a drag over the plot ends
    page.evaluate(f"document.querySelector('.plot').emit('plotly_relayout', {zoom})")
    fields = "[...document.querySelectorAll('.range input')].map(field => Number(field.value))"
    assert page.evaluate(fields) == [0.15, 0.25]
    look_closer(page, 0.3, 0.2)  # none: what was there stays
    assert page.evaluate(fields) == [0.15, 0.25]
    page.evaluate("document.querySelector('.range button').click()")
    assert page.evaluate(fields) == [0.0, 0.4]


def test_keys_typed_into_the_range_do_not_move_the_time(page):
    scrub(page, 123)
    page.evaluate("document.querySelector('.range input').focus()")
    for key in ("End", "ArrowLeft", " "):
        page.key(key)
        assert page.evaluate(T) == 0.123, key
    assert page.evaluate(LABEL) == "Play"


def test_a_closer_look_has_the_heights_of_its_own_part(browser, pages):
    """A spike at the start makes the rest flat: beyond it that has the plot for itself."""
    browser.open(pages / "spike.html")
    heights = "document.querySelector('.plot').layout.yaxis.range"
    path = planar(400).trajectory
    look_closer(browser, 0.1, 0.3)
    part = path.linear[100:301, :, 0]
    low, high = browser.evaluate(heights)
    assert low < part.min() < part.max() < high
    assert high - low < 1.2 * np.ptp(part)
    browser.evaluate("document.querySelector('.range button').click()")
    assert browser.evaluate(heights)[1] > 900.0


def test_means_of_a_thinned_curve_are_those_of_all_its_samples(browser, pages):
    """Every 9th sample is a spike: points that keep the largest of each interval are mostly spikes."""
    browser.open(pages / "thinned.html")
    assert browser.evaluate("document.querySelector('.plot').data[0].x.length") < 2100
    path = thinned().trajectory
    at = browser.evaluate("[300, 1500].map(i => document.querySelector('.plot').data[0].x[i])")
    look_closer(browser, *at)
    rows = slice(*np.searchsorted(path.t, at), None)
    y = np.append(path.linear[rows, 0, 0], path.linear[rows.stop, 0, 0])
    shown = browser.evaluate(MEANS)[0]
    assert shown == pytest.approx(np.convolve(y, [0.5, 0.5], "valid").mean(), abs=0.006)
    assert browser.evaluate("document.querySelector('.range').textContent").endswith(
        "its mean over that time"
    )


def test_the_camera_follows_on_demand(page):
    scrub(page, 200)
    fitted = picture(page)
    page.evaluate("document.getElementById('follow').click()")
    assert picture(page) != fitted


def test_a_scene_in_three_dimensions_turns_with_a_drag(browser, pages):
    browser.open(pages / "flapper.html")
    before = picture(browser)
    browser.mouse("mouseMoved", 250, 450)
    browser.mouse("mousePressed", 250, 450, 1)
    browser.mouse("mouseMoved", 330, 480, 1)
    browser.mouse("mouseReleased", 330, 480)
    assert picture(browser) != before


# Writes down the ends of every text on the canvas, and how wide that is.
WRITES = """(() => {
  const { prototype } = CanvasRenderingContext2D, write = prototype.fillText;
  window.texts = [];
  prototype.fillText = function (text, x, y) {
    const wide = this.measureText(text).width, left = this.textAlign === "center" ? x - wide / 2 : x;
    texts.push([left, left + wide, this.canvas.clientWidth, text]);
    return write.call(this, text, x, y);
  };
})()"""


def test_the_numbers_of_the_grid_are_told_apart_and_none_is_cut(browser, pages):
    browser.open(pages / "far.html")
    browser.evaluate(WRITES)
    browser.evaluate("follow.checked = true; follow.dispatchEvent(new Event('change'))")
    for frame in (100, 200, 300):
        browser.evaluate("texts.length = 0")
        scrub(browser, frame)
        written = browser.until("texts.length && texts")
        assert [text for left, right, wide, text in written if left < 0 or right > wide] == []
        texts = [text for *_, text in written]
        numbers = [text for text in texts[: texts.index("m")] if text.startswith("1234")]  # of one picture
        assert len(numbers) > 3
        assert len(set(numbers)) == len(numbers)


def test_a_spike_does_not_make_all_other_arrows_vanish(browser, pages):
    """The arrow of the key is of about the same force with and without an impulse at the start."""
    keys = []
    for name in ("planar", "impulse"):
        browser.open(pages / f"{name}.html")
        browser.evaluate(WRITES)
        scrub(browser, 200)
        text = browser.until("texts.map(text => text[3]).find(text => text.endsWith(' N aerodynamic force'))")
        keys.append(float(text.split()[0]))
    assert 0.4 < keys[1] / keys[0] <= 1.0


def test_the_page_follows_the_colour_scheme(page):
    for scheme in ("dark", "light"):
        features = [{"name": "prefers-color-scheme", "value": scheme}]
        page.send("Emulation.setEmulatedMedia", features=features)
        ink = page.evaluate("getComputedStyle(document.documentElement).getPropertyValue('--soft').trim()")
        page.until(f"document.querySelector('.plot').layout.font.color === '{ink}'")


def test_a_phone_needs_no_sideways_scrolling(page):
    size = {"width": 390, "height": 844, "deviceScaleFactor": 1, "mobile": True}
    page.send("Emulation.setDeviceMetricsOverride", **size)
    try:
        page.until("document.querySelector('.plot').clientWidth < 380")
        assert page.evaluate("document.documentElement.scrollWidth") == 390
    finally:
        size |= {"width": 1400, "height": 1000, "mobile": False}
        page.send("Emulation.setDeviceMetricsOverride", **size)


def look(browser, quantity):
    browser.evaluate(f"flow.value = '{quantity}'; flow.dispatchEvent(new Event('change'))")


def test_the_flow_is_behind_the_mechanism_until_it_is_switched_off(browser, pages):
    browser.open(pages / "flow.html")
    assert browser.evaluate("[...flow.options].map(o => o.value)") == ["vorticity", "speed", "off"]
    assert not browser.evaluate("document.getElementById('flow-choice').hidden")
    scrub(browser, 320)
    look(browser, "off")
    assert browser.evaluate("document.getElementById('flow-scale').hidden")
    bare = picture(browser)
    seen = {bare}
    for quantity, unit in (("vorticity", "1/s"), ("speed", "m/s")):
        look(browser, quantity)
        shows = "document.getElementById('scene').toDataURL()"
        browser.until(f"{shows} !== '{bare}'")  # its picture has been decoded
        seen.add(picture(browser))
        scale = browser.evaluate("document.getElementById('flow-scale').textContent")
        assert scale.endswith(f" {unit}")
        assert scale.startswith("−" if quantity == "vorticity" else "0")
    assert len(seen) == 3
    look(browser, "off")
    assert picture(browser) == bare


def test_a_frame_of_the_flow_stays_until_the_next_one(browser, pages):
    """Colours beside the mechanism: those of the speed change at a frame's time, not between two of them."""
    browser.open(pages / "flow.html")
    look(browser, "speed")
    pixels = "scene.getContext('2d').getImageData(20, scene.height - 70, 300, 1).data.join()"
    browser.until("scene.getContext('2d').getImageData(20, scene.height - 70, 1, 1).data[3] > 100")
    scrub(browser, 200)
    first = browser.until(pixels)
    scrub(browser, 249)
    assert browser.evaluate(pixels) == first
    scrub(browser, 250)
    assert browser.evaluate(pixels) != first


def test_a_page_without_frames_has_no_switch(page):
    assert page.evaluate("document.getElementById('flow-choice').hidden")
    assert page.evaluate("getComputedStyle(document.getElementById('flow-choice')).display") == "none"


@pytest.mark.parametrize("name", ["planar", "flapper", "single", "diverged", "flow"])
def test_nothing_fails_and_nothing_is_fetched(browser, pages, name):
    browser.open(pages / f"{name}.html")
    browser.key("End")
    browser.until("true")
    methods = [event["method"] for event in browser.events]
    trouble = [e for e in browser.events if e["method"] in ("Runtime.exceptionThrown", "Log.entryAdded")]
    assert trouble == []
    assert "Network.requestWillBeSent" in methods
    asked = [
        e["params"]["request"]["url"] for e in browser.events if e["method"] == "Network.requestWillBeSent"
    ]
    assert [url for url in asked if not url.startswith("data:")] == [(pages / f"{name}.html").as_uri()]
