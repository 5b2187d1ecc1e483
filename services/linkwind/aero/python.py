"""The user's own Python as force model: what it may do, and what is said when it goes wrong."""

from __future__ import annotations

import inspect
import logging
import traceback
from collections.abc import Callable
from typing import Any

from linkwind.aero.base import Capabilities, ForceModel, body_indices, item
from linkwind.aero.source import PythonSource, place
from linkwind.errors import InputError, LinkwindError, ProtocolError, SimulationError
from linkwind.scenario import Provider, Scenario
from linkwind.spatial import Array, Motion, Wrench

_log = logging.getLogger("linkwind")

Force = Callable[[float, Motion, Wrench], None]
_ARRAYS = ("force", "torque", "added_inertia", "response", "diagnostics")


class PythonForces:
    """Forces that a user's own code writes.

    The code sees the motion read-only and the wrench zero, and writes into it what acts. Every exception of
    it becomes one that names file, line, step and time.
    """

    def __init__(self, scenario: Scenario, provider: Provider, source: PythonSource | None) -> None:
        """Load and make the model.

        Args:
            scenario: all of it.
            provider: the one to make the model of.
            source: where the code is.

        Raises:
            InputError: the code is missing or another one, fails, or is no force model.
        """
        if source is None:
            raise InputError(
                f"{item(scenario, provider, 'model')}: expected the Python file of the model on the command "
                "line; got none. Add --model FILE.py:NAME."
            )
        source.check(scenario, provider)
        self._source, self._step_ns = source, scenario.coupling.step_ns
        try:
            self._model = _made(source, scenario, provider)
            self.capabilities = _capabilities(source, self._model)
        except LinkwindError:
            raise
        except (Exception, SystemExit) as error:
            raise InputError(f"{place(error)}: {type(error).__name__}: {error}. Correct it.") from error
        self._accepted, self._trial = _ReadOnly(), _ReadOnly()
        if hasattr(self._model, "frame"):
            self.frame = self._frame

    def commit(self, t: float, motion: Motion) -> None:
        """Let the model take the accepted state.

        Raises:
            SimulationError: it failed.
        """
        try:
            self._model.commit(t, self._accepted.of(motion))
        except (Exception, SystemExit) as error:
            raise self._failed(error, t) from error

    def evaluate(self, t: float, motion: Motion, wrench: Wrench) -> None:
        """Let the model write the wrench.

        Raises:
            SimulationError: it failed.
        """
        arrays = [getattr(wrench, name) for name in _ARRAYS]
        for array in arrays:
            if array is not None:
                array.fill(0.0)
        call: Callable[[float, Motion, Wrench], object] = self._model.evaluate
        try:
            returned = call(t, self._trial.of(motion), wrench)
        except (Exception, SystemExit) as error:
            raise self._failed(error, t) from error
        if returned is not None and returned is not wrench:  # as of who thinks that this is where forces go
            raise SimulationError(
                f"{self._source}: {self._when(t)}: expected forces written into wrench; got "
                f"{type(returned).__name__} returned. Write wrench.force[:] = …, and return nothing."
            )
        for name, array in zip(_ARRAYS, arrays, strict=True):
            if getattr(wrench, name) is not array:
                setattr(wrench, name, array)
                raise SimulationError(
                    f"{self._source}: {self._when(t)}: wrench.{name}: expected numbers written into it; got "
                    f"another object in its place. Write wrench.{name}[:] = …"
                )

    def save(self) -> bytes:
        """Return what the model remembers.

        Raises:
            SimulationError: the model says that it cannot.
            ProtocolError: it failed, or returned something else than bytes.
        """
        try:
            blob: object = self._model.save()
        except LinkwindError:
            raise
        except Exception as error:
            raise self._wrong("save", error) from error
        if not isinstance(blob, bytes):
            raise ProtocolError(
                f"{self._source}: save: expected bytes; got {type(blob).__name__}. Return, of an array, "
                "array.tobytes()."
            )
        return blob

    def restore(self, blob: bytes) -> None:
        """Let the model take back what it remembered.

        Raises:
            ProtocolError: it failed.
        """
        try:
            self._model.restore(blob)
        except LinkwindError:
            raise
        except Exception as error:
            raise self._wrong("restore", error) from error

    def _frame(self) -> Any:
        try:
            return self._model.frame()  # type: ignore[attr-defined]
        except Exception as error:
            raise self._wrong("frame", error) from error

    def close(self) -> None:
        """Let the model end what it holds; the run stands, whatever comes of that."""
        try:
            getattr(self._model, "close", lambda: None)()
        except Exception as error:
            _log.warning("%s", self._wrong("close", error))

    def _when(self, t: float) -> str:
        return f"step {t * 1e9 / self._step_ns:g} (t = {t:g} s)"

    def _failed(self, error: BaseException, t: float) -> LinkwindError:
        if isinstance(error, LinkwindError):
            return error
        _log.info("%s", "".join(traceback.format_exception(error)).rstrip())
        return SimulationError(f"{place(error)}: {self._when(t)}: {type(error).__name__}: {error}")

    @staticmethod
    def _wrong(method: str, error: Exception) -> ProtocolError:
        return ProtocolError(f"{place(error)}: {method}: {type(error).__name__}: {error}")


