"""Every command on every kind of damaged file: an error that says what, or a part that says what is missing.

Never a traceback, and never a number that the whole file does not give. A short form here; all of it by
``LINKWIND_DAMAGES=300 pytest -m slow tests/runs/test_damaged.py``.
"""

from __future__ import annotations

import os
import random
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from mcap.opcode import Opcode
from mcap.writer import Writer
from typer.testing import CliRunner

from linkwind.cli import app
from linkwind.errors import LinkwindError, LogError
from linkwind.log import writer
from linkwind.log.chunks import MAGIC, record_at
from linkwind.log.export import export_csv
from linkwind.log.reader import open_log
from linkwind.log.recover import recover
from linkwind.report import write_report
from linkwind.runs.diff import diff
from linkwind.runs.live_dynamics import live_dynamics
from linkwind.runs.replay import as_exchanged, points
from linkwind.runs.resume import plan, resume
from linkwind.runs.run import run
from linkwind.runs.verify import scenario_of, verify
from linkwind.scenario import load

RANDOM = int(os.environ.get("LINKWIND_DAMAGES", "4"))  # flips, blocks and cuts at random places, each
STEPS, SEED = 60, 20210305
TOPICS = ("/motion", "/wrench/aero", "/checkpoint/aero", "/state", "/step", "/timing")


class Whole:
    """A run that is left alone: its file, and all that it gives."""

    def __init__(self, folder: Path) -> None:
        settings = [f"time.end={STEPS / 1000}", "bus.transport=inprocess", "log.checkpoint_every=20"]
        self.path = run(load("two_link_field", settings), folder / "run", lambda step: None, report=False).log
        self.data = self.path.read_bytes()
        log = open_log(self.path)
        self.digest = log.final_state_sha256
        self.messages = set(log.raw())
        files = export_csv(log, folder / "tables")
        self.rows = {file.name: file.read_text().splitlines() for file in files}


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Whole]:
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(writer, "CHUNK_SIZE", 20_000)
        yield Whole(tmp_path_factory.mktemp("whole"))


def spans(data: bytes) -> Iterator[tuple[int, int, int]]:
    """Yield opcode, begin and end of every record of an undamaged file."""
    at = len(MAGIC)
    while (record := record_at(data, at)) is not None:
        yield record.opcode, at, record.end
        at = record.end


