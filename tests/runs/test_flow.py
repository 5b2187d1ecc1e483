"""A run whose provider shows its flow: the same log over both transports, verified, replayed, compared."""

from __future__ import annotations

import threading
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from linkwind import aero
from linkwind.aero.service import serve
from linkwind.bus.base import DynamicsLink
from linkwind.bus.zenoh import ZenohDynamicsLink, ZenohProviderLink, loopback_endpoint
from linkwind.dynamics.recorder import Recorder
from linkwind.dynamics.service import DynamicsService
from linkwind.frames import Sent, decode
from linkwind.log import grid
from linkwind.log.export import export_csv
from linkwind.log.reader import open_log
from linkwind.log.recover import recover
from linkwind.log.writer import LogWriter
from linkwind.mechanism import build
from linkwind.protocol import ProviderSession
from linkwind.runs.diff import diff
from linkwind.runs.playback import Steering
from linkwind.runs.replay import Selection, replay
from linkwind.runs.run import run
from linkwind.runs.verify import scenario_of, verify
from linkwind.scenario import load
from tests.flows import VortexModel, equal, vortices
from tests.runs.edit import rewrite
from tests.runs.test_replay import Subscriber

STEPS, EVERY, STEP_NS = 30, 10, 1_000_000
SETTINGS = [f"time.end={STEPS / 1000}", "bus.transport=inprocess", "aero.model=none"]


@pytest.fixture(autouse=True)
def vortex_model(monkeypatch: pytest.MonkeyPatch) -> None:
    """The model ``none`` shows vortices."""
    monkeypatch.setitem(aero.MODELS, "none", lambda scenario, provider: VortexModel(every=EVERY))


@pytest.fixture
def log(tmp_path: Path) -> Path:
    return run(load("two_link", SETTINGS), tmp_path / "run", lambda step: None).log


def over_zenoh(path: Path) -> Path:
    """Do the same run with its provider behind a real connection, in a thread of its own."""
    scenario = load("two_link", SETTINGS)
    service = DynamicsService(scenario, build(scenario), "run")
    endpoint = loopback_endpoint()
    link: DynamicsLink = ZenohDynamicsLink(service.session, [endpoint], [], 5.0)
    other = ZenohProviderLink([endpoint], [], name="aero")
    provider = ProviderSession("aero", lambda scenario, name: VortexModel(every=EVERY))
    thread = threading.Thread(target=serve, args=(other, provider, 10.0))
    writer = LogWriter(
        path, run="run", scenario_json=scenario.to_json(), body_names=service.mechanism.bodies,
        provider_bodies=service.session.providers, metadata={},
    )  # fmt: skip
    with closing(link), closing(other), writer:
        thread.start()
        recorder = Recorder(writer, scenario, service.mechanism, service.multibody)
        service.run(link, recorder, lambda step: None)
        thread.join(10.0)
        writer.close(final_state_sha256="00")
    return path


def test_the_log_holds_every_frame_and_the_names_of_the_numbers(log: Path) -> None:
    opened = open_log(log)
    frames = list(opened.frames("aero"))
    assert [frame.step for frame in frames] == [0, 10, 20, 30]
    assert all(equal(frame, vortices(frame.time_ns / 1e9, STEP_NS)) for frame in frames)
    assert opened.diagnostics == {"aero": ("points [1]", "time [s]")}
    numbers = opened.columns("/wrench/aero")["diagnostics"]
    assert np.array_equal(numbers[:, 0], np.maximum(0, np.arange(STEPS + 1) - 1))


def test_the_report_shows_the_flow_and_the_table_names_the_numbers(log: Path, tmp_path: Path) -> None:
    page = (log.parent / "report.html").read_text()
    assert 'class="gallery"' in page
    assert "Reported by aero" in page
    export_csv(open_log(log), tmp_path / "tables")
    head = (tmp_path / "tables" / "wrench_aero.csv").read_text().splitlines()[0]
    assert head.endswith(",points [1],time [s]")


def test_transport_changes_no_bit_and_no_place(log: Path, tmp_path: Path) -> None:
    zenoh = over_zenoh(tmp_path / "zenoh.mcap")
    one, other = ([m for m in open_log(path).raw() if m.topic != "/timing"] for path in (log, zenoh))
    assert len(one) == len(other)
    assert one == other


