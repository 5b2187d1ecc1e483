"""A shared library in another process: its functions look like those of ctypes and are called over pipes.

The other end is ``fmu/host/lw_call.c``, which also says what a message looks like. What an argument points
to travels with the call and comes back with the answer. A handle of the FMU's is a number here as there.
"""

from __future__ import annotations

import contextlib
import ctypes
import os
import resource
import signal
import subprocess
from collections.abc import Callable, Sequence
from ctypes import c_int
from pathlib import Path
from typing import Any

from linkwind.fmi.host.library import CallError
from linkwind.fmi.host.message import HEAD, Message

_ALTERED_SEARCH_PATH = 8  # look for the DLLs that a DLL needs in its own folder
_EXCEPTIONS = {
    0xC0000005: "access violation",
    0xC00000FD: "stack overflow",
    0xC0000094: "integer division by zero",
    0xC000001D: "illegal instruction",
    0xC0000409: "abort",
    0x80000003: "breakpoint",
    0xE06D7363: "C++ exception that nobody caught",
}
_PR_SET_PDEATHSIG = 1


class Connection:
    """The process that the library is in."""

    def __init__(self, command: Sequence[str], folder: Path) -> None:
        """Start it.

        Args:
            command: the program, which answers on its standard output.
            folder: to start it in.

        Raises:
            CallError: it does not start.
        """
        libc = ctypes.CDLL(None)
        try:
            self._process = subprocess.Popen(
                command,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                cwd=folder,
                preexec_fn=lambda: libc.prctl(_PR_SET_PDEATHSIG, signal.SIGKILL),
                restore_signals=False,
            )
        except OSError as error:
            raise CallError(f"{command[0]} cannot be started: {error.strerror}") from None
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._to, self._from = self._process.stdin.fileno(), self._process.stdout.fileno()
        self._allowed = os.sched_getaffinity(0)
        hello = HEAD.unpack(self._receive("its start")[0])
        numbers: list[int] = list(hello[4:9])
        self.load, self.find, self.last_error, self.callbacks2, self.log3 = numbers

    def limit(self, more: int) -> None:
        """Let the process have ``more`` bytes of data besides what it has now."""
        status = Path(f"/proc/{self._process.pid}/status").read_text()
        data = next(int(line.split()[1]) for line in status.splitlines() if line.startswith("VmData"))
        size = data * 1024 + more
        resource.prlimit(self._process.pid, resource.RLIMIT_DATA, (size, size))

    def call(self, name: str, function: int, arguments: Sequence[Any], types: Sequence[Any] = ()) -> int:
        """Call a function by its address, and return the 64 bits of its result.

        Raises:
            CallError: the process ended in it.
        """
        message = Message(self.callbacks2, self.log3)
        values = [
            message.take(argument, types[i] if i < len(types) else None, i)
            for i, argument in enumerate(arguments)
        ]
        self._follow()
        self._send(message.pack(function, values))
        head, rest = self._receive(name)
        message.put_back(rest)
        return int(HEAD.unpack(head)[1])

    def _follow(self) -> None:
        """Keep the process on the processors that this one may run on, see ``following``."""
        allowed = os.sched_getaffinity(0)
        if allowed != self._allowed:
            self._allowed = allowed
            with contextlib.suppress(OSError):  # it has ended, which the missing answer tells
                os.sched_setaffinity(self._process.pid, allowed)

    def _send(self, data: bytes) -> None:
        with contextlib.suppress(BrokenPipeError):  # the missing answer tells
            while data:
                data = data[os.write(self._to, data) :]

    def _receive(self, name: str) -> tuple[bytes, bytes]:
        head = self._read(HEAD.size)
        if len(head) < HEAD.size:
            status = self._process.wait()
            how = f"exit status {status}" if status >= 0 else f"signal {signal.Signals(-status).name}"
            raise CallError(f"its Windows process died in {name}: {how}")
        function, result, size, *_ = HEAD.unpack(head)
        if not function:
            what = _EXCEPTIONS.get(result, "see the list of NTSTATUS values")
            raise CallError(f"its Windows process died in {name}: exception 0x{result:08X}, {what}")
        return head, self._read(size)

    def _read(self, size: int) -> bytes:
        data = b""
        while len(data) < size and (block := os.read(self._from, size - len(data))):
            data += block
        return data


class RemoteFunction:
    """A function of the library, with the attributes that FMPy sets on those of ctypes."""

    argnames: Sequence[str] = ()
    argtypes: Sequence[Any] = ()
    restype: Any = c_int

    def __init__(self, connection: Connection, name: str, address: int) -> None:
        self._call: Callable[..., int] = connection.call
        self._name, self._address = name, address

    def __call__(self, *arguments: Any) -> Any:
        """Call it in the other process."""
        if "Instantiate" in self._name:
            arguments = tuple(map(_as_windows_path, arguments))
        result = self._call(self._name, self._address, arguments, self.argtypes)
        if self.restype is c_int:
            return ctypes.c_int32(result & 0xFFFFFFFF).value
        return result or None  # a handle; all functions of FMI but those return a status, or nothing


def _as_windows_path(argument: Any) -> Any:
    """Return an absolute path or its URI as Windows has it; the root is its drive Z."""
    if isinstance(argument, bytes) and argument.startswith(b"file:///"):
        return b"file:///Z:" + argument[7:]
    if isinstance(argument, bytes) and argument.startswith(b"/"):
        return b"Z:" + argument.replace(b"/", b"\\")
    return argument


class RemoteLibrary:
    """A DLL in another process."""

    def __init__(self, connection: Connection, path: Path) -> None:
        """Load it.

        Raises:
            CallError: it cannot be loaded.
        """
        self._connection = connection
        arguments = (_as_windows_path(os.fsencode(path)), 0, _ALTERED_SEARCH_PATH)
        self._handle = connection.call("LoadLibrary", connection.load, arguments)
        if not self._handle:
            code = connection.call("GetLastError", connection.last_error, ()) & 0xFFFFFFFF
            needs = "a DLL that it needs is missing" if code == 126 else f"Windows error {code}"
            raise CallError(f"Failed to load shared library {path.name}: {needs}")

    def __getattr__(self, name: str) -> RemoteFunction:
        address = self._connection.call(name, self._connection.find, (self._handle, name.encode()))
        if not address:
            raise AttributeError(name)
        return RemoteFunction(self._connection, name, address)
