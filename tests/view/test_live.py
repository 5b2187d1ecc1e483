"""A run that is watched: held, stepped and slowed from the page, with the same bits; viewers come and go."""

import json
import os
import signal
import subprocess
import sys
import threading
import time

import pytest

from linkwind.log.reader import open_log
from linkwind.log.seek import open_seekable
from linkwind.runs.run import run
from linkwind.runs.watch import Watch
from linkwind.scenario import load
from linkwind.view import console as consoles
from linkwind.view.console import Console

from .pages import BADGE, PLAY, T, served, show, troubles

PATIENCE = 20.0  # s
HERE = ["bus.transport=inprocess"]
LIVE = "document.getElementById('live').textContent"


def states(path):
    return [message.payload for message in open_log(path).raw("/state")]


@pytest.fixture
def running(tmp_path):
    """A run over zenoh that would last for minutes, its page, and its log; held longer than its timeout."""
    command = [sys.executable, "-m", "linkwind", "run", "two_link", "--view", "--no-open", "--json"]
    command += ["--out", str(tmp_path / "run"), "--set", "time.end=1000", "--set", "coupling.timeout=0.3"]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    try:
        yield process, process.stderr.readline().split()[0], tmp_path / "run" / "log.mcap"
    finally:
        process.send_signal(signal.SIGINT)
        process.wait(PATIENCE)
        process.stderr.close()


def test_the_page_holds_the_run_itself(browser, running, tmp_path):
    process, url, path = running
    show(browser, url)
    assert browser.evaluate(BADGE) == "running"
    browser.until(f"{LIVE} === 'live' && {PLAY} === 'Pause'")
    browser.key(" ", " ")
    browser.until(f"{LIVE} === 'run paused' && {PLAY} === 'Play'")
    time.sleep(0.5)  # longer than coupling.timeout
    size = path.stat().st_size
    held = open_seekable(path).extent("/state")[1] / 1e9
    browser.until(f"{T} === {held}")
    for k in (1, 2, 3):
        browser.key(".", ".")
        browser.until(f"Math.round(1000 * ({T} - {held})) === {k}")
    assert path.stat().st_size > size
    grown = path.stat().st_size
    browser.key(",", ",")  # looks back; the run stays where it is
    browser.until(f"Math.round(1000 * ({T} - {held})) === 2")
    browser.key("End")
    browser.evaluate("speed.value = '0.1'; speed.dispatchEvent(new Event('change'))")
    assert path.stat().st_size == grown
    began = time.monotonic()
    browser.key(" ", " ")
    browser.until(f"{T} > {held} + 0.03")
    assert time.monotonic() - began > 0.2  # a tenth as fast as in reality, or slower
    assert troubles(browser) == []
    assert process.poll() is None
    process.send_signal(signal.SIGINT)
    assert process.wait(PATIENCE) == 130
    seen = states(path)
    scenario = load("two_link", [*HERE, "time.end=1000", f"time.end={(len(seen) - 1) / 1000}"])
    assert states(run(scenario, tmp_path / "again", lambda step: None).log) == seen


class Pretended(Watch):
    """A watch whose server is a list of lines, each said when so many states are in the log."""

    def __init__(self, script):
        super().__init__("127.0.0.1", 0, lambda url: None)
        self._script = script
        self.passed = []

    def begin(self, log):
        read, self._write = os.pipe()
        self._lines = os.fdopen(read)
        self._listener = threading.Thread(target=self._listen, args=(self._lines, log))
        self._listener.start()

    def hold(self, time_ns, rest, poll):
        step = time_ns // 1_000_000
        for line in self._script.pop(step, ()):
            os.write(self._write, (json.dumps(line) + "\n").encode())
        if not self._script:
            os.close(self._write)
            self._script = {None: ()}
        super().hold(time_ns, rest, poll)
        self.passed.append(step)

    def close(self):
        self._listener.join()
        self._lines.close()


