"""What the page needs of a run, as numbers: read from the log, no HTML."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from linkwind.errors import LinkwindError
from linkwind.log.contents import STATE, STEP, TIMING, WRENCH
from linkwind.log.origin import origin
from linkwind.log.reader import Log, open_log
from linkwind.log.tables import Trajectory, seconds
from linkwind.mechanism import build
from linkwind.mechanism.labels import labels
from linkwind.report.flow import Flow, survey
from linkwind.report.volume import Volume, survey_volume
from linkwind.report.wake import Wake, survey_wake
from linkwind.scenario import from_json
from linkwind.scenario.topology import carries
from linkwind.spatial import Array

ANGLE = 2  # which coordinate of a planar joint is one


@dataclass(frozen=True)
class Diagnostics:
    """A provider's own numbers.

    Attributes:
        provider: its name.
        names: of its numbers.
        t: simulation time of each answer [s], shape (m,).
        values: of the numbers, shape (m, len(names)).
    """

    provider: str
    names: tuple[str, ...]
    t: Array
    values: Array


class Coordinate(NamedTuple):
    """The coordinate of a joint that has one.

    Attributes:
        joint: its name.
        body: index of the body that it carries.
        turns: whether it is an angle [rad]; else a distance [m].
        q: its place among the joint coordinates.
        v: that of its rate among the joint velocities.
    """

    joint: str
    body: int
    turns: bool
    q: int
    v: int


class Drive(NamedTuple):
    """A force element that moves a joint: an actuator or a motion.

    Attributes:
        name: its name.
        body: index of the body that the joint carries.
        column: its place among the force elements.
        turns: whether its effort is a torque [N·m]; else a force [N].
    """

    name: str
    body: int
    column: int
    turns: bool


@dataclass(frozen=True)
class Run:
    """One run, complete or not.

    Attributes:
        scenario: the resolved scenario, as its canonical JSON holds it.
        complete: whether the run came to its end.
        error: what ended it early, or is wrong with its log; None if nothing is known.
        versions: versions and hashes, by name.
        origin: what the run was made from, if not from its scenario alone; a sentence each.
        trajectory: the accepted states, shape (k, …); k may be 0.
        coupling_time: t of each exchange [s], shape (m,).
        order: degree of the extrapolation, shape (m,).
        extrapolation_error: E_0 … E_p by degree, shape (m, p+1), NaN where not measured.
        interface_energy: step size times the power of the wrench on trial minus accepted twist [J],
            shape (m,).
        exchange: wall time of each exchange [s], shape (m,).
        flows: frames of the fluid in a plane, of each provider that showed any.
        volumes: frames of the fluid in a box, likewise.
        wakes: frames of wings with their wakes, likewise.
        diagnostics: numbers of each provider that reported any.
        coordinates: of the joints that have one.
    """

    scenario: Mapping[str, Any]
    complete: bool
    error: str | None
    versions: Mapping[str, str]
    trajectory: Trajectory
    coupling_time: Array
    order: NDArray[Any]
    extrapolation_error: Array
    interface_energy: Array
    exchange: Array
    flows: tuple[Flow, ...] = ()
    volumes: tuple[Volume, ...] = ()
    wakes: tuple[Wake, ...] = ()
    diagnostics: tuple[Diagnostics, ...] = ()
    origin: tuple[str, ...] = ()
    coordinates: tuple[Coordinate, ...] = ()

    @property
    def steps(self) -> int:
        """Communication steps that were accepted."""
        return max(0, len(self.trajectory.t) - 1)

    @property
    def planned_steps(self) -> int:
        """Communication steps that the scenario asks for."""
        end, step = float(self.scenario["time"]["end"]), float(self.scenario["coupling"]["step"])
        return round(end / step)

    @property
    def bodies(self) -> list[str]:
        """Names of the bodies, in scenario order."""
        return [body["name"] for body in self.scenario["bodies"]]

    @property
    def joint_of(self) -> list[Mapping[str, Any] | None]:
        """The scenario's joint that carries each body; None where the body moves freely."""
        carried = {joint["child"]: joint for joint, free in self._joints if free}
        return [carried.get(name) for name in self.bodies]

    @property
    def closures(self) -> list[Mapping[str, Any]]:
        """The scenario's joints that close loops."""
        return [joint for joint, free in self._joints if not free]

    @property
    def drives(self) -> list[Drive]:
        """The actuators and motions of the joints; none where the log says nothing of force elements."""
        joints = {joint["name"]: joint for joint in self.scenario.get("joints", ())}
        told, bodies = self.trajectory.force_effort.shape[1], self.bodies
        return [
            Drive(
                force["name"],
                bodies.index(joint["child"]),
                i,
                joint["type"] == "revolute" or (joint["type"] == "planar" and force["coordinate"] == ANGLE),
            )
            for i, force in enumerate(self.scenario.get("forces", ())[:told])
            if force["type"] in ("actuator", "motion")
            for joint in (joints[force["joint"]],)
        ]

    @property
    def released(self) -> dict[str, float]:
        """When joints were released [s], by their names."""
        times = self.trajectory.event_time
        events = self.scenario.get("events", ())
        last = times[-1].tolist() if len(times) else []
        return {
            event["joint"]: at
            for event, at in zip(events, last, strict=False)
            if event["action"] == "release" and at >= 0.0
        }

    @property
    def _joints(self) -> list[tuple[Mapping[str, Any], bool]]:
        joints = self.scenario.get("joints", ())
        return list(zip(joints, carries((j["type"], j["parent"], j["child"]) for j in joints), strict=True))

    @cached_property
    def planar(self) -> bool:
        """Whether everything stays in a plane of constant z and turns about z only."""
        path = self.trajectory
        turn = np.abs(path.orientation[:, :, 1:3])
        lift = np.abs(path.position[:, :, 2] - path.position[:1, :, 2])
        return bool(np.all(turn < 1e-9) and np.all(lift < 1e-9))

    @property
    def energy_residual(self) -> Array:
        """Change of kinetic + potential - external + dissipated since the start [J], shape (k,)."""
        path = self.trajectory
        balance = path.kinetic_energy + path.potential_energy - path.external_work + path.dissipated_work
        return balance - balance[:1]

    @property
    def largest_force(self) -> float | None:
        """Largest aerodynamic force on a body [N]."""
        return largest(np.linalg.norm(self.trajectory.wrench[:, :, :3], axis=-1))

    @property
    def largest_gap(self) -> float | None:
        """Largest distance of two joint points [m]; None without joints."""
        return largest(self.trajectory.joint_gap) if self.scenario.get("joints") else None

    @property
    def final_state_sha256(self) -> str | None:
        """SHA-256 of the last state: little-endian float64, per body x y z qw qx qy qz vx vy vz wx wy wz."""
        path = self.trajectory
        if not len(path.t):
            return None
        parts = (path.position[-1], path.orientation[-1], path.linear[-1], path.angular[-1])
        return hashlib.sha256(np.hstack(parts).astype("<f8").tobytes()).hexdigest()


