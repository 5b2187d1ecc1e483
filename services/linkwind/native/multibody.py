"""The multibody core: flat tables of a mechanism in, motion out.

The equations, the joint coordinates and the integrators are in ``fmu/README.md``. Everything is SI, in
world axes at the centres of mass, and body i is carried by joint i.
"""

from __future__ import annotations

import ctypes
import struct
from collections.abc import Sequence

import numpy as np

from linkwind.native.faults import Fault, Names, fail
from linkwind.native.library import declare
from linkwind.native.results import AffineStep, Evaluation, Integrator
from linkwind.native.tables import (
    ACTIONS,
    DISTANCE,
    FORCE_TYPES,
    JOINT_TYPES,
    KEEP_ROTATION,
    KEEP_TRANSLATION,
    NQ,
    NV,
    OCCASIONS,
    QUATERNION_AT,
    CTables,
    Tables,
    contiguous,
    counts,
    refuse,
)
from linkwind.spatial import Array, Motion, address

__all__ = [
    "ACTIONS",
    "DISTANCE",
    "FORCE_TYPES",
    "JOINT_TYPES",
    "KEEP_ROTATION",
    "KEEP_TRANSLATION",
    "NOT_YET",
    "NQ",
    "NV",
    "OCCASIONS",
    "ORDERED",
    "QUATERNION_AT",
    "AffineStep",
    "Evaluation",
    "Integrator",
    "Multibody",
    "Tables",
]  # fmt: skip


_pointer, _int, _double = ctypes.c_void_p, ctypes.c_int32, ctypes.c_double
_size = declare("lw_multibody_size", [_pointer], ctypes.c_size_t)
_init = declare("lw_multibody_init", [_pointer] * 3)
_advance = declare("lw_multibody_advance", [_pointer] * 2)
_radau5_size = declare("lw_radau5_size", [_int] * 2, ctypes.c_size_t)
_set_inputs = declare("lw_multibody_set_inputs", [_pointer] * 2, None)
_affine_size = declare("lw_affine_size", [_int], ctypes.c_size_t)
_affine_inertia = declare("lw_affine_inertia", [_pointer] * 4 + [_double, _pointer], None)
_advance_affine = declare("lw_multibody_advance_affine", [_pointer] * 3)
_motion = declare("lw_multibody_motion", [_pointer] * 6, None)
_evaluate = declare("lw_multibody_evaluate", [_pointer, _pointer, _double] + [_pointer] * 4)
_prescribe = declare("lw_multibody_prescribe", [_pointer, _pointer, _double, _pointer])
_row_count = declare("lw_closure_row_count", [_pointer], _int)
_closures = declare("lw_multibody_closures", [_pointer] * 4, None)
_close = declare("lw_multibody_close", [_pointer] * 3)
_energy = declare("lw_multibody_energy", [_pointer] * 4, None)
_joint_gap = declare("lw_multibody_joint_gap", [_pointer] * 3, _double)
_repeat = declare("lw_multibody_repeat", [_pointer, _pointer, _int])
# lw_macro_step: packing all of it at once is several times faster than converting fifteen arguments.
NOT_YET, ORDERED = -1.0, -2.0  # in a state: an event that has not happened; one that shall, on command
KNOWN_ARRAYS = 32  # whose addresses are remembered
_macro_step = struct.Struct("@PddPPPddiiiPPPPP")
_affine = struct.Struct("@PPPPPP")
_evaluation = struct.Struct("@7P")


