"""Record a run that was started elsewhere, from what its dynamics tells whoever listens."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO

from linkwind.credentials import Identity
from linkwind.errors import RefusedError, StoppedError
from linkwind.interrupt import stops_as_interrupt
from linkwind.listening import Described, described, ended
from linkwind.log.contents import END, RUN, STATE
from linkwind.log.heard import HeardLog
from linkwind.runs import folder as folders
from linkwind.scenario import Scenario, from_json
from linkwind.schema import SHA256

if TYPE_CHECKING:
    from linkwind.bus.zenoh import ZenohListener

IDLE = 2e-3  # s between two looks for a message
GRACE = 0.5  # s for messages that are still on their way when the dynamics has gone
FLUSH = 1.0  # s after which what was written is in the file
STRIDE = 100  # messages between two words about progress


@dataclass(frozen=True)
class Recording:
    """A run that was listened to.

    Attributes:
        scenario: its name.
        messages: that came.
        missed: what did not, for people, or why that is not known; empty if everything came.
        error: what ended the run early; empty if it came to its end.
        log: the MCAP file.
    """

    scenario: str
    messages: int
    missed: str
    error: str
    log: Path


def listen_to(
    *,
    listen: Sequence[str],
    connect: Sequence[str],
    run: str,
    out: Path | None,
    timeout: float,
    identity: Identity | None = None,
    opened: Callable[[], None] = lambda: None,
    found: Callable[[str, Scenario], None] = lambda run, scenario: None,
    progress: Callable[[int], None] = lambda step: None,
) -> Recording:
    """Wait for a run, write its log until it ends.

    Args:
        listen: zenoh endpoints to listen on.
        connect: zenoh endpoints of the dynamics or a router.
        run: id of the run, ``*`` for the only one that is there.
        out: folder for the log; None for a new one under ``runs/``.
        timeout: [s] to wait for the run.
        identity: what this end shows; None without TLS.
        opened: is called when the endpoints are open.
        found: is told the id of the run and its scenario.
        progress: is told now and then how many steps are done.

    Raises:
        InputError: an endpoint cannot be opened, or the folder cannot be made.
        LostError: no run came.
        RefusedError: the run is one of another version of linkwind.
        StoppedError: Ctrl-C or SIGTERM; the log is whole as far as it goes.
    """
    from linkwind.bus.zenoh import ZenohListener

    with stops_as_interrupt(), closing(ZenohListener(listen, connect, run, identity)) as listener:
        opened()
        about = described(listener.find(timeout))
        _check_version(about)
        scenario = from_json(about.scenario_json)
        found(about.run, scenario)
        path = folders.create(f"{scenario.name}-heard", out) / "log.mcap"
        with path.open("xb") as file:
            log = HeardLog(file, about)
            try:
                return _listen(listener, log, file, scenario, progress)
            except KeyboardInterrupt:
                log.finish(None, "the recorder was stopped before the run ended")
                raise StoppedError(f"stopped before the run ended\nlog: {path}") from None


def _listen(
    listener: ZenohListener,
    log: HeardLog,
    file: BinaryIO,
    scenario: Scenario,
    progress: Callable[[int], None],
) -> Recording:
    """Take message after message until the last one, or until the dynamics has gone without it."""
    messages, gone_at, flush_at = 0, float("inf"), time.monotonic() + FLUSH
    ending, reason = None, ""
    while True:
        heard = listener.receive()
        now = time.monotonic()
        if now > flush_at:
            file.flush()
            flush_at = now + FLUSH
        if heard is not None and heard.topic != "/end":
            log.message(*heard)
            messages += 1
            if heard.topic == STATE and heard.number % STRIDE == 0:
                progress(heard.time_ns // scenario.coupling.step_ns)
        elif heard is not None:
            ending = ended(heard.payload)
            listener.close()  # the run need not wait for us
            break
        elif not listener.gone:
            gone_at = float("inf")
            time.sleep(IDLE)
        elif (gone_at := min(gone_at, now)) + GRACE < now:
            reason = "the dynamics was lost, or the network to it was cut"
            break
        else:
            time.sleep(IDLE)
    missed = "; ".join(filter(None, (reason, log.finish(ending, reason))))
    error = reason
    if ending is not None and "error" in (end := ending.records.get(END, {})):
        error = f"{end['error']}: {end['text']}"
    return Recording(scenario.name, messages, missed, error, Path(file.name))


def _check_version(about: Described) -> None:
    theirs = about.records.get(RUN, {}).get("schema_sha256", "none")
    if theirs != SHA256:
        raise RefusedError(
            f"run {about.run}: expected schema {SHA256[:12]}; got {theirs[:12]}. Install the same version of "
            "linkwind on both sides."
        )
