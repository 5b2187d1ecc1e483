"""Regular steps of the scheme `pec`, many in one call, as far as they are the recorded ones.

What is done in a step, and why nothing can go wrong unseen, is in ``fmu/coupling/lw_march.h``.
"""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from linkwind.native.forces import Field, Indices, Plates
from linkwind.native.library import declare
from linkwind.native.multibody import Multibody
from linkwind.native.point import AcceptedPoint
from linkwind.spatial import Array, Motion, Wrench, address
from linkwind.wire import FixedLayout

_room = declare("lw_march_room", [ctypes.c_void_p], ctypes.c_size_t)
_go = declare("lw_march_go", [ctypes.c_void_p, ctypes.c_int32], ctypes.c_int32)
_pointer, _int = ctypes.c_void_p, ctypes.c_int32
Forces = Plates | Field | None  # of a model; None for no force at all
_FORCES: dict[type, int] = {type(None): 0, Plates: 1, Field: 2}  # lw_force_model
_ENERGIES = "kinetic_energy", "potential_energy", "external_work", "dissipated_work", "joint_gap"
_COUPLING = "order", "extrapolation_error", "residual", "interface_energy"


class _Message(ctypes.Structure):
    """``lw_message``."""

    _fields_ = [
        ("bytes", _pointer),
        ("size", ctypes.c_size_t),
        ("step", _pointer),
        ("time", _pointer),
        ("recorded", ctypes.POINTER(ctypes.c_char_p)),
    ]

    @classmethod
    def of(cls, layout: FixedLayout) -> _Message:
        start = _start(layout)
        places = (start + layout.regions[name].offset for name in ("step", "time_ns"))
        return cls(start, layout.size, *places)

    def expect(self, recorded: Sequence[bytes]) -> None:
        self.recorded = (ctypes.c_char_p * len(recorded))(*recorded)


class _Provider(ctypes.Structure):
    """``lw_provider``."""

    _fields_ = [
        ("model", _int),
        ("constants", _pointer),
        ("theta", _pointer),
        ("n", _int),
        ("body", _pointer),
        ("wrench", _pointer * 3),
        ("message", _Message),
    ]


class _March(ctypes.Structure):
    """``lw_march``."""

    _fields_ = [
        ("multibody", _pointer),
        ("n", _int),
        ("state_size", _int),
        ("how", _pointer),
        ("point", _pointer),
        ("providers", _int),
        ("alone", _int),
        ("provider", ctypes.POINTER(_Provider)),
        *((name, _Message) for name in ("motion", "state_message", "step_message")),
        *((name, _pointer * 4) for name in ("accepted", "trial")),
        ("energies", _pointer * len(_ENERGIES)),
        ("coupling", _pointer * len(_COUPLING)),
        ("room", _pointer),
        *((name, ctypes.c_int64) for name in ("step_ns", "first")),
        ("state", _pointer),
        ("work", ctypes.c_double * 2),
        *((name, _int) for name in ("order", "adaptive", "degree", "depth")),
        *((name, _pointer) for name in ("wrenches", "added_inertia", "weight", "differences", "errors")),
        ("gap", ctypes.c_double),
        ("force", ctypes.c_double),
    ]


class Provider(NamedTuple):
    """What answers the motion.

    Attributes:
        forces: of its model.
        bodies: index of each row of the wrench among all bodies.
        wrench: in the message.
        layout: the message ``WrenchStep``.
    """

    forces: Forces
    bodies: Indices
    wrench: Wrench
    layout: FixedLayout


class Messages(NamedTuple):
    """The other messages of a step.

    Attributes:
        motion: ``MotionStep``.
        accepted: in it.
        trial: in it.
        state: ``State``, into which the accepted point writes.
        step: ``Step``.
    """

    motion: FixedLayout
    accepted: Motion
    trial: Motion
    state: FixedLayout
    step: FixedLayout


class Recording(NamedTuple):
    """What the messages are to be, step by step, all of the same number of steps.

    Attributes:
        motion: ``MotionStep``.
        wrenches: ``WrenchStep`` of each provider.
        state: ``State``.
        step: ``Step``.
    """

    motion: Sequence[bytes]
    wrenches: Sequence[Sequence[bytes]]
    state: Sequence[bytes]
    step: Sequence[bytes]