class Multibody:
    """A mechanism, ready to move.

    One object serves one thread at a time. All methods are pure functions of their arguments: the same
    input gives the same bits.

    Attributes:
        n: number of bodies.
        nq: number of coordinates.
        nv: number of degrees of freedom of the tree of bodies.
        closures: number of joints that close loops of it.
        rows: number of equations that they are.
        events: number of things that may happen to joints.
        forces: number of force elements.
        inputs: number of their inputs.
        state_size: length of a state: q, v, the substep [s] that dopri5 would take next (0 = unknown), and
            for each event the time at which it happened [s], or ``NOT_YET``; a stop has since when its joint
            rests on it.
        results: of the last evaluation, written over by the next.
    """

    def __init__(
        self,
        tables: Tables,
        bodies: Sequence[str] = (),
        closures: Sequence[str] = (),
        events: Sequence[str] = (),
        forces: Sequence[str] = (),
    ) -> None:
        """Build the mechanism.

        Args:
            tables: the mechanism.
            bodies: names of the bodies, for errors; their numbers if not given.
            closures: likewise of the joints that close loops.
            events: likewise of what may happen.
            forces: likewise of the force elements.

        Raises:
            MechanismError: a table has a wrong shape or a wrong value.
        """
        arrays = contiguous(tables)
        self.tables = tables
        many = counts(tables)
        self.n, self.nq, self.nv, self.closures, self.events, self.forces = list(many.values())[:6]
        named = (bodies, self.n), (closures, self.closures), (events, self.events), (forces, self.forces)
        self._names = Names(*(_quoted(names, count) for names, count in named))
        self.inputs = many["inputs"]
        self.state_size = self.nq + self.nv + 1 + self.events
        pointers = {name: array.ctypes.data for name, array in arrays.items()}
        native = CTables(**many, **pointers)
        self.rows = _row_count(ctypes.addressof(native))
        self._memory = np.zeros((_size(ctypes.addressof(native)) + 7) // 8)
        self._state, self._next = np.zeros(self.state_size), np.zeros(self.state_size)
        self._work, self._energies, self._fault = np.zeros(2), np.zeros(2), Fault()
        buffers = (self._memory, self._state, self._next, self._work, self._energies)
        self._model, self._state_at, self._next_at, self._work_at, self._energies_at = map(address, buffers)
        self._fault_at = ctypes.addressof(self._fault)
        self._evaluation = ctypes.create_string_buffer(_evaluation.size)
        self._make_room()
        self._step = ctypes.create_string_buffer(_macro_step.size)
        self._step_at = ctypes.addressof(self._step)
        self._affine = ctypes.create_string_buffer(_affine.size)
        self._met, self._scratch = np.zeros(0), np.zeros(0)  # made when an affine wrench comes
        self._stages = np.zeros(0)  # made when radau5 is asked for
        self._known: dict[int, tuple[Array, int]] = {}
        if status := _init(self._model, ctypes.addressof(native), self._fault_at):
            refuse(tables, status, self._fault.item)
        self._at_start = arrays["force_constants"][arrays["force_input"]]

    def _make_room(self) -> None:
        """Make room for what ``Evaluation`` has, in its order, which is that of the struct."""
        six, force, closing = (self.n, 6), (self.forces,), (self.closures, 6)
        self.results = Evaluation(*map(np.zeros, ((self.nv,), six, six, six, force, force, closing)))
        _evaluation.pack_into(self._evaluation, 0, *map(address, self.results))

    def initial_state(self, q: Array, v: Array) -> Array:
        """Return the state with coordinates ``q``, shape (nq,), and velocities ``v``, shape (nv,).

        Quaternions in q are normalised.

        Raises:
            ValueError: a wrong shape, a number that is not finite, or a quaternion of zero length.
        """
        for name, value, size in (("q", q, self.nq), ("v", v, self.nv)):
            if np.shape(value) != (size,):
                raise ValueError(f"{name}: expected shape ({size},); got {np.shape(value)}. See nq and nv.")
            if not np.isfinite(value).all():
                raise ValueError(f"{name}: expected finite numbers; got {value}. Correct the initial state.")
        state = np.concatenate([q, v, [0.0], np.full(self.events, NOT_YET)]).astype(np.float64)
        for code, start in zip(self.tables.joint_type, self.tables.q_index, strict=True):
            if code not in QUATERNION_AT:
                continue
            first = int(start) + QUATERNION_AT[code]
            quaternion = state[first : first + 4]
            if not quaternion.any():
                raise ValueError(f"q[{first}:{first + 4}]: expected a quaternion; got zeros. Use 1, 0, 0, 0.")
            quaternion /= np.linalg.norm(quaternion)
        return state

    def coordinates(self, state: Array) -> tuple[Array, Array]:
        """Return the joint coordinates, shape (nq,), and velocities, shape (nv,), of a state."""
        return state[: self.nq], state[self.nq : self.nq + self.nv]

    def advance(
        self,
        state: Array,
        h: float,
        nodes: Array,
        wrenches: Array,
        added_inertia: Array | None,
        *,
        integrator: Integrator | int,
        time: float = 0.0,
        substeps: int = 1,
        rtol: float = 1e-6,
        atol: float = 1e-9,
        inputs: Array | None = None,
    ) -> tuple[Array, Array]:
        """Take one macro step.

        The wrench is the Lagrange polynomial through ``wrenches`` at ``nodes``; one node holds it.

        Args:
            state: shape (state_size,).
            h: macro step [s].
            nodes: shape (m,), m ≤ 8, in units of h from the start of the step: 0 is its start, 1 its end.
            wrenches: [N, N·m], shape (m, n, 6), force first, in W at the centres of mass, C-contiguous.
            added_inertia: A, shape (n, 6, 6), in the body frames, symmetric positive semi-definite,
                C-contiguous; the force -A a is added to the wrench. Or None.
            integrator: one of ``Integrator``.
            time: at the start of the step [s], for events.
            substeps: number of equal substeps; of dopri5, h/substeps bounds the first substep.
            rtol: tolerance of dopri5, relative to each coordinate and velocity, per substep.
            atol: its absolute part, in the unit of the coordinate.
            inputs: of force elements, shape (m, inputs), C-contiguous, the same polynomial in time; None: as
                at the start.

        Returns:
            The new state, and the work [J], shape (2,): done over the step by the whole wrench, and taken
            by the joint dampers and by events, integrated with the same scheme.

        Raises:
            SimulationError: singular inertia, NaN or infinity, an underflow of the substep, or Newton's
                method of radau5 does not converge.
            ValueError: an argument that makes no sense, or of a wrong shape.
        """
        if inputs is not None and inputs.shape != (len(nodes), self.inputs):
            self._refuse("inputs", (len(nodes), self.inputs), inputs)
        how = integrator, time, substeps, rtol, atol
        self._prepare(state, h, nodes, wrenches, added_inertia, *how, inputs)
        status = _advance(self._model, self._step_at)
        if inputs is not None:
            _set_inputs(self._model, address(self._at_start))
        if status:
            arguments = {"h": h, "nodes": nodes, "integrator": integrator, "substeps": substeps}
            fail(status, self._fault, self._names, arguments | {"rtol, atol": (rtol, atol)})
        return self._next.copy(), self._work.copy()

    def _prepare(
        self, state: Array, h: float, nodes: Array, wrenches: Array, added_inertia: Array | None,
        integrator: Integrator | int, time: float, substeps: int, rtol: float, atol: float,
        inputs: Array | None = None,
    ) -> None:  # fmt: skip
        """Fill the ``lw_macro_step``."""
        count = len(nodes)
        self._take(state)
        if wrenches.shape != (count, self.n, 6):
            self._refuse("wrenches", (count, self.n, 6), wrenches)
        _macro_step.pack_into(
            self._step, 0, self._state_at, h, time, self._locate(nodes), self._locate(wrenches),
            self._locate_added(added_inertia), rtol, atol, count, integrator, substeps,
            self._next_at, self._work_at, self._fault_at, self._locate_stages(integrator),
            0 if inputs is None else address(inputs),
        )  # fmt: skip

    def advance_affine(
        self,
        state: Array,
        h: float,
        nodes: Array,
        wrenches: Array,
        added_inertia: Array | None,
        response: Array,
        about: Array,
        *,
        integrator: Integrator | int,
        time: float = 0.0,
        substeps: int = 1,
        rtol: float = 1e-6,
        atol: float = 1e-9,
    ) -> tuple[Array, Array, AffineStep]:
        """Take one macro step under a wrench that depends on the twist at its end.

        ``wrenches[0]`` is meant for the twist ``about``; for the one that comes out it is less by
        ``response @ (twist - about)``. A wrench that is held (one node) may act on massless bodies.
        ``response`` is G, shape (6n, 6n), in W: rows force and torque, columns linear and angular of body
        after body; ``about`` has shape (n, 6), linear first, in W; all else is as for ``advance``.

        Returns:
            State and work as ``advance`` does, and what the wrench came to.

        Raises:
            SimulationError: as ``advance``; or no wrench agrees with the twist that it leads to.
            ValueError: an argument that makes no sense, or of a wrong shape.
        """
        n, m = self.n, 6 * self.n
        if response.shape != (m, m):
            self._refuse("response", (m, m), response)
        if about.shape != (n, 6):
            self._refuse("about", (n, 6), about)
        self._prepare(state, h, nodes, wrenches, added_inertia, integrator, time, substeps, rtol, atol)
        if not len(self._met):
            self._met, self._scratch = np.zeros(48 * n), np.zeros(_affine_size(n))
        first = self._locate(self._met)
        results_at = (first, first + 48 * n, first + 96 * n)
        given_at = (self._locate(response), address(about))
        _affine.pack_into(self._affine, 0, *given_at, *results_at, self._locate(self._scratch))
        if status := _advance_affine(self._model, self._step_at, ctypes.addressof(self._affine)):
            arguments = {"h": h, "nodes": nodes, "integrator": integrator, "substeps": substeps}
            fail(status, self._fault, self._names, arguments | {"rtol, atol": (rtol, atol)})
        met = self._met.copy()
        parts = met[: 6 * n].reshape(n, 6), met[6 * n : 12 * n].reshape(n, 6), met[12 * n :].reshape(n, 6, 6)
        return self._next.copy(), self._work.copy(), AffineStep(*parts)

    def affine_inertia(self, state: Array, added_inertia: Array | None, response: Array, h: float) -> Array:
        """Return the added inertia, shape (n, 6, 6), body frame, that G amounts to over a step of h [s].

        Only each body's own block counts; ``added_inertia`` is added.
        """
        self._take(state)
        inertia = np.empty((self.n, 6, 6))
        added_at = self._locate_added(added_inertia)
        _affine_inertia(self._model, self._state_at, added_at, address(response), h, address(inertia))
        return inertia

    def motion(self, state: Array, out: Motion) -> None:
        """Write poses and twists of the bodies at ``state``, shape (state_size,), into ``out``."""
        self._take(state)
        if len(out) != self.n:
            raise ValueError(f"out: expected a Motion of {self.n} bodies; got {len(out)}. One per body.")
        _motion(self._model, self._state_at, *out.addresses)

    def evaluate(
        self, state: Array, wrench: Array, added_inertia: Array | None = None, *, time: float = 0.0
    ) -> Evaluation:
        """Return accelerations and forces under a wrench, shape (n, 6), in W, at a time [s].

        Raises:
            SimulationError: singular inertia, NaN or infinity.
            ValueError: an argument of a wrong shape.
        """
        self._take(state)
        if wrench.shape != (self.n, 6):
            self._refuse("wrench", (self.n, 6), wrench)
        status = _evaluate(
            self._model, self._state_at, time, self._locate(wrench), self._locate_added(added_inertia),
            ctypes.addressof(self._evaluation), self._fault_at,
        )  # fmt: skip
        if status:
            fail(status, self._fault, self._names, {})
        return Evaluation(*map(np.copy, self.results))

    def prescribe(self, state: Array, time: float) -> Array:
        """Return a state with what motions prescribe as it is at a time [s].

        Raises:
            SimulationError: a motion gives no number.
        """
        self._take(state)
        if status := _prescribe(self._model, self._state_at, time, self._fault_at):
            fail(status, self._fault, self._names, {})
        return self._state.copy()

    def violations(self, state: Array) -> tuple[Array, Array]:
        """Return by how much each equation of the closures is violated, and how that depends on the motion.

        Returns:
            Violations [m; of directions that should be square, the cosine], shape (rows,), and their Jacobian
            J, shape (rows, nv): they change by J v.
        """
        self._take(state)
        value, jacobian = np.zeros(self.rows), np.zeros((self.rows, self.nv))
        _closures(self._model, self._state_at, address(value), address(jacobian))
        return value, jacobian

    def close(self, state: Array) -> Array:
        """Return the state nearest to ``state``, measured by kinetic energy, that closes all loops.

        Raises:
            SimulationError: none is found near by.
        """
        self._take(state)
        if status := _close(self._model, self._state_at, self._fault_at):
            fail(status, self._fault, self._names, {})
        return self._state.copy()

    def energy(self, state: Array) -> tuple[float, float]:
        """Return kinetic and potential energy [J]: gravity from the origin of W, springs from rest."""
        self._take(state)
        _energy(self._model, self._state_at, self._energies_at, self._energies_at + 8)
        return float(self._energies[0]), float(self._energies[1])

    def joint_gap(self, motion: Motion) -> float:
        """Return the largest distance [m] by which given poses violate a joint, closures included.

        Fixed, revolute and spherical joints: the distance of the joint's two points; prismatic: off the
        axis; planar: off the plane; free: 0.
        """
        return float(_joint_gap(self._model, *motion.addresses[:2]))

    def repeat(self, state: Array, repeats: int) -> None:
        """Evaluate the accelerations ``repeats`` times without wrench: the work that benchmarks time."""
        self._take(state)
        if status := _repeat(self._model, self._state_at, repeats):
            fail(status, self._fault, self._names, {})

    def _take(self, state: Array) -> None:
        if state.shape != self._state.shape:
            self._refuse("state", self._state.shape, state)
        self._state[:] = state

    def _locate(self, array: Array) -> int:
        """Return an array's address; looked up once for an array that comes again and again."""
        known = self._known.get(id(array))
        if known is None:
            if len(self._known) == KNOWN_ARRAYS:
                self._known.clear()
            known = self._known[id(array)] = (array, address(array))  # kept alive: the id stays its own
        return known[1]

    def _locate_stages(self, integrator: int) -> int:
        if integrator != Integrator.RADAU5:
            return 0
        if not len(self._stages):
            self._stages = np.zeros(_radau5_size(self.nq, self.nv))
        return self._locate(self._stages)

    def _locate_added(self, added_inertia: Array | None) -> int:
        if added_inertia is None:
            return 0
        if added_inertia.shape != (self.n, 6, 6):
            self._refuse("added_inertia", (self.n, 6, 6), added_inertia)
        return self._locate(added_inertia)

    @staticmethod
    def _refuse(name: str, shape: tuple[int, ...], array: Array) -> None:
        raise ValueError(f"{name}: expected shape {shape}; got {array.shape}. One entry per node and body.")


def _quoted(names: Sequence[str], count: int) -> list[str]:
    return [f'"{name}"' for name in names] or [str(i) for i in range(count)]
