"""Where a force model in the user's own Python comes from: a file and a name in it, or an object here."""

from __future__ import annotations

import ast
import functools
import hashlib
import inspect
import re
import sys
import traceback
from contextvars import ContextVar
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

from linkwind.aero.base import item
from linkwind.errors import InputError
from linkwind.scenario import Provider, Scenario
from linkwind.scenario.providers import PythonModel

_loading: ContextVar[bool] = ContextVar("loading", default=False)


@dataclass(frozen=True)
class PythonSource:
    """A function ``(t, motion, wrench)``, or what makes a force model of ``(scenario, provider)``.

    Attributes:
        name: of it in its file.
        file: that it is written in; None if there is none, as for what was typed.
        code: of the file; empty if there is none.
        here: the object itself; None if it is to be loaded from its file, each time anew.
    """

    name: str
    file: Path | None
    code: bytes
    here: Any = None

    def __str__(self) -> str:
        return f"{self.file.name}:{self.name}" if self.file else self.name

    @property
    def sha256(self) -> str | None:
        """Of the file; other files that it imports do not count."""
        return hashlib.sha256(self.code).hexdigest() if self.file else None

    @property
    def argument(self) -> str:
        """What another process on this machine is told, to load it.

        Raises:
            InputError: it cannot be loaded from a file.
        """
        if self.here is not None or self.file is None:
            raise InputError(
                f"{self}: expected FILE.py:NAME, for a process of its own; got an object of this one. Set "
                'bus.transport to "inprocess".'
            )
        return f"{self.file.resolve()}:{self.name}"

    def check(self, scenario: Scenario, provider: Provider) -> None:
        """Raise InputError if the provider's settings ask for another one."""
        wanted = provider.python
        name = wanted.source.rpartition(":")[2] if wanted.source else self.name
        if name == self.name and wanted.sha256 in (None, self.sha256):
            return
        expected, got = _told(wanted.source or "a file", wanted.sha256), _told(str(self), self.sha256)
        raise InputError(
            f"{item(scenario, provider, 'python')}: expected {expected}; got {got}. "
            "Take the same file, or remove the settings from the scenario of a new run."
        )

    def settings(self) -> PythonModel:
        """Return what a scenario says of it."""
        return PythonModel(source=str(self), sha256=self.sha256)

    def get(self) -> Any:
        """Return the object, from its file if it is not here.

        Raises:
            InputError: the file cannot be executed, or has no such name.
        """
        if self.here is not None:
            return self.here
        assert self.file is not None
        module = _executed(self.file, self.code)
        if not hasattr(module, self.name):
            raise self._unknown()
        return getattr(module, self.name)

    def check_name(self) -> None:
        """Raise InputError if the file, which is not executed, cannot have the name."""
        if not re.search(rf"\b{re.escape(self.name)}\b|import \*".encode(), self.code):
            raise self._unknown()

    def _unknown(self) -> InputError:
        names = ", ".join(_defined(self.code)) or "nothing"
        return InputError(f"{self.file}: expected one of {names}; got {self.name}. Correct the name.")


def python_source(model: object) -> PythonSource:
    """Return where a model comes from.

    Args:
        model: ``"FILE.py:NAME"``; or a function or class of this process.

    Raises:
        InputError: there is no such file, it is no Python, or the object makes no model.
    """
    if isinstance(model, PythonSource):
        return model
    if isinstance(model, str):
        return _named(model)
    if not callable(model):
        raise InputError(
            "force model: expected a function of t, motion and wrench, a class derived from "
            f"linkwind.ForceModel, or FILE.py:NAME; got {model!r}. Give the class, not an object of it."
        )
    code: Any = model
    name = getattr(model, "__qualname__", type(model).__qualname__)
    if isinstance(model, functools.partial):
        code, name = model.func, f"partial({getattr(model.func, '__qualname__', model.func)})"
    file = _file_of(code if hasattr(code, "__qualname__") else type(code))
    return PythonSource(name, file, file.read_bytes() if file else b"", model)


def _named(text: str) -> PythonSource:
    path, _, name = text.rpartition(":")
    file = Path(path or text)
    try:
        code = file.read_bytes()
        names = _defined(code)
    except OSError as error:
        raise InputError(
            f"{text}: expected FILE.py:NAME; got, for {file}: {error.strerror}. Check the path."
        ) from None
    except (SyntaxError, ValueError) as error:  # ValueError: null bytes
        line = getattr(error, "lineno", None) or 1
        reason = getattr(error, "msg", str(error))
        raise InputError(f"{file}:{line}: expected Python; got: {reason}. Correct it.") from None
    if not path:
        choices = ", ".join(f"{file}:{name}" for name in names) or f"{file}:NAME"
        raise InputError(f"{text}: expected FILE.py:NAME, such as {choices}; got no name. Add it.")
    source = PythonSource(name, file, code)
    source.check_name()
    return source


def _defined(code: bytes) -> list[str]:
    """Return the names of the functions and classes that a file defines."""
    kinds = (ast.FunctionDef, ast.ClassDef)
    return [node.name for node in ast.parse(code).body if isinstance(node, kinds) and node.name[0] != "_"]


def _file_of(code: Any) -> Path | None:
    try:
        file = inspect.getsourcefile(code)
    except TypeError:  # it is built in, or was typed
        return None
    return Path(file) if file and Path(file).is_file() else None


def _executed(file: Path, code: bytes) -> ModuleType:
    """Execute a file as a new module, with the files beside it within reach of its imports."""
    module = ModuleType(f"{file.stem}_{hashlib.sha256(code).hexdigest()[:8]}")
    module.__file__ = str(file)
    sys.modules[module.__name__] = module  # dataclasses and pickle look it up
    folder = str(file.resolve().parent)
    if folder not in sys.path:
        sys.path.append(folder)  # last, so that it hides nothing
    before = _loading.set(True)
    try:
        exec(compile(code, str(file), "exec"), module.__dict__)
    except (Exception, SystemExit) as error:
        raise InputError(f"{place(error)}: {type(error).__name__}: {error}. Correct it.") from error
    finally:
        _loading.reset(before)
    return module


def refuse_while_loading() -> None:
    """Raise InputError while the file of a force model is executed: a run in it would load it once more."""
    if _loading.get():
        raise InputError(
            "expected a file that only defines, when it is loaded for its force model; got a run in it. Put "
            'that under if __name__ == "__main__":'
        )


def _told(name: str, sha256: str | None) -> str:
    return f"{name} with SHA-256 {sha256}" if sha256 else name


def place(error: BaseException) -> str:
    """Return where in the user's code an exception comes from: ``kite.py:14, in evaluate``."""
    package = str(Path(__file__).parent)
    frames = [
        frame for frame in traceback.extract_tb(error.__traceback__) if not frame.filename.startswith(package)
    ]
    if not frames:
        return "force model"
    # The innermost line in the file that was called, not in what that calls.
    last = [frame for frame in frames if frame.filename == frames[0].filename][-1]
    return f"{last.filename}:{last.lineno}, in {last.name}"
