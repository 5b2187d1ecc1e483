"""The process that an FMU runs in: it knows its plan, one socket and one piece of memory, and no bus.

``python -m linkwind.fmi.host.worker SOCKET MEMORY PARENT``: two file descriptors, and the process that it
must not outlive. The messages are those of ``channel``.
"""

from __future__ import annotations

import ctypes
import mmap
import os
import resource
import signal
import socket
import sys
from pathlib import Path

from linkwind.fmi.host.channel import ANSWER, REQUEST, receive
from linkwind.fmi.host.library import CallError
from linkwind.fmi.host.plan import Plan
from linkwind.fmi.host.runner import Runner

_PR_SET_PDEATHSIG = 1


def _die_with(parent: int) -> None:
    """Make sure that this process never outlives its host, even inside a call that hangs."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
        if os.getppid() != parent:
            os._exit(1)


def _limit_memory(more: int) -> None:
    """Let the FMU have ``more`` bytes of address space besides what this process has now."""
    pages = int(Path("/proc/self/statm").read_text().split()[0]) if sys.platform == "linux" else 0
    limit = pages * resource.getpagesize() + more
    resource.setrlimit(resource.RLIMIT_AS, (limit, limit))


def _log(line: str) -> None:
    os.write(1, line.encode(errors="replace")[:2000] + b"\n")


class Server:
    """Does what the host asks for."""

    def __init__(self, memory: mmap.mmap) -> None:
        self._memory = memory
        self._runner: Runner | None = None

    def begin(self, text: bytes) -> None:
        """Take the plan: limit the memory, load and instantiate."""
        plan = Plan.from_json(text)
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        if not plan.caller:  # else the FMU is in a process of its own, which has the limit
            _limit_memory(plan.memory)
        self._runner = Runner(plan, self._memory, _log)

    def answer(self, what: bytes, number: int, payload: bytes) -> bytes:
        """Do one request and return what it asks for."""
        if what == b"p":
            self.begin(payload)
        runner = self._runner
        if runner is None:
            raise CallError("there is no plan yet")
        if what in b"sa":
            runner.evaluate(number, again=what == b"a")
        if what == b"v":
            return runner.save()
        if what == b"r":
            runner.restore(payload)
        if what == b"c":
            runner.close()
        return b""


def serve(channel: socket.socket, memory: mmap.mmap) -> None:
    """Answer requests until the host hangs up."""
    server = Server(memory)
    while request := receive(channel, REQUEST.size):
        what, number, size = REQUEST.unpack(request)
        payload = receive(channel, size) if size else b""
        kind = b"k"
        try:
            result = server.answer(what, number, payload)
        except CallError as error:
            kind, result = b"e", str(error).encode()
        except MemoryError:
            kind, result = b"e", b"the memory that fmu.memory allows is used up"
        channel.sendall(ANSWER.pack(kind, len(result)) + result)


def main() -> None:
    """Run the worker."""
    descriptor, shared, parent = map(int, sys.argv[1:4])
    _die_with(parent)
    os.set_inheritable(descriptor, False)  # a process that the FMU starts must not keep the host waiting
    memory = mmap.mmap(shared, 0)
    os.close(shared)
    serve(socket.socket(fileno=descriptor), memory)
    os._exit(0)  # an FMU's own clean-up at exit is not waited for


if __name__ == "__main__":
    main()
