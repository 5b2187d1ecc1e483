"""What a fluid on a lattice has in the plane and in space: its state, rates and the halving of a step.

Lattice units: a cell is 1 wide, a step takes 1, the density is 1 at rest, so the speed of sound is 1/√3.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float32]

MAX_SPEED = 0.3  # cells/step: faster, and the error of the method, of third order in it, is no longer small


def shear_rate(viscosity: float) -> float:
    """Return the relaxation rate ω = 1/(3ν + ½) of a kinematic viscosity ν [cells²/step]."""
    return 1.0 / (3.0 * viscosity + 0.5)


class Fluid:
    """A window full of fluid; what makes one keeps its memory in ``_struct`` and ``_places``.

    Attributes:
        struct_address: of the struct of the native library.
    """

    struct_address: int
    _struct: Any  # with shear_rate, stream, populations
    _places: list[Floats]  # where the populations are by turns
    _halve_step: Any

    @property
    def populations(self) -> Floats:
        """Populations after the last collision, less the weights of their directions.

        Shape (directions, ny, nx) or (directions, nz, ny, nx), the order of the directions that of the header
        of the native library. A view of where they are now: a step puts them elsewhere and may write over it.
        """
        first, second = self._places
        return first if self._struct.populations == address(first) else second

    @property
    def shear_rate(self) -> float:
        """Relaxation rate ω of the shear stress; may be set at any time."""
        return float(self._struct.shear_rate)

    @shear_rate.setter
    def shear_rate(self, value: float) -> None:
        if not 0.0 < np.float32(value) < 2.0:
            raise ValueError(
                f"shear_rate: expected a rate between 0 and 2 in single precision; got {value!r}. "
                "It is 1/(3 viscosity + 1/2): use a positive viscosity, above 1e-7 cells² a step."
            )
        self._struct.shear_rate = value

    @property
    def stream(self) -> tuple[float, ...]:
        """Velocity of the undisturbed fluid [cells/step]; may be set at any time."""
        return tuple(self._struct.stream)

    @stream.setter
    def stream(self, value: tuple[float, ...]) -> None:
        if not math.hypot(*value) <= MAX_SPEED:
            raise ValueError(
                f"stream: expected at most {MAX_SPEED} cells/step; got {value}. Shorten the step."
            )
        self._struct.stream[:] = value

    def halve_step(self, shear_rate: float) -> None:
        """Halve the time of a step; the cells and the physical fields stay as they are.

        Velocities, ``stream`` included, become half, the density's difference from 1 a fourth, and the second
        moments such that the physical stress stays. Where a force acted in the last step, half of it is in
        the velocity and is treated like the rest.

        Args:
            shear_rate: the new ω, 4ω/(2 + ω) where the physical viscosity stays.

        Raises:
            ValueError: the new rate is out of its range, or the old one is 1, which leaves no stress to keep.
        """
        old = self.shear_rate
        self.shear_rate = shear_rate  # checks it
        new, self._struct.shear_rate = self.shear_rate, old
        if self._halve_step(self.struct_address, new):
            raise ValueError("halve_step: expected a shear_rate other than 1 before; got 1. Use 0.999.")

    @property
    def parts(self) -> list[bytes | memoryview]:
        """What a state consists of: ω and stream, populations where they lie; ``force`` is not part of it."""
        numbers = np.array([self.shear_rate, *self.stream], np.float32).tobytes()
        return [numbers, *(direction.data for direction in self.populations)]

    @property
    def state(self) -> bytes:
        """The whole state between two steps, :attr:`parts` in one.

        Setting it raises ValueError where the bytes are not of a lattice of this size.
        """
        return b"".join(self.parts)

    @state.setter
    def state(self, value: bytes | memoryview) -> None:
        count = 1 + len(self.stream)
        expected = 4 * count + self.populations.nbytes
        if len(value) != expected:
            raise ValueError(f"state: expected {expected} bytes; got {len(value)}")
        numbers = np.frombuffer(value, dtype=np.float32)
        rate, *stream = map(float, numbers[:count])
        self.shear_rate, self.stream = rate, tuple(stream)
        self.populations[:] = numbers[count:].reshape(self.populations.shape)


def aligned(count: int) -> Floats:
    """Return zeros at the start of a cache line."""
    memory = np.zeros(count + 16, dtype=np.float32)
    start = -address(memory) % 64 // 4
    return memory[start : start + count]


def address(array: NDArray[Any]) -> int:
    """Return where an array begins in memory."""
    return int(array.__array_interface__["data"][0])
