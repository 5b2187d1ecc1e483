"""Directional derivatives of an FMU: asked for, checked once, and handed on as the matrix G.

The check, at the first step where G is not zero: all inputs that depend on a twist are changed by a hundredth
to both sides, and the step is done again. What the outputs change by has to agree with the derivatives to a
hundredth. Where it does not, a warning says so, and G stays zero from then on. An FMU without state cannot
be checked.
"""

from __future__ import annotations

import logging
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from linkwind.fmi.host.instances import Instances
from linkwind.fmi.host.links import Mapping
from linkwind.fmi.host.response import Response
from linkwind.spatial import Array, Motion

_CHANGE = 1e-2  # of the inputs, for the check
_TOLERANCE = 1e-2
_log = logging.getLogger("linkwind.fmu")


class Derivatives:
    """The matrix G of a provider, step by step."""

    def __init__(self, file: Path, mapping: Mapping, bodies: Sequence[int], instances: Instances) -> None:
        """Prepare; for the arguments see ``Response``."""
        self._file, self._instances = file, instances
        self._response = Response(mapping, bodies)
        self._inputs = [link.index for link in mapping.twist_inputs]
        self._used = np.array(sorted({link.index for link in mapping.outputs}), dtype=np.intp)
        self._unchecked = instances.can_save
        self._off = False

    def fill(self, time_ns: int, motion: Motion, interval: float, out: Array) -> None:
        """Fill G after an evaluation; see ``Response.matrix``.

        Raises:
            SimulationError: the FMU failed in the check.
        """
        instances = self._instances
        if self._off or not self._finite():
            out.fill(0.0)
            return
        self._response.matrix(motion, instances.outputs, instances.derivatives, interval, out)
        if self._unchecked and out.any():
            self._check(time_ns)
            if self._off:
                out.fill(0.0)

    def _finite(self) -> bool:
        if not np.isfinite(self._instances.derivatives).all():
            self._give_up("cannot be had (see its log)")
        return not self._off

    def _check(self, time_ns: int) -> None:
        """Compare the derivatives with what a step does."""
        instances = self._instances
        inputs, derivatives = instances.inputs.copy(), instances.derivatives.copy()
        change = np.zeros_like(inputs)
        change[:, self._inputs] = _CHANGE * inputs[:, self._inputs]
        expected = np.einsum("ik,iko->io", change[:, self._inputs], derivatives)[:, self._used]
        if not expected.any():
            return
        seen = []
        for sign in (1.0, -1.0, 0.0):  # the last one restores what was there
            instances.inputs[:] = inputs + sign * change
            instances.evaluate(time_ns, again=True)
            seen.append(instances.outputs[:, self._used].copy())
        got = (seen[0] - seen[1]) / 2.0
        self._unchecked = False
        error, size = float(np.linalg.norm(expected - got)), float(np.linalg.norm(got))
        if not error <= _TOLERANCE * size:
            apart = f"{100.0 * error / size:.3g} %" if size else "all of it"
            self._give_up(f"differ from what a step does by {apart}")

    def _give_up(self, why: str) -> None:
        self._off = True
        _log.warning(
            "%s: its directional derivatives %s: going on without; fmu.derivatives = false leaves them out",
            self._file,
            why,
        )
