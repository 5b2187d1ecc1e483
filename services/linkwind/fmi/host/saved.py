"""States of the instances of an FMU, as bytes or as a number under which they stay in this process."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from typing import Any

from linkwind.fmi.host.binding import Binding
from linkwind.fmi.host.library import CallError

_KEPT = 4  # states that stay in the process where they cannot be bytes


class Saved:
    """Saves and puts back the state of every instance."""

    def __init__(self, bindings: Sequence[Binding], *, as_bytes: bool) -> None:
        """Prepare; whether the FMU can write its state as bytes."""
        self._bindings, self._as_bytes = bindings, as_bytes
        self._kept: dict[int, list[Any]] = {}
        self._last = 0

    def save(self) -> list[bytes]:
        """Return each instance's state as bytes, or as the number under which it is kept."""
        handles = [binding.keep() for binding in self._bindings]
        if self._as_bytes:
            blobs = []
            for binding, handle in zip(self._bindings, handles, strict=True):
                blobs.append(binding.to_bytes(handle))
                binding.drop(handle)
            return blobs
        self._last += 1
        self._kept[self._last] = handles
        for binding, handle in zip(self._bindings, self._kept.pop(self._last - _KEPT, []), strict=False):
            binding.drop(handle)
        return [struct.pack("<q", self._last)] * len(handles)

    def put(self, number: int, state: bytes) -> None:
        """Put instance ``number`` back into a state that ``save`` returned for it.

        Raises:
            CallError: the state is no longer kept, or the FMU failed.
        """
        binding = self._bindings[number]
        if self._as_bytes:
            handle = binding.from_bytes(state)
            binding.go_back(handle)
            binding.drop(handle)
            return
        key = struct.unpack("<q", state)[0] if len(state) == 8 else -1
        if key not in self._kept:
            raise CallError("the state is no longer kept: this FMU cannot write its state as bytes")
        binding.go_back(self._kept[key][number])

    def drop(self) -> None:
        """Free what is kept."""
        for handles in self._kept.values():
            for binding, handle in zip(self._bindings, handles, strict=True):
                binding.drop(handle)
        self._kept.clear()
