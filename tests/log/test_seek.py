"""A log that is looked into: the same messages as read from end to end, whole, cut, damaged or growing."""

import numpy as np
import pytest

from linkwind.errors import LogError
from linkwind.log.reader import open_log
from linkwind.log.seek import open_seekable
from tests.log.sample import STEP_NS, new_writer, record

POINTS = 60
TOPICS = ("/state", "/step", "/wrench/aero")
EVER = (0, 10**12)


@pytest.fixture(scope="module")
def logged(tmp_path_factory):
    path = tmp_path_factory.mktemp("log") / "log.mcap"
    _, messages = record(path, POINTS, flush_every=7)
    return path, messages


def of(messages, topic, low=0, high=10**12):
    return [payload for name, t, payload in messages if name == topic and low <= t <= high]


def test_a_window_has_its_messages(logged):
    path, messages = logged
    log = open_seekable(path)
    assert log.ended
    assert log.extent("/state") == (0, (POINTS - 1) * STEP_NS)
    assert log.extent("/nothing") is None
    for low, high in (EVER, (0, 0), (13 * STEP_NS, 29 * STEP_NS), (100 * STEP_NS, 200 * STEP_NS)):
        found = log.between(TOPICS, low, high)
        assert found == {topic: of(messages, topic, low, high) for topic in TOPICS}
    assert log.at("/step", 31 * STEP_NS) == of(messages, "/step")[31]
    assert log.at("/step", 31 * STEP_NS + 1) is None
    assert log.times("/step").tolist() == [k * STEP_NS for k in range(POINTS)]


def test_a_sample_is_evenly_spread_and_has_both_ends(logged):
    path, messages = logged
    states = of(messages, "/state")
    found = open_seekable(path).sampled(TOPICS, 0, (POINTS - 1) * STEP_NS, 12)["/state"]
    rows = [states.index(payload) for payload in found]
    assert rows[0] == 0
    assert rows[-1] == POINTS - 1
    assert max(np.diff(rows)) <= 6


def test_the_records_that_are_no_messages(logged):
    path, _ = logged
    log, whole = open_seekable(path), open_log(path)
    for name in ("run", "scenario_json", "bodies", "provider_bodies", "ending", "versions", "metadata"):
        assert getattr(log, name) == getattr(whole, name), name


def test_a_file_without_a_summary_is_the_same_without_what_is_cut(logged, tmp_path):
    path, messages = logged
    data, cut = path.read_bytes(), tmp_path / "cut.mcap"
    for size in (
        *range(len(data) // 4, len(data) // 2, 97),
        *range(len(data) // 2, len(data), len(data) // 9),
    ):
        cut.write_bytes(data[:size])
        try:
            log = open_seekable(cut)
        except LogError:
            assert size < len(data) // 3
            continue
        expected = [m.payload for m in open_log(cut).raw("/state")]
        assert log.between(("/state",), *EVER)["/state"] == expected
        assert of(messages, "/state")[: len(expected)] == expected


def test_a_log_grows(tmp_path):
    path = tmp_path / "log.mcap"
    _, messages = record(tmp_path / "whole.mcap", POINTS)
    states = of(messages, "/state")
    with new_writer(path) as writer:
        log = open_seekable(path)
        assert log.extent("/state") is None
        for k, payload in enumerate(states):
            writer.state(payload, k * STEP_NS)
            if k % 20 == 19:
                writer.flush()
                assert log.refresh()
                assert not log.refresh()
                assert log.between(("/state",), *EVER)["/state"] == states[: k + 1]
        assert not log.ended
        writer.close(final_state_sha256="00")
    assert log.refresh()
    assert log.ended
    assert log.ending["complete"] == "true"


def test_no_number_comes_from_damaged_bytes(logged, tmp_path):
    path, messages = logged
    data, damaged = path.read_bytes(), tmp_path / "damaged.mcap"
    rng = np.random.default_rng(3)
    for place in rng.integers(8, len(data), 150).tolist():
        damaged.write_bytes(data[:place] + bytes([data[place] ^ 0x41]) + data[place + 1 :])
        try:
            log = open_seekable(damaged)
            found = log.between(TOPICS, *EVER)
            sample = log.sampled(TOPICS, 0, (POINTS - 1) * STEP_NS, 10)
        except LogError:
            continue
        for topic in TOPICS:
            true = of(messages, topic)
            assert all(payload in true for payload in found[topic])
            assert all(payload in true for payload in sample[topic])
            assert len(found[topic]) == len(true) or log.trouble, place


@pytest.mark.parametrize("content", [b"", b"text", None])
def test_what_is_no_log_is_refused(tmp_path, content):
    path = tmp_path / "log.mcap"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(LogError, match=r"log\.mcap: expected"):
        open_seekable(path)
