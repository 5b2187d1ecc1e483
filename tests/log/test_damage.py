"""Cut, damaged and foreign files: what can be read is read, nothing is invented, the rest is named."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from io import BytesIO

import pytest
from hypothesis import given
from hypothesis import strategies as st
from mcap.records import Chunk
from mcap.stream_reader import StreamReader
from mcap.writer import Writer

from linkwind.errors import LogError
from linkwind.log.reader import open_log
from tests.log.sample import new_writer, record

POINTS = 20

# What is drawn is where in a file something happens, before the test begins: it depends on nothing that is in
# the file, and whatever goes wrong in the test is told as that.
PARTS = 2**24
parts = st.integers(0, PARTS - 1)
flips = st.lists(st.tuples(parts, st.integers(1, 255)), min_size=1, max_size=3)


def byte_at(part, size):
    """Return the byte, of so many, at a part."""
    return part * size // PARTS


def flipped(data, flips):
    """Return bytes of which some are changed."""
    damaged = bytearray(data)
    for part, bits in flips:
        damaged[byte_at(part, len(data))] ^= bits
    return bytes(damaged)


@pytest.fixture(scope="module")
def logged(tmp_path_factory):
    """Bytes of a whole log of several chunks, its messages, and a path to put damaged ones."""
    path = tmp_path_factory.mktemp("log") / "log.mcap"
    _, messages = record(path, POINTS, flush_every=4)
    return path.read_bytes(), messages, path.with_name("damaged.mcap")


def is_subsequence(part, whole):
    rest = iter(whole)
    return all(message in rest for message in part)


def check(path, messages, data, original):
    """Whatever was done to a file, it is refused, or read without a wrong message."""
    path.write_bytes(data)
    try:
        log = open_log(path)
        found = list(log.raw())
    except LogError:
        return
    assert is_subsequence(found, messages)
    assert sum(log.topics.values()) == len(found)
    if log.damage is None:
        assert data == original
    else:
        assert not log.complete
        assert log.damage.messages_lost == len(messages) - len(found) or log.damage.cut
        assert log.damage.messages_lost <= len(messages) - len(found)


@given(part=parts)
def test_cut_anywhere(logged, part):
    original, messages, path = logged
    check(path, messages, original[: byte_at(part, len(original))], original)


@given(flips=flips)
def test_flipped_bits_anywhere(logged, flips):
    original, messages, path = logged
    check(path, messages, flipped(original, flips), original)


@given(part=parts, size=st.integers(1, 6000), zeroed=st.booleans())
def test_zeroed_or_missing_blocks(logged, part, size, zeroed):
    original, messages, path = logged
    start = byte_at(part, len(original))
    block = bytes(len(original[start : start + size])) if zeroed else b""
    check(path, messages, original[:start] + block + original[start + size :], original)


def chunk_places(data):
    """Return where the records of every chunk lie, found by mcap and by search."""
    reader = StreamReader(BytesIO(data), emit_chunks=True)
    chunks = [record.data for record in reader.records if isinstance(record, Chunk)]
    return [(data.index(chunk), len(chunk)) for chunk in chunks]


def test_one_damaged_chunk_loses_only_its_messages(logged):
    original, messages, path = logged
    places = chunk_places(original)
    assert len(places) == POINTS // 4
    at, _ = places[2]
    damaged = bytearray(original)
    damaged[at + 100] ^= 1
    path.write_bytes(damaged)
    log = open_log(path)
    assert list(log.raw()) == messages[: 2 * 4 * 5] + messages[3 * 4 * 5 :]
    assert log.damage.messages_lost == 4 * 5
    assert not log.damage.cut
    assert (log.complete, log.steps) == (False, POINTS - 1)
    assert "a chunk is damaged" in log.damage.text


def test_a_damaged_first_chunk_does_not_take_the_channels_along(logged):
    original, messages, path = logged
    at, size = chunk_places(original)[0]
    path.write_bytes(original[:at] + bytes(size) + original[at + size :])
    log = open_log(path)
    assert list(log.raw()) == messages[4 * 5 :]
    assert log.damage.messages_lost == 4 * 5


def test_a_wrong_length_is_stepped_over(logged):
    original, messages, path = logged
    at, _ = chunk_places(original)[1]
    damaged = bytearray(original)
    head = at - 40 - 9  # opcode, length, and the chunk's own fields precede its records
    assert damaged[head] == 6
    damaged[head + 6] = 0x7F
    path.write_bytes(damaged)
    log = open_log(path)
    assert list(log.raw()) == messages[: 4 * 5] + messages[2 * 4 * 5 :]
    assert log.damage.messages_lost == 4 * 5


def test_without_its_summary_every_message_is_there(logged):
    original, messages, path = logged
    at, size = chunk_places(original)[-1]
    path.write_bytes(original[: at + size])
    log = open_log(path)
    assert list(log.raw()) == messages
    assert log.damage.cut
    assert (log.complete, log.error, log.steps) == (False, None, POINTS - 1)
    assert (log.damage.bytes_lost, log.damage.messages_lost) == (0, 0)


KILLED = """
import sys
from io import BytesIO
import numpy as np
from tests.log.sample import Recorder, new_writer, state