def largest(values: Array) -> float | None:
    """Return the largest finite value, or None."""
    finite = values[np.isfinite(values)]
    return float(finite.max()) if finite.size else None


def read(path: Path) -> Run:
    """Read a run from its MCAP log, which may be cut short.

    Raises:
        LogError: the file is missing, not a log of linkwind, or damaged before its scenario.
    """
    log = open_log(path)
    scenario = json.loads(log.scenario_json)
    # A run that ended before its first state, or a log that was cut, may lack a topic.
    coupling = log.steps_table() if STEP in log.topics else None
    return Run(
        scenario=scenario,
        complete=log.complete,
        error=_trouble(log),
        versions=log.versions,
        trajectory=log.trajectory() if STATE in log.topics else no_trajectory(len(scenario["bodies"])),
        coupling_time=coupling.t if coupling else np.empty(0),
        order=coupling.order if coupling else np.empty(0),
        extrapolation_error=coupling.extrapolation_error if coupling else np.empty((0, 0)),
        interface_energy=coupling.interface_energy if coupling else np.empty(0),
        exchange=log.timing().exchange_ns / np.float64(1e9) if TIMING in log.topics else np.empty(0),
        flows=tuple(filter(None, (survey(name, partial(log.frames, name)) for name in log.flows))),
        volumes=tuple(
            filter(None, (survey_volume(name, partial(log.volume_frames, name)) for name in log.volumes))
        ),
        wakes=tuple(filter(None, (survey_wake(name, partial(log.wake_frames, name)) for name in log.wakes))),
        diagnostics=tuple(_diagnostics(log)),
        origin=tuple(origin(log)),
        coordinates=coordinates(log.scenario_json),
    )


def coordinates(scenario_json: str) -> tuple[Coordinate, ...]:
    """Return the coordinates of the joints of a scenario that have one, and keep it."""
    try:
        scenario = from_json(scenario_json)
        mechanism = build(scenario)
    except LinkwindError:  # it is of another version: the rest of the log can be shown all the same
        return ()
    q, v = (list(labels(mechanism)[field]) for field in ("q", "v"))
    bodies = {joint: body for body, joint in enumerate(mechanism.joints)}
    return tuple(
        Coordinate(
            joint.name,
            bodies[joint.name],
            joint.type == "revolute",
            q.index(f"{joint.name}.q"),
            v.index(f"{joint.name}.v"),
        )
        for joint in scenario.joints
        if f"{joint.name}.q" in q
    )


def _diagnostics(log: Log) -> Iterator[Diagnostics]:
    for provider, names in log.diagnostics.items():
        if log.topics.get(WRENCH + provider):
            columns = log.columns(WRENCH + provider)
            t, values = seconds(columns["time_ns"][:, 0]), columns["diagnostics"]
            yield Diagnostics(provider, names[: values.shape[1]], t, values)


def no_trajectory(n: int) -> Trajectory:
    """Return a trajectory of ``n`` bodies without a single state."""
    widths = {"position": 3, "orientation": 4, "linear": 3, "angular": 3}
    widths |= {"acceleration": 6, "reaction": 6, "wrench": 6}
    blank: dict[str, Any] = dict.fromkeys(Trajectory._fields, np.empty(0))
    blank |= {name: np.empty((0, n, width)) for name, width in widths.items()}
    blank |= {"q": np.empty((0, 0)), "v": np.empty((0, 0)), "step": np.empty(0, np.uint64)}
    blank |= {"closure_reaction": np.empty((0, 0, 6)), "event_time": np.empty((0, 0))}
    blank |= {"force_effort": np.empty((0, 0)), "force_power": np.empty((0, 0))}
    return Trajectory(**blank)


def _trouble(log: Log) -> str | None:
    damage = f"The log is damaged: {log.damage.text}" if log.damage else None
    return "\n".join(text for text in (log.error, damage) if text) or None
