"""The host's end of a worker process: every request is answered in time, or the worker is gone.

Whatever the FMU does (crash, hang, exhaust its memory, return an error), the result is one SimulationError
that says what was being called and what the FMU logged last; and the process has been killed and reaped.
"""

from __future__ import annotations

import contextlib
import logging
import mmap
import os
import select
import signal
import socket
import struct
import subprocess
import sys
import threading
import weakref
from collections import deque
from collections.abc import Iterable
from pathlib import Path

from linkwind.errors import SimulationError
from linkwind.fmi.host import wine
from linkwind.fmi.host.channel import ANSWER, REQUEST, receive
from linkwind.fmi.host.following import Follower
from linkwind.fmi.host.plan import Marker, Plan

LAST_LINES = 5  # of the FMU's output, that an error repeats
_LINE = 500  # characters of a line
_BLOCK = 1 << 16
_CLOSE_TIMEOUT = 2.0  # s
_WITHHELD = ("ZENOH", "LINKWIND")  # environment variables that could lead to the bus
_log = logging.getLogger("linkwind.fmu")


class Output:
    """The last lines that a worker wrote, read by a thread so that it can never block on a full pipe."""

    def __init__(self, descriptor: int) -> None:
        self.lines: deque[str] = deque(maxlen=100)
        self._thread = threading.Thread(target=self._read, args=(descriptor,), daemon=True)
        self._thread.start()

    def _read(self, descriptor: int) -> None:
        rest = b""
        with contextlib.closing(os.fdopen(descriptor, "rb", buffering=0)) as pipe:
            while block := pipe.read(_BLOCK):
                *lines, rest = (rest + block[-_BLOCK:]).split(b"\n")
                rest = rest[-_BLOCK:]
                for line in lines[-100:]:
                    self._take(line)
        if rest:
            self._take(rest)

    def _take(self, line: bytes) -> None:
        text = line.decode(errors="replace").rstrip()[:_LINE]
        if text:
            self.lines.append(text)
            _log.info("%s", text)

    def finish(self) -> None:
        """Wait until all that a dead worker wrote has been read (a child of its own may hold the pipe)."""
        self._thread.join(1.0)


