"""A run that is watched: its page is served by another process, which tells what the viewers want.

That process reads the log that the run writes, so that nothing that happens to it or to a browser touches the
run, except that the run waits where somebody holds it.
"""

from __future__ import annotations

import contextlib
import json
import math
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from typing import IO, Any

from linkwind.log.writer import FLUSH_INTERVAL, LogWriter
from linkwind.runs.playback import TICK, Playback, Steering

WATCHED_INTERVAL = 0.1  # s after which messages are in the file while somebody looks
NOTICEABLE = 0.05  # s; who waits longer brings everything into the file first
PATIENCE = 1.0  # s for the server to end by itself


class Watch:
    """What viewers make a run wait for.

    Attributes:
        opened: whether the server has opened the log, or is gone.
    """

    def __init__(self, host: str, port: int, announce: Callable[[str], None]) -> None:
        """Watch a run that is about to begin.

        Args:
            host: address to serve the page on.
            port: of the page; 0 for any that is free.
            announce: is told the address of the page.
        """
        self._place = [f"--host={host}", f"--port={port}"]
        self._announce = announce
        self._steering = Steering(rate=0.0)
        self._passed = -1
        self._rate, self._origin_ns, self._origin = 0.0, 0, 0.0
        self._server: subprocess.Popen[str] | None = None
        self.opened = False

    def begin(self, log: LogWriter) -> None:
        """Serve the page of a log that the run has begun."""
        command = [sys.executable, "-m", "linkwind", "view", str(log.path), "--steered", *self._place]
        self._server = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, start_new_session=True
        )
        threading.Thread(target=self._listen, args=(self._server.stdout, log), daemon=True).start()

    def _listen(self, lines: IO[str], log: LogWriter) -> None:
        """Do what the server tells; when it is gone, nobody holds the run any more."""
        for line in lines:
            told = json.loads(line)
            if "url" in told:
                self.opened = True
                self._announce(told["url"])
            elif "viewers" in told:
                log.flush_interval = WATCHED_INTERVAL if told["viewers"] else FLUSH_INTERVAL
            else:
                self._steer(told)
        self.opened = True
        log.flush_interval = FLUSH_INTERVAL
        self._steer({"paused": False, "rate": 0.0})

    def _steer(self, wish: dict[str, Any]) -> None:
        self._steering.answer(Playback(**wish).SerializeToString())

    def hold(self, time_ns: int, rest: Callable[[], None], poll: Callable[[], None]) -> None:
        """Wait while a step has to.

        Args:
            time_ns: simulation time that the step leads to [ns].
            rest: is called once before a wait that is noticed.
            poll: is called now and then; may raise to give up.
        """
        rested = False
        while (left := self._left(time_ns)) > 0.0:
            if left > NOTICEABLE and not rested:
                rest()
                rested = True
            poll()
            time.sleep(min(left, TICK))

    def _left(self, time_ns: int) -> float:
        """Return the time [s] until a step is due; infinite while it is held."""
        if time_ns != self._passed:
            if self._steering.holds(time_ns):
                self._rate = math.nan  # time does not pass meanwhile
                return math.inf
            self._passed = time_ns
        now, rate = time.perf_counter(), self._steering.rate
        if rate != self._rate:
            self._rate, self._origin_ns, self._origin = rate, time_ns, now
        return self._origin + (time_ns - self._origin_ns) / (1e9 * rate) - now if rate else 0.0

    def stay(self) -> None:
        """Wait until the server ends, Ctrl-C or SIGTERM."""
        if self._server is not None:
            with contextlib.suppress(KeyboardInterrupt):
                self._server.wait()

    def end(self) -> None:
        """End the server, which reads from this process as long as that is there."""
        if self._server is None or self._server.stdin is None:
            return
        self._server.stdin.close()
        try:
            self._server.wait(PATIENCE)
        except subprocess.TimeoutExpired:
            self._server.kill()
            self._server.wait()
