"""What the writer leaves, read by mcap's own reader and protobuf's own parser."""

from __future__ import annotations

import errno
import json
import os

import numpy as np
import pytest
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from mcap.reader import make_reader

from linkwind import schema
from linkwind.errors import LogError, SimulationError
from linkwind.log import sink
from linkwind.log.reader import open_log
from linkwind.log.writer import CHUNK_SIZE
from tests.log.sample import SCENARIO, STEP_NS, Recorder, new_writer, record, state


@pytest.fixture
def path(tmp_path):
    return tmp_path / "log.mcap"


def test_mcap_reads_every_message(path):
    _, written = record(path, 10, flush_every=3)
    with path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        found = list(reader.iter_messages(log_time_order=False))
    assert [(c.topic, m.log_time, m.data) for _, c, m in found] == written
    assert {m.publish_time for _, _, m in found} == {k * STEP_NS for k in range(10)}


def test_the_file_carries_its_schema(path):
    """A parser made from the file alone reads the messages."""
    states, _ = record(path, 3)
    with path.open("rb") as file:
        found = list(make_reader(file).iter_messages(topics=["/state"]))
    file_schema = found[0][0]
    assert (file_schema.name, file_schema.encoding) == ("linkwind.v1.State", "protobuf")
    pool = descriptor_pool.DescriptorPool()
    for proto in descriptor_pb2.FileDescriptorSet.FromString(file_schema.data).file:
        pool.Add(proto)
    cls = message_factory.GetMessageClass(pool.FindMessageTypeByName(file_schema.name))
    for k, (_, channel, message) in enumerate(found):
        decoded = cls.FromString(message.data)
        assert channel.message_encoding == "protobuf"
        assert decoded.step == k
        assert list(decoded.motion.position) == states[k].motion.position.ravel().tolist()


def test_metadata_and_attachment(path):
    record(path, 5)
    with path.open("rb") as file:
        reader = make_reader(file)
        assert reader.get_header().profile == "linkwind"
        metadata = {item.name: item.metadata for item in reader.iter_metadata()}
        (attachment,) = reader.iter_attachments()
    assert json.loads(attachment.data) == SCENARIO
    run = metadata["linkwind"]
    assert run["run"] == "run-1"
    assert json.loads(run["bodies"]) == ["link1", "link2", "ball"]
    assert json.loads(run["provider_bodies"]) == {"aero": ["link1", "link2"]}
    assert run["schema_sha256"] == schema.SHA256
    assert run["tables_sha256"] == "ab" * 32
    assert metadata["linkwind.versions"]["numpy"] == np.__version__
    assert metadata["linkwind.versions"]["cpu"]
    end = metadata["linkwind.end"]
    assert (end["complete"], end["steps"], end["final_state_sha256"]) == ("true", "4", "cd" * 32)


def test_a_run_that_failed_says_why(path):
    with pytest.raises(SimulationError), new_writer(path) as writer:  # noqa: PT012
        Recorder(writer).point(0, state(np.random.default_rng(0)))
        raise SimulationError("link2: force is not a number")
    log = open_log(path)
    assert log.damage is None
    assert not log.complete
    assert log.error == "SimulationError: link2: force is not a number"
    assert log.topics["/state"] == 1


def test_leaving_without_a_final_state_is_not_complete(path):
    with new_writer(path):
        pass
    log = open_log(path)
    assert (log.complete, log.error, log.steps, log.topics) == (False, None, 0, {})


def test_an_existing_file_is_not_overwritten(path):
    path.write_text("precious")
    with pytest.raises(LogError, match=r"log\.mcap: expected to make a new log file; got File exists"):
        new_writer(path)
    assert path.read_text() == "precious"


def test_a_full_disk_is_an_error_and_leaves_what_was_written(path, monkeypatch):
    """foxglove-sdk alone would go on without a word."""
    written = {"bytes": 0}
    write = os.write

    def scarce(descriptor, data):
        room = 2 * CHUNK_SIZE - written["bytes"]
        if room <= 0:
            raise OSError(errno.ENOSPC, "No space left on device")
        written["bytes"] += min(room, len(data))
        return write(descriptor, data[:room])

    monkeypatch.setattr(sink.os, "write", scarce)
    point = state(np.random.default_rng(0))
    full = pytest.raises(LogError, match=r"expected to write the log; got No space left on device")
    with full, new_writer(path, flush_interval=0.0) as writer:
        recorder = Recorder(writer)
        for k in range(100_000):
            recorder.point(k, point)
    log = open_log(path)
    assert log.damage is not None
    assert log.damage.cut
    found = list(log.raw())
    assert len(found) > 100
    assert found == recorder.messages[: len(found)]


def test_a_second_close_changes_nothing(path):
    writer = new_writer(path)
    writer.close(final_state_sha256="00")
    size = path.stat().st_size
    writer.close(error=SimulationError("late"))
    assert path.stat().st_size == size
    assert open_log(path).complete
