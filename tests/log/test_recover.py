"""Recovering: whatever was done to a log, the new file is clean, holds what is left, names what is not."""

from __future__ import annotations

import contextlib
import json
from pathlib import Path

import pytest
from hypothesis import given
from mcap.reader import make_reader
from typer.testing import CliRunner

from linkwind.cli import app
from linkwind.errors import LogError
from linkwind.log.reader import open_log
from linkwind.log.recover import recover
from tests.log.sample import new_writer, record
from tests.log.test_damage import byte_at, chunk_places, flipped, flips, parts, write_foreign

POINTS, PER_POINT, EVERY = 20, 5, 4


@pytest.fixture(scope="module")
def logged(tmp_path_factory):
    """Bytes of a whole log of several chunks, its messages, and a folder for damaged ones."""
    path = tmp_path_factory.mktemp("log") / "log.mcap"
    _, messages = record(path, POINTS, flush_every=EVERY)
    return path.read_bytes(), messages, path.parent


def check(data, messages, folder):
    """Recover ``data`` and check the new file with mcap's own reader; return both logs."""
    damaged, target = folder / "damaged.mcap", folder / "recovered.mcap"
    damaged.write_bytes(data)
    target.unlink(missing_ok=True)
    done = recover(damaged, target)
    old, new = open_log(damaged), open_log(target)
    with target.open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        found = [
            (channel.topic, message.log_time, message.data)
            for _, channel, message in reader.iter_messages(log_time_order=False)
        ]
        assert reader.get_summary().statistics.message_count == len(found)
    assert found == list(old.raw()) == list(new.raw())
    assert [m[1:] for m in old.messages()] == [m[1:] for m in new.messages()]  # numbers are kept
    rest = iter(messages)
    assert all(message in rest for message in found)
    assert (done.messages, done.bytes_lost) == (len(found), old.damage.bytes_lost if old.damage else 0)
    assert new.damage is None
    assert not new.complete
    assert old.damage.text in new.error
    assert (new.steps, new.metadata, new.versions) == (old.steps, old.metadata, old.versions)
    assert new.final_state_sha256 == old.final_state_sha256
    return old, new


def test_cut_at_every_chunk_boundary(logged):
    original, messages, folder = logged
    places = chunk_places(original)
    assert len(places) == POINTS // EVERY
    for whole, (at, size) in enumerate(places, start=1):
        _, new = check(original[: at + size], messages, folder)
        assert list(new.raw()) == messages[: whole * EVERY * PER_POINT]
        assert new.scenario_json
        _, new = check(original[: at + size - 1], messages, folder)
        assert list(new.raw()) == messages[: (whole - 1) * EVERY * PER_POINT]


def test_every_chunk_damaged_in_turn(logged):
    original, messages, folder = logged
    size = EVERY * PER_POINT
    for i, (at, _) in enumerate(chunk_places(original)):
        data = bytearray(original)
        data[at + 100] ^= 1
        _, new = check(bytes(data), messages, folder)
        assert list(new.raw()) == messages[: i * size] + messages[(i + 1) * size :]
        assert new.final_state_sha256 == "cd" * 32


def test_a_chunk_that_is_not_there_any_more(logged):
    original, messages, folder = logged
    at, size = chunk_places(original)[2]
    check(original[: at - 200] + original[at + size :], messages, folder)


@given(flips=flips, part=parts)
def test_flipped_and_cut_anywhere(logged, flips, part):
    original, messages, folder = logged
    half = len(original) // 2
    damaged = flipped(original, flips)[: half + byte_at(part, len(original) - half + 1)]
    if damaged == original:
        return
    with contextlib.suppress(LogError):
        check(damaged, messages, folder)
        return
    assert not (folder / "recovered.mcap").exists()


def test_a_whole_log_stays_complete(logged, tmp_path):
    original, messages, _ = logged
    whole = tmp_path / "log.mcap"
    whole.write_bytes(original)
    done = recover(whole, tmp_path / "new.mcap")
    assert (done.messages, done.bytes_lost, done.damage) == (len(messages), 0, "")
    new = open_log(done.file)
    assert new.complete
    assert list(new.raw()) == messages
    assert new.final_state_sha256 == "cd" * 32


def test_how_the_run_ended_is_kept_beside_the_damage(tmp_path):
    with pytest.raises(ValueError, match="boom"), new_writer(tmp_path / "log.mcap"):
        raise ValueError("boom")
    data = bytearray((tmp_path / "log.mcap").read_bytes())
    data[-20] ^= 1  # in the summary
    (tmp_path / "log.mcap").write_bytes(data)
    new = open_log(recover(tmp_path / "log.mcap", tmp_path / "new.mcap").file)
    assert "summary is damaged" in new.error
    assert "ValueError: boom" in new.error


@pytest.mark.parametrize(
    ("data", "text"),
    [(b"", "an empty file"), (b"time,x\n0,1\n", "a file that starts with"), (b"\x89MCAP0\r\n", "profile")],
)
def test_what_is_no_log_is_refused(tmp_path, data, text):
    (tmp_path / "log.mcap").write_bytes(data)
    with pytest.raises(LogError, match=text):
        recover(tmp_path / "log.mcap", tmp_path / "new.mcap")
    assert not (tmp_path / "new.mcap").exists()


def test_wrong_schema_is_refused(tmp_path):
    write_foreign(tmp_path / "log.mcap", "linkwind", "linkwind.v2.State")
    with pytest.raises(LogError, match="expected schema"):
        recover(tmp_path / "log.mcap", tmp_path / "new.mcap")


def test_nothing_is_written_over(logged, tmp_path):
    original, _, _ = logged
    path = tmp_path / "log.mcap"
    path.write_bytes(original)
    for target in (path, tmp_path):
        with pytest.raises(LogError, match="expected to make a new file"):
            recover(path, target)
    assert path.read_bytes() == original


def test_a_full_disk_leaves_no_half_file(logged, tmp_path, monkeypatch):
    original, _, _ = logged
    path = tmp_path / "log.mcap"
    path.write_bytes(original)

    def full(*arguments):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("linkwind.log.copies.Writer.add_message", full)
    with pytest.raises(LogError, match="No space left"):
        recover(path, tmp_path / "new.mcap")
    assert not (tmp_path / "new.mcap").exists()


def test_command(logged, tmp_path):
    original, messages, _ = logged
    path = tmp_path / "log.mcap"
    path.write_bytes(original[: len(original) // 2])
    lost = open_log(path).damage.bytes_lost
    target: Path = tmp_path / "new.mcap"
    done = CliRunner().invoke(app, ["log", "recover", str(path), "-o", str(target), "--json"])
    assert done.exit_code == 0
    summary = json.loads(done.stdout)
    recovered = len(list(open_log(path).raw()))
    assert 0 < recovered < len(messages)
    assert summary == {"messages_recovered": recovered, "bytes_lost": lost, "file": str(target)}