class _Function(ForceModel):
    """A plain function as a force model: it remembers nothing, and sees the bodies of its provider only."""

    def __init__(self, function: Force, rows: list[int] | None) -> None:
        """Take the function.

        Args:
            function: of t, motion and wrench.
            rows: of its bodies in the motion; None for all.
        """
        self._function, self._rows = function, rows

    def evaluate(self, t: float, motion: Motion, wrench: Wrench) -> None:
        """Call it; what it should not return is returned, so that its caller can tell."""
        return self._function(t, motion if self._rows is None else _part(motion, self._rows), wrench)


class _ReadOnly:
    """Motions as code sees them that must not write into them; those of one message are made once."""

    def __init__(self) -> None:
        self._motion: Motion | None = None
        self._shown = Motion.at_rest(0)

    def of(self, motion: Motion) -> Motion:
        """Return a motion in the same memory."""
        if motion is not self._motion:
            parts = (motion.position, motion.orientation, motion.linear, motion.angular)
            self._motion, self._shown = motion, Motion(*map(_read_only, parts))
        return self._shown


def _read_only(array: Array) -> Array:
    view = array.view()
    view.flags.writeable = False
    return view


def _part(motion: Motion, rows: list[int]) -> Motion:
    parts = (motion.position, motion.orientation, motion.linear, motion.angular)
    return Motion(*(_read_only(part[rows]) for part in parts))


def _made(source: PythonSource, scenario: Scenario, provider: Provider) -> ForceModel:
    """Return the model that a source makes.

    Raises:
        InputError: it makes none.
    """
    own = source.get()
    if not isinstance(own, type) and _takes(own, 3):
        rows = body_indices(scenario, provider)
        return _Function(own, None if rows == list(range(len(scenario.bodies))) else rows)
    if not callable(own) or not (isinstance(own, type) or _takes(own, 2)):
        raise InputError(
            f"{source}: expected a function of t, motion and wrench, or a class derived from "
            f"linkwind.ForceModel, made of scenario and provider; got {own!r}. Correct it."
        )
    model = own(scenario, provider)
    missing = [
        name for name in ("capabilities", "commit", "evaluate", "save", "restore") if not hasattr(model, name)
    ]
    if missing and inspect.isfunction(own):
        raise InputError(
            f"{source}: expected a function of t, motion and wrench, or one of scenario and provider that "
            f"returns a force model; got {source.name}{inspect.signature(own)}, which returned "
            f"{type(model).__name__}. Correct it."
        )
    if missing:
        raise InputError(
            f"{source}: expected a force model; got {type(model).__name__} without {', '.join(missing)}. "
            "Derive it from linkwind.ForceModel."
        )
    return model  # type: ignore[no-any-return]


def _takes(function: Any, count: int) -> bool:
    """Tell whether something can be called with so many arguments."""
    try:
        inspect.signature(function).bind(*[None] * count)
    except (TypeError, ValueError):
        return False
    return True


def _capabilities(source: PythonSource, model: ForceModel) -> Capabilities:
    """Return what a model can do.

    Raises:
        InputError: it says something else, or remembers what nobody can save.
    """
    can: object = model.capabilities
    if not isinstance(can, Capabilities):
        raise InputError(
            f"{source}: capabilities: expected linkwind.Capabilities; got {can!r}. Write, in the class, "
            "capabilities = linkwind.Capabilities(…)."
        )
    own = [name for name in ("commit", "save", "restore") if _own(model, name)]
    if can.rollback and own and not {"save", "restore"} <= {*own}:
        raise InputError(
            f"{source}: expected commit, save and restore together, for what it remembers; got only "
            f"{', '.join(own)}. Add the others, or capabilities = linkwind.Capabilities(rollback=False)."
        )
    return can


def _own(model: ForceModel, method: str) -> bool:
    return getattr(type(model), method, None) is not getattr(ForceModel, method)
