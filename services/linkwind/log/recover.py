"""A clean log from one that was cut or damaged: all that can be trusted, and a note of what is missing.

Messages keep their numbers, so that a reader still knows which ones are lost.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import IO, NamedTuple

from linkwind.errors import LogError
from linkwind.log import contents
from linkwind.log.copies import CopyWriter
from linkwind.log.reader import Log, open_log

STRIDE = 10_000  # messages between two words about progress


class Recovered(NamedTuple):
    """What was recovered.

    Attributes:
        messages: in the new file.
        bytes_lost: of the old file that cannot be read.
        file: the new one.
        damage: of the old file; empty if it was whole.
    """

    messages: int
    bytes_lost: int
    file: Path
    damage: str


def recover(
    source: str | Path, target: str | Path, progress: Callable[[int], None] = lambda messages: None
) -> Recovered:
    """Write a clean MCAP file with everything that can be read of a log.

    It is marked as not complete, with the reason, unless nothing was missing.

    Args:
        source: a log, whole, cut or damaged.
        target: file to make; it must not exist.
        progress: is told now and then how many messages are written.

    Raises:
        LogError: the source is no log, or the target exists or cannot be written.
    """
    log, target = open_log(source), Path(target)
    try:
        with target.open("xb") as file:
            try:
                messages = _write(log, file, progress)
            except BaseException:
                target.unlink()
                raise
    except OSError as error:
        raise LogError(
            f"{target}: expected to make a new file; got {error.strerror}. Choose another -o."
        ) from error
    damage = log.damage
    return Recovered(messages, damage.bytes_lost if damage else 0, target, damage.text if damage else "")


def _write(log: Log, file: IO[bytes], progress: Callable[[int], None]) -> int:
    copy = CopyWriter(file, "linkwind log recover")
    for name in (contents.RUN, contents.VERSIONS, contents.DIAGNOSTICS, contents.PROGRAMS, contents.HEARD):
        if record := log.record(name):
            copy.record(name, record)
    if log.has_scenario:
        copy.scenario(log.scenario_json)
    channels = {number: copy.channel(*channel) for number, channel in sorted(log.channels.items())}
    count = 0
    for channel, number, time_ns, payload in log.messages():
        copy.message(channels[channel], number, time_ns, payload)
        count += 1
        if count % STRIDE == 0:
            progress(count)
    copy.record(contents.END, _end(log))
    copy.finish()
    return count


def _end(log: Log) -> dict[str, str]:
    """Return how the run ended, as far as that is known, and what was lost of the log."""
    record = dict(log.ending)
    if log.damage is None:
        return record
    before = f"; the run ended with {log.error}" if log.error else ""
    return record | {
        "complete": "false",
        "steps": str(log.steps),
        "error": "Recovered",
        "text": f"from {log.path.name}: {log.damage.text}{before}",
    }
