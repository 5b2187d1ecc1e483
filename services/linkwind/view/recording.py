"""A log as the page asks for it: what it is about, how far it has come, and any window of time."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from threading import RLock
from typing import Any

import numpy as np

from linkwind.errors import LogError
from linkwind.log import tables
from linkwind.log.contents import FLOW, LOG, STATE, STEP, VOLUME, WAKE, WRENCH
from linkwind.log.seek import SeekableLog, open_seekable
from linkwind.report.arrays import pack
from linkwind.report.data import Diagnostics, Run, coordinates, no_trajectory
from linkwind.report.panels import panels
from linkwind.report.scene import scene
from linkwind.spatial import Array

WHOLE = 20_000, 1e9  # states, and bytes of the log around them, up to which all are shown; else a sample
SAMPLES = 1200  # states of that sample
TAIL = 60  # states that are told of a run between two looks at it


@dataclass(frozen=True)
class Window(Run):
    """What happened in a window of time, or a sample of it.

    Attributes:
        flat: whether everything stays in a plane.
        balance: kinetic + potential - external + dissipated at the start of the run [J].
    """

    flat: bool = True
    balance: float = 0.0

    @cached_property
    def planar(self) -> bool:
        """Whether everything stays in a plane, in the whole run."""
        return self.flat

    @property
    def energy_residual(self) -> Array:
        """Change of the energy balance since the start of the run [J], shape (k,)."""
        return _balance(self.trajectory) - self.balance


def _balance(path: tables.Trajectory) -> Array:
    return path.kinetic_energy + path.potential_energy - path.external_work + path.dissipated_work


class Recording:
    """One log, complete or growing; may be asked from several threads.

    Attributes:
        log: the file.
        lock: to be held while the file is read.
        scenario: the resolved scenario.
        step_ns: communication step size [ns].
    """

    def __init__(self, path: Path) -> None:
        """Open a log.

        Raises:
            LogError: it is missing, no log of linkwind, or damaged before its scenario.
        """
        self.log: SeekableLog = open_seekable(path)
        self.lock = RLock()
        self.scenario: dict[str, Any] = json.loads(self.log.scenario_json)
        self.step_ns = round(float(self.scenario["coupling"]["step"]) * 1e9)
        self._stated_flat = all(isinstance(body["inertia"], float | int) for body in self.scenario["bodies"])
        self._coordinates = coordinates(self.log.scenario_json)
        self._balance: float | None = None

    @cached_property
    def facts(self) -> dict[str, Any]:
        """What the log is about."""
        return {
            "name": self.scenario["name"],
            "description": self.scenario.get("description", ""),
            "run": self.log.run,
            "step": self.step_ns / 1e9,
            "planned": float(self.scenario["time"]["end"]),
        }

    def progress(self) -> dict[str, Any]:
        """Return how far the log has come: first and last time of a state [s], and how the run ended."""
        with self.lock:
            if self.log.replaced:
                self.log = open_seekable(self.log.path)
            self.log.refresh()
            extent, ending = self.log.extent(STATE), self.log.ending
            first, last = extent if extent is not None else (None, None)
            return {
                "first": None if first is None else first / 1e9,
                "last": None if last is None else last / 1e9,
                "ended": self.log.ended,
                "complete": ending.get("complete") == "true" and self.log.trouble is None,
                "error": self._trouble(),
                "frames": {provider: self._frames(FLOW + provider) for provider in self.log.flows},
                "volumes": {provider: self._frames(VOLUME + provider) for provider in self.log.volumes},
                "wakes": {provider: self._frames(WAKE + provider) for provider in self.log.wakes},
            }

    def _trouble(self) -> str | None:
        damage = self.log.trouble and f"The log is damaged: {self.log.trouble}"
        return "\n".join(text for text in (self.log.error, damage) if text) or None

    def _frames(self, topic: str) -> int:
        return len(self.log.times(topic))

    def window(self, low: float, high: float) -> dict[str, Any]:
        """Return the scene and the plots between two times [s], both included.

        All states of a window that is not too large; else a sample, evenly spread. ``every`` is how many
        steps there are from one to the next.
        """
        with self.lock:
            run, whole = self._run(round(low * 1e9), round(high * 1e9))
        steps = np.diff(run.trajectory.step.astype(np.int64))
        return {
            "scene": scene(run),
            "t": pack(run.trajectory.t, "f8"),
            "panels": panels(run) if len(run.trajectory.t) else [],
            "from": low,
            "to": high,
            "every": 1 if whole or not steps.size else int(np.median(steps)),
        }

    def poses(self, low: float, high: float) -> dict[str, Any] | None:
        """Return the scene between two times [s], without plots; None where there is no state."""
        with self.lock:
            path = self._trajectory(round(low * 1e9), round(high * 1e9), TAIL)
            return scene(self._window(path)) if len(path.t) else None

    def points(self, times_ns: Sequence[int]) -> Window:
        """Return the states at some times [ns], those that there are."""
        with self.lock:
            found = [self.log.at(STATE, time_ns) for time_ns in times_ns]
            return self._window(self._states([payload for payload in found if payload is not None]))

    def _run(self, low: int, high: int) -> tuple[Window, bool]:
        """Return a window [ns], and whether it has all states."""
        topics = (STATE, STEP, *(WRENCH + name for name in self.log.diagnostics))
        states, size = WHOLE
        whole = (high - low) <= states * self.step_ns and self.log.bytes_between(low, high) <= size
        found = self.log.between(topics, low, high) if whole else self.log.sampled(topics, low, high, SAMPLES)
        window = self._window(self._states(found[STATE]))
        if not found[STEP]:
            return window, whole
        coupling = tables.steps(self._columns(found[STEP], "Step", STEP))
        reported = ((name, found[WRENCH + name]) for name in self.log.diagnostics)
        return replace(
            window,
            coupling_time=coupling.t,
            order=coupling.order,
            extrapolation_error=coupling.extrapolation_error,
            interface_energy=coupling.interface_energy,
            diagnostics=tuple(self._diagnostics(name, messages) for name, messages in reported if messages),
        ), whole

    def _trajectory(self, low: int, high: int, count: int) -> tables.Trajectory:
        return self._states(self.log.sampled((STATE,), low, high, count)[STATE])

    def _states(self, payloads: list[bytes]) -> tables.Trajectory:
        if not payloads:
            return no_trajectory(len(self.scenario["bodies"]))
        return tables.trajectory(self._columns(payloads, "State", STATE))

    def _columns(self, payloads: list[bytes], name: str, topic: str) -> dict[str, Any]:
        return tables.columns(payloads, name, f"{self.log.path}: {topic}")

    def _diagnostics(self, provider: str, payloads: list[bytes]) -> Diagnostics:
        columns = self._columns(payloads, "WrenchStep", WRENCH + provider)
        t, values = tables.seconds(columns["time_ns"][:, 0]), columns["diagnostics"]
        names = self.log.diagnostics[provider]
        return Diagnostics(provider, names[: values.shape[1]], t, values)

    def _window(self, path: tables.Trajectory) -> Window:
        """Return a window with a trajectory alone."""
        if self._balance is None and (extent := self.log.extent(STATE)) is not None:
            first = self.log.at(STATE, extent[0])
            if first is not None:
                self._balance = float(_balance(self._states([first]))[0])
        return Window(
            scenario=self.scenario,
            complete=False,
            error=None,
            versions={},
            trajectory=path,
            coupling_time=np.empty(0),
            order=np.empty(0),
            extrapolation_error=np.empty((0, 0)),
            interface_energy=np.empty(0),
            exchange=np.empty(0),
            coordinates=self._coordinates,
            flat=self.flat,
            balance=self._balance or 0.0,
        )

    @property
    def flat(self) -> bool:
        """Whether the mechanism is planar, or turned out to stay in a plane in a run that is over."""
        return self._stated_flat or (self.log.ended and self._stayed_flat)

    @cached_property
    def _stayed_flat(self) -> bool:
        extent = self.log.extent(STATE)
        path = self._trajectory(*extent, SAMPLES) if extent else no_trajectory(1)
        turn, z = path.orientation[:, :, 1:3], path.position[:, :, 2]
        return bool(np.all(np.abs(turn) < 1e-9) and np.all(np.abs(z - z[:1]) < 1e-9))


def open_recording(path: Path) -> Recording:
    """Open a log to be shown; a folder stands for the log in it, a folder of runs for the newest one.

    Raises:
        LogError: it is missing, no log of linkwind, or damaged before its scenario.
    """
    if path.is_dir():
        logs = [path / LOG] if (path / LOG).exists() else sorted(path.glob(f"*/{LOG}"), key=_written)
        if not logs:
            raise LogError(f"{path}: expected a {LOG}, or folders of runs; got none. Check the path.")
        path = logs[-1]
    return Recording(path)


def _written(path: Path) -> float:
    return path.stat().st_mtime