class Place(NamedTuple):
    """Where a run is between two steps; the arrays are brought up to date.

    Attributes:
        step: the next one.
        state: accepted before it, shape (state_size,).
        work: done by fluid and force elements, and dissipated, since t_0 [J].
        wrenches: the last ones, newest first, shape (depth, n, 6), in W.
        added_inertia: which every answer is to have, shape (n, 6, 6), body frame; None for none.
        weight: of wrenches, shape (n, 6).
        differences: of the weighted wrenches, shape (p + 2, 6n).
        errors: of the extrapolation by degree, shape (p + 1,).
        degree: of the next extrapolation.
        adaptive: whether that may change.
    """

    step: int
    state: Array
    work: tuple[float, float]
    wrenches: Array
    added_inertia: Array | None
    weight: Array
    differences: Array
    errors: Array
    degree: int
    adaptive: bool


class Done(NamedTuple):
    """What came of it.

    Attributes:
        steps: that were taken.
        work: as in ``Place``, afterwards [J].
        degree: likewise.
        joint_gap: largest of these steps [m].
        force: likewise [N].
    """

    steps: int
    work: tuple[float, float]
    degree: int
    joint_gap: float
    force: float


class March:
    """Takes steps of a mechanism and its providers in the memory of their own messages."""

    def __init__(
        self,
        multibody: Multibody,
        point: AcceptedPoint,
        providers: Sequence[Provider],
        messages: Messages,
        step_ns: int,
    ) -> None:
        """Prepare.

        Args:
            multibody: has taken a step already; all others are taken with its settings.
            point: writes into the message ``State``.
            providers: in the scenario's order.
            messages: the other ones.
            step_ns: communication step [ns].
        """
        self._kept = multibody, point, providers, messages  # alive as long as their addresses are used
        self._providers = (_Provider * len(providers))(*map(_provider, providers))
        motion, accepted, trial, state, step = messages
        n = multibody.n
        self._march = _March(
            multibody._model, n, multibody.state_size, multibody._step_at, point.at,
            len(providers), len(providers) == 1 and list(providers[0].bodies) == list(range(n)),
            self._providers, *map(_Message.of, (motion, state, step)),
            (_pointer * 4)(*accepted.addresses), (_pointer * 4)(*trial.addresses),
            (_pointer * len(_ENERGIES))(*_places(state, _ENERGIES)),
            (_pointer * len(_COUPLING))(*_places(step, _COUPLING)),
            step_ns=step_ns,
        )  # fmt: skip
        self._room = np.zeros(0)

    def go(self, place: Place, recorded: Recording) -> Done:
        """Take steps up to the first that is not the recorded one.

        A message of another length ends the recording there.
        """
        march = self._march
        march.first, march.work, march.degree = place.step, place.work, place.degree
        march.order, march.adaptive, march.depth = len(place.errors) - 1, place.adaptive, len(place.wrenches)
        for name in ("state", "wrenches", "weight", "differences", "errors"):
            setattr(march, name, address(getattr(place, name)))
        march.added_inertia = None if place.added_inertia is None else address(place.added_inertia)
        march.gap = march.force = 0.0
        expected = [
            (march.motion, recorded.motion), (march.state_message, recorded.state),
            (march.step_message, recorded.step),
            *((p.message, recorded.wrenches[i]) for i, p in enumerate(self._providers)),
        ]  # fmt: skip
        for message, payloads in expected:
            message.expect(payloads)
        count = min(_of_size(payloads, message.size) for message, payloads in expected)
        at = ctypes.addressof(march)
        if len(self._room) < (size := _room(at)):
            self._room = np.zeros(size)
        march.room = address(self._room)
        steps = _go(at, count)
        return Done(steps, tuple(march.work), march.degree, march.gap, march.force)


def _provider(provider: Provider) -> _Provider:
    forces, bodies, wrench, layout = provider
    theta = address(forces.theta) if isinstance(forces, Field) else None
    places = (_pointer * 3)(*wrench.addresses), _Message.of(layout)
    return _Provider(
        _FORCES[type(forces)], None if forces is None else forces.at, theta,
        len(bodies), bodies.__array_interface__["data"][0], *places,
    )  # fmt: skip


def _start(layout: FixedLayout) -> int:
    return ctypes.addressof(ctypes.c_char.from_buffer(layout.buffer))


def _places(layout: FixedLayout, names: Sequence[str]) -> list[int]:
    return [_start(layout) + layout.regions[name].offset for name in names]


def _of_size(payloads: Sequence[bytes], size: int) -> int:
    """Return how many of the first messages have a length."""
    return next((i for i, payload in enumerate(payloads) if len(payload) != size), len(payloads))