writer = new_writer(sys.argv[1], flush_interval=float(sys.argv[2]))
recorder, point = Recorder(writer), state(np.random.default_rng(0))
for k in range(30):
    recorder.point(k, point)
    if k == 19 and float(sys.argv[2]) > 0:
        writer.flush()
print("written", flush=True)
sys.stdin.read()
"""


@pytest.mark.parametrize(("flush_interval", "kept"), [(1000.0, 20), (0.0, 29)])
def test_a_killed_writer_leaves_what_it_flushed(tmp_path, flush_interval, kept):
    """With interval 0 every motion and every state brings all before it into the file."""
    path = tmp_path / "log.mcap"
    process = subprocess.Popen(
        [sys.executable, "-c", KILLED, path, str(flush_interval)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
    )
    with process:
        assert process.stdout.readline() == b"written\n"
        os.kill(process.pid, signal.SIGKILL)
    assert process.returncode == -signal.SIGKILL
    log = open_log(path)
    assert len(log.trajectory().step) >= kept
    assert log.topics["/state"] <= 30
    assert (log.complete, log.error) == (False, None)
    assert log.damage.cut
    assert log.run == "run-1"
    assert log.info.scenario == "two_link"


def test_the_head_is_in_the_file_at_once(tmp_path):
    path = tmp_path / "log.mcap"
    writer = new_writer(path, flush_interval=1000.0)
    log = open_log(path)
    assert (log.run, log.steps, log.topics) == ("run-1", 0, {})
    assert log.damage.cut
    writer.close()


@pytest.mark.parametrize(
    ("data", "text"),
    [
        (b"", "got an empty file"),
        (b"time,x,y\n0,1,2\n", 'got a file that starts with "time,x,y"'),
        (b"\x89MCAP0\r\n", 'expected profile "linkwind"; got ""'),
    ],
)
def test_not_a_log(tmp_path, data, text):
    path = tmp_path / "log.mcap"
    path.write_bytes(data)
    with pytest.raises(LogError) as caught:
        open_log(path)
    assert text.replace("b'time,x,y'", "b'time,x,y'"[:-1]) in str(caught.value)
    assert "linkwind run" in str(caught.value)


def test_missing_file_and_folder(tmp_path):
    with pytest.raises(LogError, match="No such file"):
        open_log(tmp_path / "log.mcap")
    with pytest.raises(LogError, match="directory"):
        open_log(tmp_path)


def write_foreign(path, profile, schema):
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start(profile=profile)
        schema_id = writer.register_schema(schema, "protobuf", b"")
        channel = writer.register_channel("/state", "protobuf", schema_id)
        writer.add_message(channel, 0, b"", 0)
        writer.finish()


def test_a_log_of_another_program(tmp_path):
    write_foreign(tmp_path / "log.mcap", "ros2", "linkwind.v1.State")
    with pytest.raises(LogError, match='expected profile "linkwind"; got "ros2"'):
        open_log(tmp_path / "log.mcap")


def test_a_log_of_another_schema_version(tmp_path):
    write_foreign(tmp_path / "log.mcap", "linkwind", "linkwind.v2.State")
    with pytest.raises(LogError, match=r"expected schema linkwind\.v1\.State; got .*v2.*version of linkwind"):
        open_log(tmp_path / "log.mcap")


def test_a_log_without_its_scenario(tmp_path):
    write_foreign(tmp_path / "log.mcap", "linkwind", "linkwind.v1.State")
    with pytest.raises(LogError, match="expected the scenario at the beginning"):
        _ = open_log(tmp_path / "log.mcap").scenario_json
