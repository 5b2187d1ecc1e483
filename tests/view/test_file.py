"""A log in the browser: played, stepped, searched, its flow and its space."""

import json
import os
import subprocess
import sys

import numpy as np
import pytest

from linkwind.errors import FaultError, LogError
from linkwind.log.reader import open_log
from linkwind.scenario import load
from linkwind.view import recording as recordings
from tests.log.sample import new_writer

from .pages import BADGE, PLAY, SCENE, T, scrub, served, show, troubles


@pytest.fixture(scope="module")
def address(logs):
    with served(logs["planar"]) as url:
        yield url


@pytest.fixture
def page(browser, address):
    """The planar log at its start, paused."""
    if browser.evaluate("location.href") != address:
        show(browser, address)
    browser.evaluate("document.activeElement.blur()")
    browser.key("Home")
    assert browser.evaluate(T) == 0.0
    return browser


def test_a_log_is_shown_without_any_other_host(browser, address):
    show(browser, address)
    assert browser.evaluate(BADGE) == "complete"
    assert browser.evaluate("document.getElementById('name').textContent") == "two_link"
    titles = browser.evaluate("[...document.querySelectorAll('h2')].map(h => h.textContent)")
    assert titles[:2] == ["Velocity", "Aerodynamic force"]
    assert troubles(browser) == []


def test_keys_step_and_go_to_the_ends(page):
    expected = [(".", 0.001), (".", 0.002), (",", 0.001), ("ArrowRight", 0.002), ("End", 0.3), (",", 0.299)]
    for key, t in expected:
        page.key(key, key if len(key) == 1 else "")
        assert page.until(f"{T} === {t}"), key
    page.key("Home")
    assert page.evaluate(T) == 0.0


def test_time_moves_picture_cursor_and_readouts(page):
    cursor = "new DOMMatrix(getComputedStyle(document.querySelector('.cursor')).transform).e"
    before = page.evaluate(f"[{SCENE}, {cursor}]")
    scrub(page, 0.15)
    after = page.evaluate(f"[{SCENE}, {cursor}]")
    assert after[0] != before[0]
    assert after[1] > before[1] + 50


def test_the_readout_is_the_value_in_the_log(page, logs):
    scrub(page, 0.123)
    shown = page.evaluate("document.querySelector('.readout b').textContent").replace("−", "-")
    assert float(shown) == pytest.approx(open_log(logs["planar"]).trajectory().linear[123, 0, 0], abs=0.006)


def test_play_pause_and_the_end(page):
    page.key(" ", " ")
    page.until(f"{T} > 0.01")
    assert page.evaluate(PLAY) == "Pause"
    page.key(" ", " ")
    stopped = page.evaluate(T)
    assert page.evaluate(PLAY) == "Play"
    page.until("true")
    assert page.evaluate(T) == stopped
    page.evaluate("speed.value = '5'; speed.dispatchEvent(new Event('change'))")
    page.evaluate("document.getElementById('play').click()")
    page.until(f"{T} === 0.3 && {PLAY} === 'Play'")


def test_frames_of_the_flow_are_behind_the_mechanism(browser, logs):
    with served(logs["flow"]) as url:
        show(browser, url)
        scrub(browser, 0.03)
        browser.until("flow.options.length === 3")
        browser.evaluate("flow.value = 'off'; flow.dispatchEvent(new Event('change'))")
        bare = browser.evaluate(SCENE)
        for quantity, unit in (("vorticity", "1/s"), ("speed", "m/s")):
            browser.evaluate(f"flow.value = '{quantity}'; flow.dispatchEvent(new Event('change'))")
            browser.until(f"{SCENE} !== '{bare}'")
            assert browser.evaluate("document.getElementById('flow-scale').textContent").endswith(unit)
        assert troubles(browser) == []


def test_a_mechanism_in_space_is_orbited(browser, logs):
    with served(logs["space"]) as url:
        show(browser, url)
        camera = "JSON.stringify(space._fullLayout.scene._scene.getCamera().eye)"
        before = browser.until(f"document.querySelector('#space canvas') && {camera}")
        points = "space.data[0].x.join()"
        at_first = browser.evaluate(points)
        scrub(browser, 0.1)
        browser.until(f"{points} !== '{at_first}'")
        words = browser.evaluate("space._fullLayout.annotations[0].text")
        assert words.startswith("wind at the bodies 2 m/s along (2, 0, 0)")
        browser.mouse("mouseMoved", 400, 400)
        browser.mouse("mousePressed", 400, 400, 1)
        browser.mouse("mouseMoved", 500, 430, 1)
        browser.mouse("mouseReleased", 500, 430)
        browser.until(f"{camera} !== '{before}'")
        assert troubles(browser) == []


