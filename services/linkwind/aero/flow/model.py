"""The force model: a lattice, the bodies in it, and when it steps.

With one lattice step in a communication step, ``evaluate`` changes nothing: it asks the markers which
forces would give the fluid the velocity of the trial state, and how they change with it (``G``). ``commit``
steps the fluid with the velocity that was accepted; both sides have then exchanged the same impulse. With
several lattice steps in a communication step there is no ``G``: ``evaluate`` steps the fluid along the way
to the trial state, and ``commit`` keeps that.
"""

from __future__ import annotations

import logging
import math
import struct

import numpy as np

from linkwind.aero.base import Capabilities, body_indices
from linkwind.aero.flow import grid as grids
from linkwind.aero.flow.drift import Drift
from linkwind.aero.flow.geometry import geometry
from linkwind.aero.flow.interior import weakest_axis
from linkwind.aero.flow.motion import State
from linkwind.aero.flow.refusals import Refusals
from linkwind.aero.flow.start import SmoothStart
from linkwind.aero.flow.window import Window
from linkwind.errors import ProtocolError
from linkwind.frames import FlowFrame, VolumeFrame
from linkwind.native.boundary import Placement
from linkwind.scenario import Provider, Scenario
from linkwind.spatial import Array, Motion, Wrench

_log = logging.getLogger("linkwind")

LOOK_EVERY = 8  # steps between two looks at the leak, which changes slowly
_MEMORY = struct.Struct("<qqd")  # step that was committed, the last one with a picture, the leak


