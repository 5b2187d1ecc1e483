"""The force model: the lattice of rings, when it sheds, and what is said when it fails."""

from __future__ import annotations

import logging
import math
import struct

import numpy as np

from linkwind.aero.base import Capabilities, body_indices, item
from linkwind.aero.planform import ends_and_middle, mean_chord, thin
from linkwind.aero.vortex.surface import middles, surfaces, trailing
from linkwind.errors import ProtocolError, SimulationError
from linkwind.frames import Single, WakeFrame, logged
from linkwind.native.vortex import VortexLattice
from linkwind.scenario import Provider, Scenario
from linkwind.spatial import Array, Motion, Wrench
from linkwind.wind import Wind

_log = logging.getLogger("linkwind")

_MEMORY = struct.Struct("<dq")  # time of the last accepted state, bytes of the frame still to be shown


class Vortex:
    """Forces of an inviscid, unsteady flow around thin wings that shed free wakes from their trailing edges.

    The wrench [N, N·m] is the mean over a communication step, in W at the centres of mass, and comes with
    ``G``; ``evaluate`` changes nothing, ``commit`` sheds a row of rings and carries the wakes on.

    Diagnostics: ``incidence_deg``, the largest angle of attack of the fastest of centre and tips of a wing
    (above 15 to 20° the flow over a real one separates, which this one does not); ``advance``, how many
    panels the fastest point goes in a step (at 1 the wake is as fine as the wing); ``wake_rows``, of rings.

    Sources: J. Katz, A. Plotkin, Low-Speed Aerodynamics, 2nd ed., Cambridge 2001, ch. 13;
    R. J. S. Simpson, R. Palacios, J. Murua, AIAA J. 51(7), 2013, doi:10.2514/1.J052136 (forces).
    """

    def __init__(self, scenario: Scenario, provider: Provider) -> None:
        """Take the wings; the rings are laid when the first motion tells where the air comes from.

        Raises:
            ScenarioError: a body is neither plate nor wing.
        """
        self._scenario, self._provider = scenario, provider
        self._wings = thin(scenario, provider)
        self._chords = [mean_chord(wing) for wing in self._wings]
        self._places = [ends_and_middle(wing) for wing in self._wings]
        self._rows = np.array(body_indices(scenario, provider))
        self._wind = Wind(scenario)
        self._h = scenario.coupling.step_ns / 1e9
        frames = provider.vortex.frames
        self._every = max(1, round(scenario.steps / frames)) if frames else 0
        self._due: WakeFrame | None = None
        self._lattice: VortexLattice | None = None
        self._sides = np.zeros(len(self._rows))
        self._evaluated, self._committed = math.nan, math.nan  # times of the last trial and accepted states
        self.capabilities = Capabilities(
            kind="mean",
            response_size=(6 * len(self._rows)) ** 2,
            own_step_ns=0,
            diagnostics=("incidence_deg", "advance", "wake_rows"),
        )

    def commit(self, t: float, motion: Motion) -> None:
        """Shed what the edges leave behind at time t [s], and carry the wakes on to the next one.

        Raises:
            SimulationError: the wind at a wake is not finite.
        """
        if t == self._committed:
            return
        pose, twist = self._state(motion)
        if t != self._evaluated:  # as at the start, before the first question
            self._solve(t, motion, pose, twist)
        lattice, step = self._made(t, motion), round(t / self._h)
        shown = self._every and step % self._every == 0
        wake = [part.astype(np.float32) for part in lattice.wake] if shown else []  # before it goes on
        if (corner := lattice.commit(t, pose, twist)) is not None:
            self._wind.velocity(t, corner)
        self._due = self._frame(step, *wake) if shown else None
        self._committed = t

    def evaluate(self, t: float, motion: Motion, wrench: Wrench) -> None:
        """Write the mean wrench over the step that ends in the trial state at time t [s].

        Raises:
            ScenarioError: at the start, it is not clear which edge trails.
            SimulationError: no strengths of the rings let nothing through; force or wind is not finite.
        """
        pose, twist = self._state(motion)
        lattice = self._solve(t, motion, pose, twist)
        wrench.force[:], wrench.torque[:] = lattice.wrench[:, :3], lattice.wrench[:, 3:]
        if wrench.response is not None:
            wrench.response[:] = lattice.response
        if wrench.diagnostics is not None:
            wrench.diagnostics[:] = (*self._incidence(t, motion), lattice.rows)

    def frame(self) -> WakeFrame | None:
        """Return wings and wakes at the last accepted state, if a picture of them is due."""
        due, self._due = self._due, None
        return due

    def save(self) -> bytes:
        """Return wakes, strengths, trailing edges, and the frame that is due; empty before any motion."""
        if self._lattice is None or math.isnan(self._committed):
            return b""
        due = b"" if self._due is None else self._due.encode()
        memory = _MEMORY.pack(self._committed, len(due)) + self._sides.astype("<f8").tobytes()
        return memory + due + self._lattice.save()

    def restore(self, blob: bytes) -> None:
        """Take back what ``save`` returned.

        Raises:
            ProtocolError: the blob is not one of these wings.
        """
        self._evaluated, self._committed = math.nan, math.nan
        self._lattice, self._due = None, None
        if not blob:
            return
        head = _MEMORY.size + 8 * len(self._rows)
        try:
            if len(blob) < head:
                raise ValueError(f"{head} bytes and more; got {len(blob)}")
            self._committed, size = _MEMORY.unpack_from(blob)
            sides = np.frombuffer(blob[_MEMORY.size : head], "<f8")
            if not set(sides.tolist()) <= {-1.0, 1.0}:
                raise ValueError(f"trailing edges at 1 or -1; got {sides.tolist()}")
            if not 0 <= size <= len(blob) - head:
                raise ValueError(f"a frame of up to {len(blob) - head} bytes; got {size}")
            due, lattice = blob[head : head + size], blob[head + size :]
            self._lay(sides.copy()).restore(lattice)
            self._due = logged(WakeFrame, due) if due and self._every else None
        except (ValueError, ProtocolError) as error:
            raise ProtocolError(f"model vortex: expected a checkpoint of {error}.") from error

    @property
    def lattice(self) -> VortexLattice:
        """The rings on the wings and in the wakes; there is none before the first motion."""
        if self._lattice is None:
            raise ProtocolError("model vortex: expected a first motion, at t = 0; got none.")
        return self._lattice

    # ---- one step ----

    def _frame(self, step: int, corner: Single, strength: Single) -> WakeFrame:
        """Return the wings as they are and these wakes, shape (rows, n, s + 1, 3), (rows, n, s)."""
        lattice, chordwise = self.lattice, self._provider.vortex.chordwise
        return WakeFrame(
            step=step,
            time_ns=step * self._scenario.coupling.step_ns,
            bound=chordwise,
            corner=np.hstack([lattice.surface.astype(np.float32), np.swapaxes(corner, 0, 1)]),
            strength=np.hstack([lattice.strength.astype(np.float32), np.swapaxes(strength, 0, 1)]),
        )

    def _state(self, motion: Motion) -> tuple[Array, Array]:
        rows = self._rows
        pose = np.hstack([motion.position[rows], motion.orientation[rows]])
        return pose, np.hstack([motion.linear[rows], motion.angular[rows]])

    def _made(self, t: float, motion: Motion) -> VortexLattice:
        if self._lattice is not None:
            return self._lattice
        arms = middles(self._wings, motion.rotation()[self._rows])
        wind = self._wind.velocity(t, motion.position[self._rows] + arms)
        return self._lay(trailing(self._scenario, self._provider, motion, arms, wind))

    def _lay(self, sides: Array) -> VortexLattice:
        table = surfaces(self._scenario, self._provider, sides)
        self._sides, self._lattice = sides, VortexLattice(table, self._provider.vortex.threads)
        _log.info(
            '"%s": %d wings of %d × %d vortex rings, wakes of up to %d rows',
            self._provider.name, *table.shape, table.rows,
        )  # fmt: skip
        return self._lattice

    def _solve(self, t: float, motion: Motion, pose: Array, twist: Array) -> VortexLattice:
        lattice = self._made(t, motion)
        solved = lattice.evaluate(t, pose, twist)
        self._evaluated = t
        if not solved or not all(map(math.isfinite, lattice.wrench.ravel().tolist())):
            if all(map(math.isfinite, pose.ravel().tolist())):
                self._wind.velocity(t, lattice.targets)
            names = ", ".join(f'"{name}"' for name in self._provider.bodies)
            got = lattice.wrench.tolist() if solved else "rings that lie in each other"
            raise SimulationError(
                f"{item(self._scenario, self._provider, 'vortex')}: expected a finite force on {names} at "
                f"t = {t:.6g} s; got {got}. Has the motion diverged, or do wings touch? Try a smaller "
                "coupling.step, or a larger core."
            )
        return lattice

    def _incidence(self, t: float, motion: Motion) -> tuple[float, float]:
        """Return the largest angle of attack [deg], and the most panels that a point goes in a step."""
        largest, farthest = 0.0, 0.0
        axes = np.swapaxes(motion.rotation()[self._rows], 1, 2)
        for body, chord, places, (x, y, z) in zip(self._rows, self._chords, self._places, axes, strict=True):
            arms = places[:, :1] * x + places[:, 1:] * z
            wind = self._wind.velocity(t, motion.position[body] + arms[1])
            speed, angle = 0.0, 0.0
            for arm in arms:
                air = (wind - motion.linear[body] - np.cross(motion.angular[body], arm)).tolist()
                along, across = (sum(a * b for a, b in zip(air, e.tolist(), strict=True)) for e in (x, y))
                if math.hypot(along, across) > speed:
                    speed, angle = math.hypot(along, across), math.atan2(abs(across), abs(along))
            largest = max(largest, math.degrees(angle))
            farthest = max(farthest, speed * self._h * self._provider.vortex.chordwise / chord)
        return largest, farthest