# How far the room reaches from the middle of its picture, as parts of the way to the edge: right, up.
REACH = """(() => {
  const { bounds, cameraParams } = space._fullLayout.scene._scene.glplot, all = [0, 1, 2, 3];
  const through = (m, p) => all.map((i) => all.reduce((sum, k) => sum + m[4 * k + i] * p[k], 0));
  const corners = [0, 1, 2, 3, 4, 5, 6, 7].map((c) => {
    const corner = [0, 1, 2].map((k) => bounds[(c >> k) & 1][k]);
    const { model, view, projection } = cameraParams;
    const p = [model, view, projection].reduce((q, m) => through(m, q), [...corner, 1]);
    return [Math.abs(p[0] / p[3]), Math.abs(p[1] / p[3])];
  });
  return [0, 1].map((k) => Math.max(...corners.map((corner) => corner[k])));
})()"""


@pytest.mark.parametrize("size", [(1400, 900), (820, 1100), (390, 844)])
def test_the_numbers_around_the_room_are_in_the_picture(browser, logs, size):
    wide, high = size
    browser.send(
        "Emulation.setDeviceMetricsOverride", width=wide, height=high, deviceScaleFactor=1, mobile=False
    )
    try:
        with served(logs["space"]) as url:
            show(browser, url)
            plot = "space._fullLayout.scene._scene.glplot"
            browser.until(f"document.querySelector('#space canvas') && {plot}.cameraParams")
            right, up = browser.evaluate(REACH)
            w, h = browser.evaluate("[space.clientWidth, space.clientHeight]")
            assert right * w / 2 < w / 2 - 20  # px for the numbers
            assert up * h / 2 < h / 2 - 20
            assert max(right, up) > 0.6  # and the mechanism is not small
    finally:
        browser.send(
            "Emulation.setDeviceMetricsOverride", width=1400, height=900, deviceScaleFactor=1, mobile=False
        )


def test_of_a_long_log_a_sample_is_shown_and_all_where_somebody_looks(browser, logs, monkeypatch):
    monkeypatch.setattr(recordings, "WHOLE", (50, 1e9))
    monkeypatch.setattr(recordings, "SAMPLES", 21)
    points = "document.querySelector('.plot').data[0].x"
    with served(logs["planar"]) as url:
        show(browser, url)
        browser.until(f"{points}.length < 25 && {points}.at(-1) === 0.3")
        path = open_log(logs["planar"]).trajectory()
        scrub(browser, 0.15)
        for k in (151, 152):  # by one step, though the sample has every 15th
            browser.key(".", ".")
            browser.until(f"{T} === {k / 1000}")
        zoom = "{'xaxis.range[0]': 0.15, 'xaxis.range[1]': 0.17}"  # as a drag over the plot ends
        browser.evaluate(f"document.querySelector('.plot').emit('plotly_relayout', {zoom})")
        browser.until(f"{points}[0] === 0.149 && {points}.length === 23")
        shown = browser.evaluate("Array.from(document.querySelector('.plot').data[0].y)")
        assert shown == pytest.approx(path.linear[149:172, 0, 0].tolist(), rel=1e-5)
        browser.evaluate("document.querySelector('.plot').dispatchEvent(new MouseEvent('dblclick'))")
        browser.until(f"{points}.length < 25 && {points}.at(-1) === 0.3")
        assert troubles(browser) == []


def test_means_are_of_all_states_where_they_are_here_else_so_marked(browser, logs, monkeypatch):
    monkeypatch.setattr(recordings, "WHOLE", (50, 1e9))
    monkeypatch.setattr(recordings, "SAMPLES", 21)
    mean, told = (
        "document.querySelector('.readout i').textContent",
        "document.querySelector('.range').textContent",
    )
    path = open_log(logs["planar"]).trajectory()
    with served(logs["planar"]) as url:
        show(browser, url)
        browser.until(f"{mean}.startsWith('mean ≈') && {told}.endsWith('≈ as one state in 15 is here')")
        browser.evaluate(
            """(([from, to]) => {
              [from.value, to.value] = ["0.1503", "0.1707"];
              to.dispatchEvent(new Event("change", { bubbles: true }));
            })(document.querySelectorAll('.range input'))"""
        )
        browser.until(f"!{mean}.includes('≈') && {told}.endsWith('its mean over that time')")
        fine = np.linspace(0.1503, 0.1707, 100_001)
        expected = np.interp(fine, path.t, path.linear[:, 0, 0]).mean()
        shown = browser.evaluate(mean).replace("mean ", "").replace("−", "-")
        assert float(shown) == pytest.approx(expected, abs=0.0006)
        assert troubles(browser) == []