class WorkerProcess:
    """A worker with the instances of one FMU.

    Attributes:
        memory: shared with the worker; see ``Plan.places``.
    """

    def __init__(self, plan: Plan, timeout: float, start_timeout: float) -> None:
        """Start the worker and let it load and instantiate.

        Args:
            plan: what to run.
            timeout: [s] for one evaluation.
            start_timeout: [s] until everything is instantiated.

        Raises:
            SimulationError: the FMU does not get that far.
        """
        self._plan = plan
        self._timeout = timeout
        shared = os.memfd_create("linkwind-fmu")
        ours, theirs = socket.socketpair()
        reading, writing = os.pipe()
        try:
            os.ftruncate(shared, plan.memory_size)
            self.memory = mmap.mmap(shared, plan.memory_size)
            self._process = self._start(theirs.fileno(), shared, writing)
        except BaseException:
            ours.close()
            os.close(reading)
            raise
        finally:
            os.close(shared)
            os.close(writing)
            theirs.close()
        self._channel = ours
        self._output = Output(reading)
        self._call = Marker(self.memory)
        self._finalizer = weakref.finalize(self, _end, self._process, ours)
        self._set_timeout(start_timeout)
        text = plan.to_json()
        self.request(b"p", 0, text)
        self._set_timeout(timeout)
        self._follower = Follower(self.pid)

    def _start(self, channel: int, shared: int, output: int) -> subprocess.Popen[bytes]:
        environment = {k: v for k, v in os.environ.items() if not k.startswith(_WITHHELD)}
        if self._plan.caller:
            environment = wine.environment(Path(self._plan.folder).parent, environment)
        environment |= {"OPENBLAS_NUM_THREADS": "1", "PYTHONUNBUFFERED": "1"}
        arguments = [channel, shared, os.getpid()]
        return subprocess.Popen(
            [sys.executable, "-P", "-m", "linkwind.fmi.host.worker", *map(str, arguments)],
            stdin=subprocess.DEVNULL,
            stdout=output,
            stderr=output,
            pass_fds=(channel, shared),
            cwd=Path(self._plan.folder).parent,
            env=environment,
            start_new_session=True,  # a group of its own, so that processes of the FMU end with it
        )

    def _set_timeout(self, seconds: float) -> None:
        whole, part = divmod(seconds, 1.0)
        option = struct.pack("ll", int(whole), max(int(part * 1e6), 0 if whole else 1))
        self._channel.setsockopt(socket.SOL_SOCKET, socket.SO_RCVTIMEO, option)
        self._patience = seconds

    @property
    def pid(self) -> int:
        """Id of the worker process."""
        return self._process.pid

    def request(self, what: bytes, number: int = 0, payload: bytes = b"") -> bytes:
        """Send a request and return the answer.

        Raises:
            SimulationError: the FMU reported an error, died, or did not answer in time.
        """
        try:
            self._channel.sendall(REQUEST.pack(what, number, len(payload)) + payload)
            head = receive(self._channel, ANSWER.size)
            if len(head) == ANSWER.size:
                kind, size = ANSWER.unpack(head)
                result = receive(self._channel, size) if size else b""
                if kind == b"k" and len(result) == size:
                    return result
                if kind == b"e":
                    raise self._failure(result.decode(errors="replace"))
        except BlockingIOError:
            function = self._call.read() or "its start"
            raise self._failure(f"no answer within {self._patience:g} s in {function}") from None
        except OSError:
            pass
        except SimulationError:
            raise
        except BaseException:
            self.close(kill=True)
            raise
        raise self._failure("")

    def evaluate(self, time_ns: int, *, again: bool) -> None:
        """Bring the outputs to the time [ns]; see :meth:`Runner.evaluate`."""
        self._follower.ask(lambda: self.request(b"a" if again else b"s", time_ns))

    def save(self) -> bytes:
        """Return all memory of the instances."""
        return self.request(b"v")

    def restore(self, blob: bytes) -> None:
        """Take back what ``save`` returned."""
        self.request(b"r", 0, blob)

    def _failure(self, what: str) -> SimulationError:
        """Kill and reap the worker and return the error that says why."""
        function = self._call.read() or "its start"
        status, peak = self._reap(patience=_CLOSE_TIMEOUT if not what else 0.0)
        what = what or f"its process died in {function}: {_cause(status, peak, self._plan.memory)}"
        return SimulationError(what + last_lines(self._output.lines))

    def _reap(self, patience: float) -> tuple[int, int]:
        """End the worker with all its processes; return its exit status and the most memory it had [B]."""
        self._finalizer.detach()
        self._channel.close()
        status, peak = _wait(self._process, patience)
        self._output.finish()
        return status, peak

    def close(self, *, kill: bool = False) -> None:
        """End the worker: politely, unless told otherwise, but in any case."""
        if not self._finalizer.alive:
            return
        if not kill:
            self._set_timeout(_CLOSE_TIMEOUT)
            try:
                self.request(b"c")
            except SimulationError as error:
                _log.warning("%s: at the end of the run: %s", self._plan.file, str(error))
                return
        self._reap(0.0 if kill else _CLOSE_TIMEOUT)


def last_lines(lines: Iterable[str]) -> str:
    """Return the last lines that an FMU logged, as the end of an error message."""
    last = list(lines)[-LAST_LINES:]
    return "".join(["\nIts last lines:", *(f"\n  | {line}" for line in last)]) if last else ""


def _kill_group(pid: int) -> None:
    with contextlib.suppress(ProcessLookupError, PermissionError):
        os.killpg(pid, signal.SIGKILL)


def _wait(process: subprocess.Popen[bytes], patience: float) -> tuple[int, int]:
    """Let a worker end by itself for ``patience`` [s], kill it and all that it started, and reap it."""
    pidfd = os.pidfd_open(process.pid)
    try:
        select.select([pidfd], [], [], patience)
    finally:
        os.close(pidfd)
    _kill_group(process.pid)
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    return process.returncode, usage.ru_maxrss * 1024


def _end(process: subprocess.Popen[bytes], channel: socket.socket) -> None:
    """Kill a worker that nobody closed."""
    channel.close()
    _wait(process, 0.0)


def _cause(status: int, peak: int, memory: int) -> str:
    if status >= 0:
        return f"exit status {status}"
    text = f"signal {signal.Signals(-status).name}, {signal.strsignal(-status)}"
    if peak > 0.8 * memory:
        text += f"; it had taken {peak / 1e6:.0f} MB of the {memory / 1e6:.0f} MB that fmu.memory allows"
    return text