def test_a_run_that_was_held_ends_in_the_same_state(tmp_path):
    scenario = load("two_link", [*HERE, "time.end=0.1"])
    plain = run(scenario, tmp_path / "plain", lambda step: None)
    script = {
        5: [{"viewers": 1}, {"rate": 2.0}],
        20: [{"rate": 0.5}],
        40: [{"rate": 0.0}],
        70: [{"viewers": 0}],
    }
    watch = Pretended(script)
    held = run(scenario, tmp_path / "held", lambda step: None, watch=watch)
    watch.close()
    assert watch.passed == list(range(101))
    assert held.result.final_state_sha256 == plain.result.final_state_sha256
    assert states(held.log) == states(plain.log)


def test_a_run_goes_on_when_the_server_of_its_page_is_gone(tmp_path):
    watch = Pretended({10: [{"viewers": 1}, {"paused": True}, {"rate": 0.001}]})  # and then closes the pipe
    done = run(load("two_link", [*HERE, "time.end=0.05"]), tmp_path / "run", lambda step: None, watch=watch)
    watch.close()
    assert done.result.steps == 50


def test_a_run_goes_on_when_its_last_viewer_has_left(monkeypatch):
    monkeypatch.setattr(consoles, "PATIENCE", 0.05)
    told, gone = [], threading.Event()

    def tell(command):
        told.append(command)
        if command == {"rate": 0.0}:
            gone.set()

    console = Console(tell)
    console.come()
    console.steer({"paused": True})
    console.leave()
    console.come()  # the page was only loaded again
    assert not gone.wait(0.2)
    assert console.paused
    console.leave()
    assert gone.wait(PATIENCE)
    assert not console.paused
    assert told[-2:] == [{"paused": False}, {"rate": 0.0}]


@pytest.mark.parametrize(
    "command", [{}, {"paused": 1}, {"points": 0}, {"points": True}, {"rate": -1}, {"rate": "1"}, [], None]
)
def test_what_is_no_command_is_refused(command):
    console = Console(lambda command: pytest.fail("told"))
    with pytest.raises(ValueError, match="expected"):
        console.steer(command)


def test_the_mean_power_of_the_drives_is_of_the_time_that_is_shown(browser, tmp_path):
    """It is told anew as the log grows: the power of a beat is not the same all the time."""
    done = run(load("flapper", [*HERE, "time.end=0.3"]), tmp_path / "run", report=False)
    data, path = done.log.read_bytes(), tmp_path / "log.mcap"
    part = 2 * len(data) // 3
    path.write_bytes(data[:part])
    texts = "[...document.querySelectorAll('.card p')].map(p => p.textContent)"
    note = f"{texts}.find(text => text.includes('Mean power'))"
    with served(path) as url:
        show(browser, url)
        first = browser.until(note)
        with path.open("ab") as file:
            file.write(data[part:])
        browser.until(f"{note}.includes('from 0 to 0.3 s')")
    power = open_log(path).trajectory().force_power
    means = 0.5 * (power[1:] + power[:-1]).mean(axis=0)  # the steps are equal
    assert "from 0 to 0.3 s" not in first
    assert f"together {sum(means):.3g} W." in browser.evaluate(note)
    assert troubles(browser) == []


def test_a_log_that_grows_is_followed_to_its_end(browser, logs, tmp_path):
    data, path = logs["planar"].read_bytes(), tmp_path / "log.mcap"
    part = 2 * len(data) // 3
    path.write_bytes(data[:part])
    with served(path) as url:
        show(browser, url)
        browser.until(f"{T} > 0.05 && {LIVE} === 'live'")
        with path.open("ab") as file:
            file.write(data[part:])
        browser.until(f"{BADGE} === 'complete' && {T} === 0.3")
        browser.until("document.querySelector('.plot').data[0].x.at(-1) === 0.3")
        assert troubles(browser) == []


def test_a_log_alone_cannot_be_steered(logs):
    import urllib.error
    import urllib.request

    with served(logs["planar"]) as url:
        request = urllib.request.Request(
            f"{url}steer", b'{"paused": true}', {"Content-Type": "application/json"}
        )
        with pytest.raises(urllib.error.HTTPError) as refused:
            urllib.request.urlopen(request)
        assert refused.value.code == 409
        refused.value.close()
