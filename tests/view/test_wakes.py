"""Wakes in the browser: served frame by frame, followed between two frames."""

import json
import urllib.request

import pytest

from linkwind.log.reader import open_log

from .pages import scrub, served, show, troubles

# A wing of one ring that goes ahead with 2 m/s in still air: what it sheds stays where it is. Steps of 1 ms,
# frames at the steps 0, 10 and 20; a wake keeps 15 rows. Corners are whole numbers of mm; the leading edge is
# at x = 4 mm of the body, the trailing edge at 0.
STRAIGHT = """
(async () => {
  const { makeWake } = await import("/report/wake.js"), base64 = (array) => btoa(String.fromCharCode(...new Uint8Array(array.buffer)));
  const frame = (step) => {
    const shed = Array.from({ length: Math.min(step, 15) + 1 }, (_, i) => step - i);
    const edges = [2 * step + 4, ...shed.map((each) => 2 * each)]; // mm
    return {
      t: step / 1000, bound: 1, columns: 1, shed, middle: [0, 0, 0], unit: 0.001,
      corner: base64(Int16Array.from(edges.flatMap((x) => [x, 0, -1, x, 0, 1]))),
      strength: base64(Int8Array.from([99, ...shed.slice(1)])),
    };
  };
  const motion = { poses: (t) => [{ at: [2 * t, 0, 0], q: [1, 0, 0, 0] }] };
  const wakes = { times: [0, 0.01, 0.02], bodies: [0], step: 0.001, top: 1, colours: btoa("\\0".repeat(765)), frame: async (i) => frame(10 * i) };
  const wake = makeWake(wakes, motion, () => {});
  await new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)));
  for (const t of [0, 0.01, 0.02]) { wake.at(t); await new Promise((done) => setTimeout(done)); }
  return JSON.stringify(TIMES.map((t) => wake.at(t)[0]).map(({ bound, lines, rows }) => [
    bound, lines.map((line) => line.map((p) => p.map((x) => Math.round(1e6 * x)))), rows.map((row) => [...row]),
  ]));
})()
"""  # noqa: E501


@pytest.fixture(scope="module")
def address(logs):
    with served(logs["wakes"]) as url:
        yield url


def ask(url):
    with urllib.request.urlopen(url) as answer:
        return json.load(answer)


def test_frames_are_served_one_by_one(address, logs):
    frames = list(open_log(logs["wakes"]).wake_frames("aero"))
    assert ask(f"{address}facts")["wakes"] == {"aero": len(frames)}
    reel = ask(f"{address}wake/aero")
    assert reel["t"] == [frame.time_ns / 1e9 for frame in frames]
    for i, frame in enumerate(frames):
        one = ask(f"{address}wake/aero/{i}")
        assert (one["t"], one["bound"], one["shed"][0]) == (frame.time_ns / 1e9, 2, frame.step)
    for path in ("wake/aero/5", "wake/other", "wake/aero/-1"):
        with pytest.raises(urllib.error.HTTPError, match="404"):
            ask(f"{address}{path}")


def test_between_two_frames_every_line_is_where_it_was_shed(browser, address):
    show(browser, address)
    times = [0.0, 0.0034, 0.01, 0.0137, 0.02, 0.0225]
    found = json.loads(browser.evaluate(STRAIGHT.replace("TIMES", json.dumps(times))))
    for t, (bound, lines, rows) in zip(times, found, strict=True):
        newest = round(t * 1000 + 0.4999) - 1  # the last step before t
        shed = [step for step in range(newest, -1, -1) if step > newest - 15]
        here = 2 * round(1e6 * t)  # µm
        expected = [here + 4000, here, *(2000 * step for step in shed)]
        assert bound == 1
        assert [line[0][0] for line in lines] == pytest.approx(expected, abs=2), t
        assert all([p[1:] for p in line] == [[0, -1000], [0, 1000]] for line in lines)
        known = [99, *(step for step in shed)]
        # How strong the rings are that are shed behind the last frame is not known.
        assert [row[0] for row in rows] == [0 if 20 <= level < 99 and t > 0.02 else level for level in known]


def test_the_wakes_are_in_the_room_coloured_and_can_be_switched_off(browser, address):
    show(browser, address)
    mesh = "space.data.find((trace) => trace.intensitymode === 'cell')"
    browser.until("!!document.querySelector('#space canvas')")
    scrub(browser, 0.035)
    # Three wings, 15 rows and a part of one, three rings a row, two triangles a ring.
    assert browser.until(f"{mesh}?.i.length >= 3 * 15 * 3 * 2 && {mesh}.i.length") <= 3 * 16 * 3 * 2
    assert browser.evaluate(f"{mesh}.intensity.length === {mesh}.i.length")
    assert browser.evaluate(f"{mesh}.colorscale[0][1] !== {mesh}.colorscale[32][1]")
    assert browser.evaluate("document.getElementById('wake-scale').textContent").endswith(" m²/s")
    browser.evaluate("document.getElementById('wake').click()")
    assert browser.until(f"{mesh}.i.length === 0") is True
    assert browser.evaluate("document.getElementById('wake-scale').hidden")
    assert troubles(browser) == []
