"""Reading back what was written, bit for bit."""

from __future__ import annotations

import json

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer

from linkwind.errors import LogError
from linkwind.log.reader import open_log
from linkwind.schema import MESSAGES
from tests.log.sample import NQ, NV, SCENARIO, STEP_NS, N, new_writer, record


@pytest.fixture(scope="module")
def logged(tmp_path_factory):
    path = tmp_path_factory.mktemp("log") / "log.mcap"
    states, messages = record(path, 50, flush_every=7)
    return path, states, messages


def test_what_it_tells(logged):
    path, _, messages = logged
    log = open_log(path)
    assert log.complete
    assert log.damage is None
    assert log.error is None
    assert log.steps == 49
    assert (log.run, log.bodies) == ("run-1", ("link1", "link2", "ball"))
    assert log.provider_bodies == {"aero": ("link1", "link2")}
    assert json.loads(log.scenario_json) == SCENARIO
    assert log.final_state_sha256 == "cd" * 32
    assert log.metadata["tables_sha256"] == "ab" * 32
    info = log.info._asdict()
    assert list(info) == ["messages", "topics", "steps", "complete", "scenario", "versions", "missed"]
    assert info["missed"] == {}
    assert info["messages"] == len(messages)
    topics = dict.fromkeys(["/motion", "/wrench/aero", "/state", "/step", "/timing"], 50)
    assert (info["topics"], info["scenario"]) == (topics, "two_link")
    json.dumps(info)


def test_messages_from_a_time_on(logged):
    """What is before may be left out, nothing behind; in a damaged file no header of a chunk is believed."""
    path, _, messages = logged
    log = open_log(path)
    t = 30 * 1_000_000
    behind = [message for message in log.messages() if message[2] >= t]
    assert [m for m in log.messages(start_ns=t) if m[2] >= t] == behind
    assert len(list(log.messages(start_ns=t))) < len(messages)
    cut = path.with_name("cut.mcap")
    cut.write_bytes(path.read_bytes()[:-100])
    assert list(open_log(cut).messages(start_ns=t)) == list(log.messages())


def test_raw_messages_in_order(logged):
    path, _, messages = logged
    log = open_log(path)
    assert list(log.raw()) == messages
    wanted = [message for message in messages if message[0] in ("/state", "/motion")]
    assert list(log.raw("/state", "/motion")) == wanted
    assert list(log.raw("/wrench/nobody")) == []


def test_decoded_messages(logged):
    path, _, messages = logged
    names = {"/motion": "MotionStep", "/wrench/aero": "WrenchStep", "/state": "State"}
    names |= {"/step": "Step", "/timing": "Timing"}
    expected = [(topic, t, MESSAGES[names[topic]].FromString(data)) for topic, t, data in messages]
    assert list(open_log(path).decoded()) == expected


def test_trajectory_is_what_was_encoded(logged):
    path, states, _ = logged
    found = open_log(path).trajectory()
    assert np.array_equal(found.step, np.arange(50))
    assert found.t.tolist() == [k / 1000 for k in range(50)]  # the nearest float64, not a sum
    for name in ("position", "orientation", "linear", "angular"):
        expected = np.stack([getattr(state.motion, name) for state in states])
        assert np.array_equal(getattr(found, name), expected)
    for name in ("q", "v", "acceleration", "reaction", "wrench"):
        assert np.array_equal(getattr(found, name), np.stack([state.arrays[name] for state in states]))
    for name in states[0].scalars:
        assert getattr(found, name).tolist() == [state.scalars[name] for state in states]
    assert found.wrench.shape == (50, N, 6)
    assert (found.q.shape, found.v.shape) == ((50, NQ), (50, NV))


def test_steps_and_timing(logged):
    log = open_log(logged[0])
    steps, timing = log.steps_table(), log.timing()
    assert np.array_equal(steps.order, np.arange(50) % 4)
    assert np.array_equal(steps.extrapolation_error[:, 0], 0.5 * np.arange(50))
    assert steps.extrapolation_error.shape == (50, 4)
    assert np.isnan(steps.extrapolation_error[:, 1:]).all()
    assert set(steps.residual) == {2.0}
    assert np.array_equal(steps.interface_energy, -0.25 * np.arange(50))
    assert set(steps.iteration) == {0}
    assert np.array_equal(timing.exchange_ns, 70_000 + np.arange(50))


def test_columns_of_a_provider(logged):
    path, states, _ = logged
    columns = open_log(path).columns("/wrench/aero")
    assert np.array_equal(columns["force"], np.stack([state.wrench.force[:2].ravel() for state in states]))
    assert columns["added_inertia"].shape == (50, 0)
    with pytest.raises(LogError, match="expected a topic of linkwind; got /tf"):
        open_log(path).columns("/tf")


def test_another_encoding_of_a_message_gives_the_same_arrays(tmp_path):
    """Protobuf allows fields in any order, and fields that are not known."""
    plain = MESSAGES["Timing"](step=3, exchange_ns=4).SerializeToString()
    with new_writer(tmp_path / "log.mcap") as writer:
        writer.timing(plain, 0)
        writer.timing(plain[9:] + plain[:9] + b"\xf8\x3f\x01", STEP_NS)
    timing = open_log(tmp_path / "log.mcap").timing()
    assert (timing.step.tolist(), timing.exchange_ns.tolist()) == ([3, 3], [4, 4])


def test_messages_of_different_sizes_are_not_stacked(tmp_path):
    with new_writer(tmp_path / "log.mcap") as writer:
        for errors in ([1.0], [1.0, 2.0]):
            writer.step(MESSAGES["Step"](step=1, extrapolation_error=errors).SerializeToString(), 0)
    log = open_log(tmp_path / "log.mcap")
    with pytest.raises(LogError, match=r"extrapolation_error: expected 1 values; got 2 values"):
        log.steps_table()
    with pytest.raises(LogError, match=r"/state: expected at least one State; got none"):
        log.trajectory()


@pytest.mark.parametrize("compression", [CompressionType.ZSTD, CompressionType.LZ4, CompressionType.NONE])
def test_rewritten_by_another_tool(logged, tmp_path, compression):
    """For instance compressed: the same messages, and nothing is called damaged."""
    path, _, messages = logged
    other = tmp_path / "other.mcap"
    with path.open("rb") as file, other.open("wb") as out:
        reader, writer = make_reader(file), Writer(out, compression=compression, chunk_size=5000)
        writer.start(profile="linkwind")
        for item in reader.iter_metadata():
            writer.add_metadata(item.name, item.metadata)
        for item in reader.iter_attachments():
            writer.add_attachment(0, 0, item.name, item.media_type, item.data)
        numbers = {}
        for schema, channel, message in reader.iter_messages(log_time_order=False):
            if channel.topic not in numbers:
                schema_id = writer.register_schema(schema.name, schema.encoding, schema.data)
                numbers[channel.topic] = writer.register_channel(channel.topic, "protobuf", schema_id)
            at = message.log_time
            writer.add_message(numbers[channel.topic], at, message.data, at, message.sequence)
        writer.finish()
    log = open_log(other)
    assert list(log.raw()) == messages
    assert log.damage is None
    assert log.complete
