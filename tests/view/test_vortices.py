"""Vortices in the browser: served frame by frame, carried by the fluid between two frames."""

import json
import urllib.request

import pytest

from linkwind.log.reader import open_log

from .pages import scrub, served, show, troubles

# A triangle of 1 m in the plane z = 0 that goes along x with 2 m/s. Frames at 0, 10 and 20 ms.
GOING = """
(async () => {
  const { makeVortices } = await import("/report/vortices.js"), base64 = (array) => btoa(String.fromCharCode(...new Uint8Array(array.buffer)));
  const frame = (i) => ({
    t: 0.01 * i, middle: [0.02 * i, 0, 0], unit: 0.001, fastest: 2 / 127,
    point: base64(Int16Array.from([0, 0, 0, 1000, 0, 0, 0, 1000, 0])),
    velocity: base64(Int8Array.from([127, 0, 0, 127, 0, 0, 127, 0, 0])),
    level: base64(Int8Array.from([i, -127, 127])), triangle: base64(Uint16Array.from([0, 1, 2])),
  });
  const source = { times: [0, 0.01, 0.02], top: 1, axis: "z", room: null, colours: btoa("\\0".repeat(765)), frame: async (i) => frame(i) };
  const vortices = makeVortices(source, () => {});
  await new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)));
  for (const t of [0, 0.01, 0.02]) { vortices.at(t); await new Promise((done) => setTimeout(done)); }
  return JSON.stringify([TIMES].flat().map((t) => vortices.at(t)).map(({ points, triangles, levels, normals }) => [points, triangles, levels, normals]));
})()
"""  # noqa: E501


@pytest.fixture(scope="module")
def address(logs):
    with served(logs["volumes"]) as url:
        yield url


def ask(url):
    with urllib.request.urlopen(url) as answer:
        return json.load(answer)


def test_frames_are_served_one_by_one(address, logs):
    frames = list(open_log(logs["volumes"]).volume_frames("aero"))
    assert ask(f"{address}facts")["volumes"] == {"aero": len(frames)}
    reel = ask(f"{address}vortices/aero")
    assert reel["t"] == [frame.time_ns / 1e9 for frame in frames]
    low, high = reel["room"]
    assert all(a < b for a, b in zip(low, high, strict=True))
    for i, frame in enumerate(frames):
        assert ask(f"{address}vortices/aero/{i}")["t"] == frame.time_ns / 1e9
    for path in ("vortices/aero/5", "vortices/other", "vortices/aero/-1"):
        with pytest.raises(urllib.error.HTTPError, match="404"):
            ask(f"{address}{path}")


def test_between_two_frames_the_surfaces_go_with_the_fluid(browser, address):
    show(browser, address)
    times = [0.0, 0.004, 0.006, 0.01, 0.0149, 0.02, 0.03]
    found = json.loads(browser.evaluate(GOING.replace("TIMES", json.dumps(times))))
    for t, (points, triangles, levels, normals) in zip(times, found, strict=True):
        x = 2.0 * min(t, 0.02)  # behind the last frame nothing is known
        assert points == [pytest.approx([x + a, b, 0.0], abs=1e-9) for a, b in ((0, 0), (1, 0), (0, 1))]
        assert (triangles, normals) == ([[0, 1, 2]], [[0, 0, 1]] * 3)
        nearest = round(100.0 * min(t, 0.02))
        assert levels == [nearest, -127, 127]


def test_the_vortices_are_in_the_room_coloured_and_can_be_switched_off(browser, address):
    show(browser, address)
    mesh = "space.data.at(-1)"
    browser.until("!!document.querySelector('#space canvas')")
    scrub(browser, 0.045)
    assert browser.until(f"{mesh}?.i.length > 100 && {mesh}.i.length") <= 6000
    assert browser.evaluate(f"{mesh}.type === 'mesh3d' && {mesh}.intensity.length === {mesh}.x.length")
    assert browser.until(f"{mesh}.colorscale[0][1] !== {mesh}.colorscale[32][1]") is True
    assert "1/s about " in browser.evaluate("document.getElementById('vortices-scale').textContent")
    browser.evaluate("document.getElementById('vortices').click()")
    assert browser.until(f"{mesh}.i.length === 0") is True
    assert browser.evaluate("document.getElementById('vortices-scale').hidden")
    assert troubles(browser) == []