def test_a_run_with_frames_is_the_same_again(log: Path) -> None:
    found = verify(*scenario_of(log))
    assert (found.difference, found.remark, found.steps) == (None, "", STEPS)
    of_run = sum(n for topic, n in open_log(log).topics.items() if topic not in ("/timing", "/tf", "/scene"))
    assert found.messages == of_run
    assert verify(*scenario_of(log), from_recorded_wrenches=True).identical


def test_one_bit_of_a_frame_is_found_and_named(log: Path, tmp_path: Path) -> None:
    def edit(topic: str, number: int, payload: bytes) -> bytes:
        return payload[:-1] + bytes([payload[-1] ^ 1]) if (topic, number) == ("/flow/aero", 3) else payload

    found = verify(*scenario_of(rewrite(log, tmp_path / "edited.mcap", edit))).difference
    assert found is not None
    assert (found.topic, found.step, found.field) == ("/flow/aero", 20, "vorticity")
    assert found.element == 28 * 32 - 1


@pytest.mark.parametrize("number", [2, 4])
def test_a_frame_that_is_missing_from_the_log_is_found(log: Path, tmp_path: Path, number: int) -> None:
    def edit(topic: str, n: int, payload: bytes) -> bytes | None:
        return None if (topic, n) == ("/flow/aero", number) else payload

    found = verify(*scenario_of(rewrite(log, tmp_path / "edited.mcap", edit))).difference
    assert found is not None
    assert (found.topic, found.step, found.field) == ("/flow/aero", 10 * (number - 1), "message")


def test_a_recovered_log_is_verified_up_to_its_end(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    large = {"every": EVERY, "rows": 224, "columns": 256}
    monkeypatch.setitem(aero.MODELS, "none", lambda scenario, provider: VortexModel(**large))
    data = run(load("two_link", SETTINGS), tmp_path / "run", lambda step: None, report=False).log.read_bytes()
    (tmp_path / "cut.mcap").write_bytes(data[: int(0.7 * len(data))])
    recover(tmp_path / "cut.mcap", tmp_path / "clean.mcap")
    assert [frame.step for frame in open_log(tmp_path / "clean.mcap").frames("aero")] == [0, 10]
    found = verify(*scenario_of(tmp_path / "clean.mcap"))
    assert found.identical
    assert "not complete" in found.remark


def test_frames_of_two_runs_are_compared(log: Path, tmp_path: Path) -> None:
    assert diff(log, log).identical
    assert diff(log, log, rtol=1e-3).identical
    assert diff(log, log).remarks == ()

    def edit(topic: str, number: int, payload: bytes) -> bytes:
        if (topic, number) != ("/flow/aero", 3):
            return payload
        frame = list(open_log(log).frames("aero"))[2]
        pressure = frame.pressure.copy()
        pressure[1, 2] = np.nextafter(pressure[1, 2], np.float32(np.inf))
        pressure[2, 0] += np.float32(0.25)
        return grid.encode(replace(frame, pressure=pressure))

    other = rewrite(log, tmp_path / "edited.mcap", edit)
    found = diff(log, other)
    (only,) = found.fields
    frame = list(open_log(log).frames("aero"))[2]
    assert found.first == only.first
    assert (only.topic, only.field, only.messages, only.t) == (
        "/flow/aero",
        "pressure",
        1,
        frame.time_ns / 1e9,
    )
    assert (only.first.step, only.first.element, only.first.ulp) == (frame.step, frame.shape[1] + 2, 1)
    assert only.absolute == pytest.approx(0.25, rel=1e-4)
    scale = max(float(np.abs(each.pressure).max()) for each in open_log(log).frames("aero"))
    assert only.relative == pytest.approx(only.absolute / scale, rel=0.3)
    assert diff(log, other, rtol=1.01 * only.relative).identical
    assert not diff(log, other, rtol=0.9 * only.relative).identical


def test_a_replay_shows_the_frames_as_they_were_sent(log: Path) -> None:
    endpoint, opened = loopback_endpoint(), open_log(log)
    with closing(Subscriber(endpoint, "linkwind/v1/run/observe/**", enough=4)) as subscriber:
        replay(opened, Selection(), listen=[endpoint], connect=[], steering=Steering(0.0))
        assert subscriber.done.wait(60.0)
    assert {key for key, _ in subscriber.got} == {"linkwind/v1/run/observe/flow/aero"}
    got = [decode(Sent("flow", payload), "run", "aero") for _, payload in subscriber.got]
    assert [number for number, _ in got] == [1, 2, 3, 4]
    assert all(equal(frame, once) for (_, frame), once in zip(got, opened.frames("aero"), strict=True))
