"""The shared library of an FMU through FMPy's low-level classes: every call marked and its status checked."""

from __future__ import annotations

from collections.abc import Callable
from ctypes import byref
from typing import Any

from fmpy import fmi2, fmi3
from fmpy.logging import addLoggerProxy

STATUS = ("OK", "Warning", "Discard", "Error", "Fatal", "Pending")
Log = Callable[[str], None]


class CallError(Exception):
    """A call of the FMU that did not go well; the text says which and how."""


class _Missing:
    """A function that the library does not have; calling it is an error, loading is not."""

    def __init__(self, name: str) -> None:
        self.name = name

    def __call__(self, *arguments: object) -> None:
        raise CallError(f"{self.name} is missing in its library")


class _Library:
    """The shared library, with a placeholder for each function that it lacks."""

    def __init__(self, library: Any) -> None:
        self._library = library

    def __getattr__(self, name: str) -> Any:
        try:
            return getattr(self._library, name)
        except AttributeError:
            return _Missing(name)


class _Checked:
    """Mixed into FMPy's classes: marks each call and turns a bad status into a CallError."""

    mark: Callable[[str], None]

    def __init__(self, library: Any = None, **arguments: Any) -> None:
        """Load the library, unless one is given that has been loaded in another process."""
        if library is None:
            super().__init__(**arguments)
            return
        vars(self).update(arguments, dll=library, fmiCallLogger=None, component=None, callbacks=None)
        self._functions: dict[str, Any] = {}
        self._loadFunctions()

    def _loadFunctions(self) -> None:  # noqa: N802  FMPy's name
        self.dll: Any = _Library(self.dll)
        super()._loadFunctions()  # type: ignore[misc]

    def _call(self, name: str, *arguments: Any) -> Any:
        self.mark(name)
        result = self._functions[name](*arguments)
        if result.__class__ is int and result > 1 and "Instantiate" not in name:
            got = STATUS[result] if result < len(STATUS) else f"status {result}"
            raise CallError(f"{name} returned {got}")
        return result


class FMU2SlaveChecked(_Checked, fmi2.FMU2Slave):  # type: ignore[misc]
    """FMI 2 Co-Simulation. FMPy derives the prefix of the functions from the first letters of the name."""


class FMU2ModelChecked(_Checked, fmi2.FMU2Model):  # type: ignore[misc]
    """FMI 2 Model Exchange."""


class FMU3SlaveChecked(_Checked, fmi3.FMU3Slave):  # type: ignore[misc]
    """FMI 3 Co-Simulation."""


class FMU3ModelChecked(_Checked, fmi3.FMU3Model):  # type: ignore[misc]
    """FMI 3 Model Exchange."""


CLASSES = {
    (2, "cs"): FMU2SlaveChecked,
    (2, "me"): FMU2ModelChecked,
    (3, "cs"): FMU3SlaveChecked,
    (3, "me"): FMU3ModelChecked,
}


def _text(raw: bytes | None) -> str:
    return (raw or b"").decode(errors="replace").strip()


def callbacks2(log: Log) -> Any:
    """Return the callbacks of FMI 2; FMPy's proxy in C fills in the arguments of printf."""

    def logger(_: Any, instance: bytes, status: int, category: bytes, message: bytes) -> None:
        log(f"{_label(status)}{_text(message)}")

    callbacks = fmi2.fmi2CallbackFunctions()
    callbacks.logger = fmi2.fmi2CallbackLoggerTYPE(logger)
    callbacks.allocateMemory = fmi2.fmi2CallbackAllocateMemoryTYPE(fmi2.calloc)
    callbacks.freeMemory = fmi2.fmi2CallbackFreeMemoryTYPE(fmi2.free)
    addLoggerProxy(byref(callbacks))
    return callbacks


def logger3(log: Log) -> Callable[..., None]:
    def logger(_: Any, status: int, category: bytes, message: bytes) -> None:
        log(f"{_label(status)}{_text(message)}")

    return logger


def _label(status: int) -> str:
    return f"[{STATUS[status] if 0 <= status < len(STATUS) else status}] "