def test_a_folder_of_runs_stands_for_its_newest_log(logs, tmp_path):
    for age, name in ((100, "planar"), (0, "space"), (200, "cut")):
        (tmp_path / name).mkdir()
        copy = tmp_path / name / "log.mcap"
        copy.write_bytes(logs[name].read_bytes())
        os.utime(copy, times=(1e9 - age, 1e9 - age))
    assert recordings.open_recording(tmp_path).facts["name"] == "spinner"
    assert recordings.open_recording(tmp_path / "planar").facts["name"] == "two_link"
    (tmp_path / "none").mkdir()
    with pytest.raises(LogError, match="or folders of runs; got none"):
        recordings.open_recording(tmp_path / "none")


def test_a_run_that_died_before_its_first_state_says_so(browser, tmp_path):
    with new_writer(tmp_path / "log.mcap", scenario_json=load("two_link").to_json()) as writer:
        writer.close(error=FaultError("the provider is gone"))
    with served(tmp_path / "log.mcap") as url:
        show(browser, url, ready=f"{BADGE} === 'incomplete'")
        assert "no state" in browser.evaluate("document.getElementById('waiting').textContent")
        assert "the provider is gone" in browser.evaluate("document.getElementById('banner').textContent")
        assert troubles(browser) == []


def test_a_cut_log_is_shown_as_far_as_it_goes(browser, logs):
    with served(logs["cut"]) as url:
        show(browser, url)
        assert browser.evaluate(BADGE) == "no end yet"
        browser.key("End")
        last = open_log(logs["cut"]).trajectory().t[-1]
        browser.until(f"Math.abs({T} - {last}) < 1e-9")


def test_a_log_that_the_run_s_next_one_has_replaced_is_followed(logs, tmp_path):
    data, path = logs["planar"].read_bytes(), tmp_path / "log.mcap"
    path.write_bytes(data[: 2 * len(data) // 3])
    recording = recordings.Recording(path)
    before = recording.progress()
    assert not before["ended"]
    (tmp_path / "next.mcap").write_bytes(data)
    (tmp_path / "next.mcap").replace(path)
    after = recording.progress()
    assert before["last"] < after["last"]
    assert after["complete"]
    assert recording.window(0.0, 1.0)["scene"] == recordings.Recording(path).window(0.0, 1.0)["scene"]
    path.rename(tmp_path / "elsewhere.mcap")
    assert recording.progress() == after


def test_a_phone_needs_no_sideways_scrolling(page):
    size = {"width": 390, "height": 844, "deviceScaleFactor": 1, "mobile": True}
    page.send("Emulation.setDeviceMetricsOverride", **size)
    try:
        page.until("document.querySelector('.plot').clientWidth < 380")
        assert page.evaluate("document.documentElement.scrollWidth") == 390
        bar = page.evaluate("document.querySelector('.bar').getBoundingClientRect().bottom")
        assert bar <= 844
    finally:
        size |= {"width": 1400, "height": 900, "mobile": False}
        page.send("Emulation.setDeviceMetricsOverride", **size)


def test_what_is_no_log_ends_with_a_clear_error(tmp_path):
    for name, content, text in (
        ("no.mcap", None, "expected a log; got No such file"),
        ("text.mcap", b"hello", "expected an MCAP file"),
    ):
        path = tmp_path / name
        if content is not None:
            path.write_bytes(content)
        done = subprocess.run(
            [sys.executable, "-m", "linkwind", "view", str(path), "--no-open"], capture_output=True, text=True
        )
        assert done.returncode == 3
        assert text in done.stderr


def test_requests_for_another_host_are_refused(address):
    import http.client

    host, port = address.split("/")[2].split(":")
    for name, status in (("127.0.0.1", 200), ("evil.example", 400)):
        connection = http.client.HTTPConnection(host, int(port))
        connection.request("GET", "/facts", headers={"Host": name})
        answer = connection.getresponse()
        assert answer.status == status
        if status == 200:
            assert json.loads(answer.read())["name"] == "two_link"
        connection.close()
