"""The arguments of a call as bytes: numbers, and what pointers point to; see ``fmu/host/lw_call.c``."""

from __future__ import annotations

import ctypes
import struct
from collections.abc import Sequence
from ctypes import c_char_p, c_double
from typing import Any

from fmpy.fmi2 import fmi2CallbackFunctions
from fmpy.fmi3 import fmi3IntermediateUpdateCallback, fmi3LogMessageCallback

HEAD = struct.Struct("<QQII14Q")  # function, result, size of what follows, relocations, arguments
_ARGUMENTS = 14
_FIRST_ARGUMENT = 24  # B from the beginning of a message
_MASK = (1 << 64) - 1
_CALLBACKS = (fmi3IntermediateUpdateCallback,)  # that nobody here answers


class Message:
    """The arguments of one call."""

    def __init__(self, callbacks2: int, log3: int) -> None:
        """Begin; the arguments are where the callbacks of FMI 2 and the logger of FMI 3 lie over there."""
        self._callbacks2, self._log3 = callbacks2, log3
        self._data = bytearray()
        self._pointers: list[
            tuple[bool, int]
        ] = []  # places of pointers: in the data, or an argument's number
        self._back: list[tuple[Any, int]] = []  # what comes back, and from where in the data

    def take(self, argument: Any, expected: Any, number: int) -> int | None:
        """Return an argument as 64 bits; for a pointer, the place in the data that it points to."""
        if expected is c_double and not isinstance(argument, ctypes._SimpleCData):
            argument = c_double(argument)
        if isinstance(argument, int):  # bool is one
            return argument & _MASK
        if argument is None:
            return 0
        if isinstance(argument, fmi3LogMessageCallback):
            return self._log3
        if isinstance(argument, _CALLBACKS):
            return 0
        if isinstance(argument, c_double):
            return int(struct.unpack("<Q", struct.pack("<d", argument.value))[0])
        if isinstance(argument, ctypes._SimpleCData):
            return int(argument.value or 0) & _MASK
        return self._point(argument, number)

    def _point(self, argument: Any, number: int) -> int:
        if isinstance(argument, bytes):
            return self._put(argument + b"\0", number)
        argument = getattr(argument, "_obj", argument)  # of byref
        if isinstance(argument, ctypes._Pointer):  # of cast
            kept = (argument._objects or {}).values()
            argument = next(each for each in kept if isinstance(each, ctypes.Array))
        if isinstance(argument, fmi2CallbackFunctions):
            return self._callbacks2
        if isinstance(argument, ctypes.Array) and argument._type_ is c_char_p:
            return self._strings(argument, number)
        place = self._put(bytes(argument), number)
        self._back.append((argument, place))
        return place

    def _put(self, data: bytes, number: int | None = None) -> int:
        place = len(self._data)
        self._data += data + bytes(-len(data) % 8)
        if number is not None:
            self._pointers.append((False, number))
        return place

    def _strings(self, strings: Any, number: int) -> int:
        place = self._put(bytes(8 * len(strings)), number)
        for i, text in enumerate(strings):
            if text is not None:
                struct.pack_into("<Q", self._data, place + 8 * i, self._put(text + b"\0"))
                self._pointers.append((True, place + 8 * i))
        return place

    def pack(self, function: int, values: Sequence[Any]) -> bytes:
        """Return the message."""
        count = len(self._pointers)
        self._begin = 4 * count + (4 * count) % 8  # of the data, after the places of the pointers
        begin = HEAD.size + self._begin
        numbers = [*values, *[0] * (_ARGUMENTS - len(values))]
        places = []
        for in_data, at in self._pointers:
            if in_data:
                places.append(begin + at)
                (target,) = struct.unpack_from("<Q", self._data, at)
                struct.pack_into("<Q", self._data, at, begin + target)
            else:
                places.append(_FIRST_ARGUMENT + 8 * at)
                numbers[at] += begin
        head = HEAD.pack(function, 0, self._begin + len(self._data), count, *numbers)
        return head + struct.pack(f"<{count}I", *places).ljust(self._begin, b"\0") + self._data

    def put_back(self, answer: bytes) -> None:
        """Write what came back to where the arguments pointed."""
        for target, place in self._back:
            size = ctypes.sizeof(target)
            ctypes.memmove(ctypes.addressof(target), answer[self._begin + place :][:size], size)