class Flow:
    """Forces of an unsteady, incompressible flow around the bodies, in the plane or in space.

    The wrench [N, N·m] is the mean over a communication step, in W at the centres of mass; in the plane per
    metre of span times the span. It comes with ``G`` where a communication step is one lattice step.

    Diagnostics: ``mach``, the fastest of wind and bodies over the lattice's speed of sound (errors of
    compressibility grow with its square); ``leak``, the largest flow through an outline over the same
    speed; ``cell_reynolds``, that speed times the cell over the viscosity (above about 10 boundary layers
    are not resolved); ``substeps``, lattice steps in a communication step.
    """

    def __init__(self, scenario: Scenario, provider: Provider) -> None:
        """Plan the lattice; it is filled when the first motion comes.

        Raises:
            ScenarioError: too coarse, or the communication step too long.
        """
        self._scenario, self._provider = scenario, provider
        self._grid = grids.plan(scenario, provider)
        self._refuse = Refusals(scenario, provider)
        acted = grids.bodies(scenario, provider)
        self._acted = acted
        self._bodies = np.array(body_indices(scenario, provider))
        first = int(self._bodies[0])
        in_a_row = (self._bodies == np.arange(first, first + len(acted))).all()
        self._rows = slice(first, first + len(acted)) if in_a_row else self._bodies
        self._in = geometry(self._grid.dimensions)
        self._interior = self._in.inside(acted, self._grid.density)
        self._drift = Drift(scenario, self._grid.dimensions)
        self._reach = [grids.reach(body, self._grid.dimensions) for body in acted]
        self._twist = np.array(self._in.twist)
        self._lengths = np.where(self._twist < 3, 1.0, self._grid.cell)  # of forces, of torques
        rows = (6 * np.arange(len(acted))[:, None] + self._twist).ravel()
        self._entries = (6 * len(acted) * rows[:, None] + rows).ravel()  # of G in space
        self._every = max(1, round(scenario.steps / provider.flow.frames)) if provider.flow.frames else 0
        self._h = scenario.coupling.step_ns / 1e9
        self._start_time = grids.start_time(scenario, provider, self._grid)
        self._substeps = self._grid.substeps
        self._fluid: Window | None = None
        self._step, self._shown, self._leak = 0, -1, 0.0
        self._ahead = False  # whether the fluid has gone to the trial state, by several lattice steps
        self.capabilities = Capabilities(
            kind="mean",
            response_size=(6 * len(acted)) ** 2 if self._substeps == 1 else 0,
            own_step_ns=0 if self._substeps == 1 else round(self._grid.step * 1e9),
            diagnostics=("mach", "leak", "cell_reynolds", "substeps"),
        )

    # ---- the contract ----

    def commit(self, t: float, motion: Motion) -> None:
        """Step the fluid to time t [s] with the accepted motion, or keep where it has gone to already."""
        step = round(t / self._h)
        self._drift.go(step)
        accepted = self._drift.now.inside(self._in.state(motion, self._rows))
        if self._fluid is None:
            self._begin(accepted)
        elif step > self._step and not self._ahead:
            self._go(self._slowly(t, accepted.twist), look=step % LOOK_EVERY == 0)
        self._step, self._ahead = step, False
        self._keep_slow(accepted)
        self._accepted = accepted

    def evaluate(self, t: float, motion: Motion, wrench: Wrench) -> None:
        """Write the mean wrench over the step that ends in the trial state at time t [s].

        Raises:
            ScenarioError: the window is too small or too large.
            SimulationError: a body leaves the window or meets another, is too fast, or the fluid is unstable.
        """
        self._trial = self._drift.at(round(t / self._h)).inside(self._in.state(motion, self._rows))
        if self._fluid is None:
            self._begin(self._trial)
        elif self._ahead:
            self._window.back()
            self._ahead = False
        if self._substeps == 1 or t == 0.0:
            force, response = self._one_step(t)
        else:
            force, response = self._several_steps(t), np.zeros((len(self._twist) * len(self._bodies),) * 2)
        self._write(t, force, response, wrench)

    def frame(self) -> FlowFrame | VolumeFrame | None:
        """Return a picture of the fluid if one is due."""
        step = self._step + self._ahead
        if self._fluid is None or not self._every or step == self._shown or step % self._every:
            return None
        self._shown = step
        density, time_ns = self._scenario.environment.density, step * self._scenario.coupling.step_ns
        return self._fluid.picture(density, step, time_ns, self._drift.at(step))

    def save(self) -> bytes:
        """Return the whole fluid, as it was committed, as an opaque blob; empty before the first motion."""
        if self._fluid is None:
            return b""
        motions = np.hstack([*self._start, *self._accepted]).astype("<f8")
        leak = self._leak if self._substeps == 1 else 0.0  # else it belongs to the trial
        memory = (
            _MEMORY.pack(self._step, self._shown, leak)
            + self._drift.now.way.astype("<f8").tobytes()
            + motions.tobytes()
        )
        if not self._ahead:
            return self._fluid.save(memory)
        self._fluid.back()
        blob = self._fluid.save(memory)
        self._fluid.back()
        return blob

    def restore(self, blob: bytes) -> None:
        """Take back the fluid that ``save`` returned.

        Raises:
            ProtocolError: the blob is not one of this flow.
        """
        self._ahead = False
        if not blob:
            self._fluid, self._step, self._substeps = None, 0, self._grid.substeps
            self._drift.restart(0, np.zeros(self._grid.dimensions))
            return
        n, width = len(self._bodies), self._in.width
        each = width + len(self._twist)  # numbers of a state
        motions = _MEMORY.size + 8 * self._grid.dimensions
        if len(blob) < motions + 16 * each * n:
            raise ProtocolError(f"model flow: expected a checkpoint; got {len(blob)} bytes.")
        self._step, self._shown, self._leak = _MEMORY.unpack_from(blob)
        self._drift.restart(self._step, np.frombuffer(blob[_MEMORY.size : motions], "<f8").copy())
        numbers = np.frombuffer(blob, "<f8", 2 * each * n, motions).reshape(n, 2 * each)
        parts = np.split(numbers, [width, each, each + width], axis=1)
        start, accepted = State(*parts[:2]), State(*parts[2:])
        if self._fluid is None:
            self._begin(start)
        self._set_out(start)
        self._accepted = accepted
        self._window.restore(memoryview(blob)[motions + 16 * each * n :])
        self._substeps = round(self._h / self._window.step)
        self._measure()

    @property
    def fluid(self) -> Window:
        """The fluid, as it was committed where a communication step is one lattice step."""
        return self._window

    # ---- one step ----

    @property
    def _window(self) -> Window:
        if self._fluid is None:
            raise ProtocolError("model flow: expected a first motion, at t = 0; got none.")
        return self._fluid

    def _begin(self, start: State) -> None:
        """Fill the window around the bodies."""
        centres = start.pose[:, : self._grid.dimensions]
        size = grids.window(self._scenario, self._provider, self._grid, centres)
        self._fluid = Window(self._in, self._grid, size, centres.mean(axis=0), self._provider.flow.threads)
        self._walls = self._in.walls(self._acted, list(self._scenario.joints), start, self._grid)
        self._measure()
        self._set_out(start)
        self._accepted = start
        self._keep_slow(start)
        _log.info(
            '"%s": %s cells of %.4g m, %.4g s a lattice step, %d in a communication step; %d markers',
            self._provider.name, " × ".join(map(str, size)), self._grid.cell, self._grid.step, self._substeps,
            len(self._walls.markers.body),
        )  # fmt: skip

    def _set_out(self, start: State) -> None:
        self._start = start
        self._slowly = SmoothStart(self._start_time, self._grid.wind, start.twist)

    def _place(self, t: float, at: State) -> None:
        placement, marker = self._window.place(self._walls, at.pose)
        if placement == Placement.PLACED:
            return
        names = [self._acted[i].name for i in np.atleast_1d(self._walls.markers.body[marker]) if i >= 0]
        outside = placement == Placement.OUTSIDE
        raise self._refuse.outside(t, names) if outside else self._refuse.overlap(t, names)

    def _one_step(self, t: float) -> tuple[Array, Array]:
        """Return what the markers ask for: force in N and N·m, shape (n, d), and G, shape (dn, dn)."""
        self._place(t, self._trial)
        wall = self._slowly(t, self._trial.twist)
        self._walls.evaluate(self._window.twists(wall))
        force = self._walls.wrench * self._forces
        response = self._walls.response * self._responses
        if t > 0.0 and self._interior.any:
            inertia = self._interior.inertia(self._trial.pose)
            force += self._inside(t, wall, inertia)
            d = len(self._twist)
            for i, of_body in enumerate(inertia):
                response[d * i : d * (i + 1), d * i : d * (i + 1)] -= of_body / self._h
            self._carries_the_inside(inertia, response)
        return force, response

    def _carries_the_inside(self, inertia: Array, response: Array) -> None:
        """Refuse a free body so light that the fluid inside it, which is to be given back, moves or turns it.

        Measured on circles and ellipses of 24 to 48 cells and spheres of 20 to 32: stable where mass and
        inertia are those of the fluid inside, less half of what moves with the markers in a step.
        """
        d, linear = len(self._twist), self._grid.dimensions
        jointed = {name for joint in self._scenario.joints for name in (joint.parent, joint.child)}
        for i, body in enumerate(self._acted):
            if body.shape is None or not body.shape.closed or body.name in jointed:
                continue
            own = slice(d * i, d * (i + 1))
            needed = 0.5 * (inertia[i] - self._h * response[own, own])
            mass = float(np.linalg.eigvalsh(needed[:linear, :linear])[-1])
            if body.mass < mass:
                raise self._refuse.lighter_than_inside(body, mass)
            turning, least = weakest_axis(body, self._trial.pose[i], needed[linear:, linear:])
            if turning < least:
                raise self._refuse.turned_by_inside(body, turning, least)

    def _several_steps(self, t: float) -> Array:
        """Step the fluid to the trial state; return the mean force, shape (n, d)."""
        self._window.keep()
        self._ahead = True
        before, count = t - self._h, self._substeps
        total = np.zeros((len(self._bodies), len(self._twist)))
        for i in range(1, count + 1):
            now = before + self._h * i / count
            at = self._in.between(self._accepted, self._trial, i / count, self._h)
            self._place(now, at)
            wall = self._slowly(now, at.twist)
            self._walls.evaluate(self._window.twists(wall))
            total += self._walls.wrench
            self._go(wall, look=i == count)
        force = total * (self._forces / count)
        if self._interior.any:
            inertia = self._interior.inertia(self._trial.pose)
            force += self._inside(t, self._slowly(t, self._trial.twist), inertia)
        return force

    def _go(self, wall: Array, *, look: bool) -> None:
        leak = self._window.go(self._walls, wall, look=look)
        self._leak = self._leak if leak is None else leak

    def _inside(self, t: float, wall: Array, inertia: Array) -> Array:
        """Return what the fluid inside the outlines took, and what a wind that changes gives, (n, d)."""
        before = self._slowly(t - self._h, self._accepted.twist)
        then = self._interior.inertia(self._accepted.pose)
        gained = (inertia * wall[:, None, :]).sum(axis=2) - (then * before[:, None, :]).sum(axis=2)
        force = np.asarray(gained / self._h)
        faster = self._drift.acceleration(round(t / self._h))
        if faster is not None:
            force += (inertia[:, :, : len(faster)] * faster).sum(axis=2)
        return force

    def _measure(self) -> None:
        """Compute what a lattice unit of force and torque, and of the response, is [N, N·m; N·s/m …]."""
        each = np.tile(self._lengths, len(self._bodies))
        speed = self._window.speed
        newton = self._grid.density * self._grid.cell ** (self._grid.dimensions - 1) * speed**2
        self._forces = newton * self._lengths
        self._responses = newton / speed * np.outer(each, each)

    def _keep_slow(self, at: State) -> None:
        """Shorten the lattice step where the bodies have become too fast for it."""
        fastest = at.fastest(self._reach)
        while fastest / self._window.speed > grids.MAX_SPEED:
            if not math.isfinite(fastest) or self._substeps >= grids.MAX_SUBSTEPS:
                raise self._refuse.too_fast(fastest)
            self._shorten(fastest)

    def _shorten(self, fastest: float) -> None:
        moving = grids.moved_by_the_fluid(self._scenario, self._provider)
        light = [body.name for body in moving if body.mass < grids.moved(body, self._grid)]
        if self._substeps == 1 and light:
            limit = grids.MAX_SPEED * self._window.speed
            raise self._refuse.too_fast_for_light(light[0], fastest, limit)
        try:
            self._window.halve(self._grid.viscosity)
        except ValueError as error:
            raise self._refuse.too_fast(fastest) from error  # its viscosity is too small for a float
        self._substeps *= 2
        self._measure()
        _log.info(
            '"%s": a body goes %.4g m/s: %d lattice steps in a communication step from now on',
            self._provider.name, fastest, self._substeps,
        )  # fmt: skip

    def _write(self, t: float, force: Array, response: Array, wrench: Wrench) -> None:
        if not all(map(math.isfinite, force.ravel().tolist())):
            raise self._refuse.unstable(t, force)
        both = np.zeros((len(force), 6))
        both[:, self._twist] = force
        wrench.force[:], wrench.torque[:] = both[:, :3], both[:, 3:]
        if wrench.response is not None:
            wrench.response.fill(0.0)
            wrench.response.reshape(-1)[self._entries] = response.reshape(-1)
        if wrench.diagnostics is not None:
            speed = max(self._trial.fastest(self._reach), math.hypot(*self._grid.wind))
            wrench.diagnostics[:] = (
                speed / self._window.speed * math.sqrt(3.0),
                self._leak / speed if speed else 0.0,
                speed * self._grid.cell / self._grid.viscosity,
                self._substeps,
            )