def damages(data: bytes) -> Iterator[tuple[str, bytes]]:
    """Yield names and contents of damaged files."""
    chance, records = random.Random(SEED), list(spans(data))
    chunks = [(begin, end) for opcode, begin, end in records if opcode == Opcode.CHUNK]
    assert len(chunks) > 5
    few = chunks if RANDOM > 4 else [chunks[0], chunks[len(chunks) // 2], chunks[-1]]
    for begin, end in few:
        for at in (begin, begin + 20, (begin + end) // 2, end):
            yield f"cut at {at}", data[:at]
    seen: set[int] = set()
    for opcode, begin, end in records:  # of each kind of record the first: its opcode, length, content, end
        if opcode not in seen:
            seen.add(opcode)
            for at in (begin, begin + 1, begin + 8, begin + 9, (begin + end) // 2, end - 1):
                if RANDOM > 4 or at in (begin + 1, (begin + end) // 2):
                    yield f"flip in {Opcode(opcode).name} at {at}", flipped(data, at, 0x40)
    for _ in range(RANDOM):
        yield (
            "flips",
            flipped(flipped(data, chance.randrange(len(data)), 1), chance.randrange(len(data)), 255),
        )
        at = chance.randrange(len(data))
        yield "zeros", data[:at] + bytes(min(3000, len(data) - at)) + data[at + 3000 :]
        yield "cut", data[: chance.randrange(len(data))]
        yield "a part lost", data[:at] + data[at + chance.randrange(1, 5000) :]
    yield "empty", b""
    yield "text", b"time,x\n0,1\n"
    yield "magic alone", MAGIC
    yield "nothing but zeros", MAGIC + bytes(1000)
    yield "twice", data + data


def flipped(data: bytes, at: int, bits: int) -> bytes:
    return data[:at] + bytes([data[at] ^ bits]) + data[at + 1 :]


def is_part(rows: list[str], of: list[str]) -> bool:
    rest = iter(of)
    return all(row in rest for row in rows)


# ---- what each command may give: what the whole file gives, or a part of it ----


def check_info(path: Path, folder: Path, whole: Whole) -> None:
    log = open_log(path)
    found = list(log.raw())
    assert whole.messages.issuperset(found)
    if log.complete:
        assert len(found) == len(whole.messages)
        assert log.info.steps == STEPS
        assert log.final_state_sha256 == whole.digest
    else:
        assert log.damage is not None
        assert log.damage.text
        assert 0 <= log.info.steps <= STEPS
    shown = CliRunner().invoke(app, ["log", "info", str(path)])
    if isinstance(shown.exception, LinkwindError):
        raise shown.exception
    assert shown.exit_code == 0
    assert ("complete  yes" in shown.stdout) == log.complete


def check_verify(path: Path, folder: Path, whole: Whole) -> None:
    for recorded in (False, True):
        found = verify(*scenario_of(path), from_recorded_wrenches=recorded)
        assert found.difference is None
        assert found.remark or found.steps == STEPS


def check_recover(path: Path, folder: Path, whole: Whole) -> None:
    done = recover(path, folder / "clean.mcap")
    clean = open_log(done.file)
    assert clean.damage is None
    assert whole.messages.issuperset(clean.raw())
    assert clean.complete == (not done.damage)
    assert bool(done.damage) == (not open_log(path).complete)


def check_replay(path: Path, folder: Path, whole: Whole) -> None:
    log = open_log(path)
    sent = [each for _, point in points(log, TOPICS, -1, float("inf")) for each in as_exchanged(point)]
    assert all((topic, time_ns, payload) in whole.messages for topic, _, time_ns, payload in sent)
    wanted = [m for m in log.raw() if m.topic in TOPICS[:3]]
    assert len(sent) == len(wanted)


def check_resume(path: Path, folder: Path, whole: Whole) -> None:
    done = resume(plan(open_log(path)), folder / "resumed")
    assert done.outcome.result.final_state_sha256 == whole.digest


def check_substitute(path: Path, folder: Path, whole: Whole) -> None:
    done = live_dynamics(open_log(path), [], folder / "live", lambda step: None)
    assert done.result.final_state_sha256 == whole.digest


def check_diff(path: Path, folder: Path, whole: Whole) -> None:
    found = diff(whole.path, path)
    assert found.identical
    assert found.remarks or open_log(path).complete


def check_report(path: Path, folder: Path, whole: Whole) -> None:
    write_report(path, folder / "report.html")
    page = (folder / "report.html").read_text()
    assert ("Not the whole run" in page) == (not open_log(path).complete)


def check_export(path: Path, folder: Path, whole: Whole) -> None:
    for file in export_csv(open_log(path), folder / "tables"):
        assert is_part(file.read_text().splitlines(), whole.rows[file.name])


CHECKS: tuple[Callable[[Path, Path, Whole], None], ...] = (
    check_info, check_verify, check_recover, check_replay, check_resume, check_substitute, check_diff,
    check_report, check_export,
)  # fmt: skip


@pytest.mark.parametrize("check", CHECKS, ids=lambda check: check.__name__.removeprefix("check_"))
def test_a_part_or_an_error_never_a_wrong_number(
    check: Callable[[Path, Path, Whole], None], whole: Whole, tmp_path: Path
) -> None:
    read = refused = 0
    slow = check in (check_report, check_resume, check_substitute) and RANDOM <= 4
    for number, (name, data) in enumerate(damages(whole.data)):
        if slow and number % 5:
            continue
        folder = tmp_path / str(number)
        folder.mkdir()
        path = folder / "damaged.mcap"
        path.write_bytes(data)
        try:
            check(path, folder, whole)
            read += 1
        except LinkwindError:
            refused += 1
        except Exception as error:
            raise AssertionError(f"{name}: {type(error).__name__}: {error}") from error
    assert read
    assert refused or slow


def write_with_schema(path: Path, schema: str, payload: bytes) -> None:
    with path.open("wb") as file:
        other = Writer(file)
        other.start(profile="linkwind")
        number = other.register_schema(schema, "protobuf", b"")
        other.add_message(other.register_channel("/state", "protobuf", number), 0, payload, 0, 1)
        other.finish()


@pytest.mark.parametrize("check", CHECKS, ids=lambda check: check.__name__.removeprefix("check_"))
def test_a_file_of_another_schema(
    check: Callable[[Path, Path, Whole], None], whole: Whole, tmp_path: Path
) -> None:
    write_with_schema(tmp_path / "log.mcap", "linkwind.v2.State", b"\x09\x01")
    with pytest.raises(LogError, match=r"expected schema linkwind\.v1\.State; got .*version of linkwind"):
        check(tmp_path / "log.mcap", tmp_path, whole)


NEED_THE_HEAD = (check_verify, check_resume, check_substitute, check_diff, check_report, check_export)


@pytest.mark.parametrize("check", NEED_THE_HEAD, ids=lambda check: check.__name__.removeprefix("check_"))
def test_a_file_without_its_head(
    check: Callable[[Path, Path, Whole], None], whole: Whole, tmp_path: Path
) -> None:
    write_with_schema(tmp_path / "log.mcap", "linkwind.v1.State", b"\x09\x01")
    with pytest.raises(LogError, match=r"expected the (scenario|run id|list of \w+) at the beginning"):
        check(tmp_path / "log.mcap", tmp_path, whole)
