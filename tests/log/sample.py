"""A small run to log: random states of two bodies."""

from __future__ import annotations

import json
from typing import NamedTuple

import numpy as np

from linkwind.log.state import StateMessage, StepEncoder, TimingEncoder
from linkwind.log.writer import LogWriter
from linkwind.schema import MESSAGES
from linkwind.spatial import Motion, Wrench

STEP_NS = 1_000_000

PLATE = {"type": "plate", "length": 0.5, "span": 1.0}
SCENARIO = {
    "name": "two_link",
    "time": {"end": 0.1},
    "coupling": {"step": 1e-3},
    "bodies": [
        {"name": "link1", "mass": 2.0, "shape": PLATE},
        {"name": "link2", "mass": 1.0, "shape": {"type": "plate", "length": 0.3, "span": 0.8}},
        {"name": "ball", "mass": 0.5},
    ],
    "joints": [{"name": "hinge", "parent": "link1", "child": "link2", "child_point": [-0.15, 0.0, 0.0]}],
    "environment": {},
}
NAMES = ("link1", "link2", "ball")
N, NQ, NV = 3, 5, 4


class State(NamedTuple):
    """One communication point with random values."""

    motion: Motion
    wrench: Wrench
    arrays: dict
    scalars: dict


def state(rng):
    orientation = rng.normal(size=(N, 4))
    orientation /= np.linalg.norm(orientation, axis=1, keepdims=True)
    motion = Motion(rng.normal(size=(N, 3)), orientation, rng.normal(size=(N, 3)), rng.normal(size=(N, 3)))
    wrench = Wrench(10.0 * rng.normal(size=(N, 3)), rng.normal(size=(N, 3)))
    arrays = {"q": rng.normal(size=NQ), "v": rng.normal(size=NV)}
    arrays |= {name: rng.normal(size=(N, 6)) for name in ("acceleration", "reaction", "wrench")}
    names = ("kinetic_energy", "potential_energy", "external_work", "dissipated_work", "joint_gap")
    return State(motion, wrench, arrays, dict(zip(names, rng.normal(size=5).tolist(), strict=True)))


def new_writer(path, **options):
    arguments = {
        "run": "run-1",
        "scenario_json": json.dumps(SCENARIO),
        "body_names": NAMES,
        "provider_bodies": {"aero": ["link1", "link2"]},
        "metadata": {"tables_sha256": "ab" * 32},
    }
    return LogWriter(path, **(arguments | options))


def motion_step(k, motion):
    message = MESSAGES["MotionStep"](run="run-1", step=k, iteration=0, time_ns=k * STEP_NS, final=0)
    for part in (message.accepted, message.trial):
        for name in ("position", "orientation", "linear", "angular"):
            getattr(part, name)[:] = getattr(motion, name).ravel()
    return message


def wrench_step(k, wrench):
    message = MESSAGES["WrenchStep"](
        run="run-1", provider="aero", step=k, iteration=0, time_ns=k * STEP_NS, kind=1
    )
    message.force[:], message.torque[:] = wrench.force[:2].ravel(), wrench.torque[:2].ravel()
    return message


def encoded(message, k, time_ns, point):
    """Fill a StateMessage and return it encoded."""
    for name in ("position", "orientation", "linear", "angular"):
        getattr(message.motion, name)[...] = getattr(point.motion, name)
    for name, array in point.arrays.items():
        message.fields[name][:] = array.ravel()
    return message.encode(k, time_ns, **point.scalars)


class Recorder:
    """Logs communication points and remembers every message as (topic, time, payload)."""

    def __init__(self, writer):
        self.writer = writer
        self.messages = []
        self._state, self._step, self._timing = StateMessage(N, NQ, NV), StepEncoder(3), TimingEncoder()

    def point(self, k, point):
        t = k * STEP_NS
        state = encoded(self._state, k, t, point)
        diagnostics = {"extrapolation_error": [0.5 * k], "residual": 2.0, "interface_energy": -0.25 * k}
        step = self._step.encode(k, t, iteration=0, order=k % 4, **diagnostics)
        messages = [
            ("/motion", motion_step(k, point.motion).SerializeToString()),
            ("/wrench/aero", wrench_step(k, point.wrench).SerializeToString()),
            ("/state", state),
            ("/step", step),
            ("/timing", self._timing.encode(k, 70_000 + k)),
        ]
        for topic, payload in messages:
            _, method, *provider = topic.split("/")
            getattr(self.writer, method)(*provider, payload, t)
            self.messages.append((topic, t, payload))


def record(path, points, *, flush_every=None):
    """Write a complete log of ``points`` random states; return them and the messages in order."""
    rng = np.random.default_rng(1)
    states = [state(rng) for _ in range(points)]
    with new_writer(path) as writer:
        recorder = Recorder(writer)
        for k, point in enumerate(states):
            recorder.point(k, point)
            if flush_every and k % flush_every == flush_every - 1:
                writer.flush()
        writer.close(final_state_sha256="cd" * 32)
    return states, recorder.messages
