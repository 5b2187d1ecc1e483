"""A foreign FMU as force model: its file comes from the command line, all else from the scenario."""

from __future__ import annotations

import logging
import struct
from pathlib import Path

import numpy as np

from linkwind.aero.base import Capabilities, body_indices, item
from linkwind.errors import InputError, ProtocolError, SimulationError
from linkwind.fmi.host import description, listing, mapping
from linkwind.fmi.host.derivatives import Derivatives
from linkwind.fmi.host.facts import Description
from linkwind.fmi.host.instances import Instances
from linkwind.fmi.host.links import Mapping, elements
from linkwind.fmi.host.planning import differentiates, interface, own_step_ns, stepping
from linkwind.fmi.host.transfer import Inputs, Outputs
from linkwind.scenario import Provider, Scenario
from linkwind.scenario.providers import FmuModel
from linkwind.spatial import Motion, Wrench
from linkwind.wind import Wind

_log = logging.getLogger("linkwind.fmu")
_MAGIC = b"LWFMUMDL"


def survey(file: Path, scenario: Scenario, provider: Provider) -> tuple[str, str, list[str]]:
    """Look at an FMU without running it.

    Returns:
        The table of what is mapped, the same as TOML to start from, and what is wrong, a line each.

    Raises:
        InputError: the file is no FMU that can be used.
    """
    fmu = description.read(file, provider.fmu.structural)
    found, problems = mapping.survey(fmu, provider.fmu, provider.bodies)
    return _table(fmu, found, scenario, provider), listing.toml(fmu, found), problems


def settle(file: Path, scenario: Scenario, provider: Provider) -> tuple[Provider, str]:
    """Write what the names of an FMU's variables tell, and its SHA-256, into the settings of a provider.

    Returns:
        The provider, to be part of the scenario that everybody gets; and the table of the mapping.

    Raises:
        InputError: the file is no FMU that can be used, is not the one of the scenario, or cannot be mapped.
    """
    fmu = _read(file, provider.fmu)
    found = mapping.resolve(fmu, provider.fmu, provider.bodies)
    known = {"sha256": fmu.sha256, "variables": listing.entries(found, provider.fmu)}
    settled = provider.model_copy(update={"fmu": provider.fmu.model_copy(update=known)})
    return settled, _table(fmu, found, scenario, provider)


def _read(file: Path, settings: FmuModel) -> Description:
    fmu = description.read(file, settings.structural)
    if settings.sha256 not in (None, fmu.sha256):
        raise InputError(
            f"{file}: expected the FMU with SHA-256 {settings.sha256}; got {fmu.sha256}. "
            "Take the same file on both sides, or remove sha256 from the scenario."
        )
    return fmu


def _table(fmu: Description, found: Mapping, scenario: Scenario, provider: Provider) -> str:
    how = stepping(fmu, provider.fmu, scenario.coupling.step_ns)
    remarks = "".join(f"\nnote: {remark}" for remark in fmu.remarks)
    return f"{listing.text(fmu, found)}\n{how}{remarks}"


class ForceFmu:
    """Forces from an FMU.

    The FMU is stepped by ``evaluate``, with the trial motion, and so its memory follows the trials. An
    evaluation without a commit before it is the same one again: it starts from the memory at the last commit
    where the FMU has state; else the FMU only gets the new inputs.
    """

    def __init__(self, scenario: Scenario, provider: Provider, file: Path | None) -> None:
        """Read, map, start.

        Args:
            scenario: all of it.
            provider: the one to make the model of.
            file: the FMU.

        Raises:
            InputError: the file is missing or another one, cannot be used, or its variables cannot be mapped.
            SimulationError: the FMU cannot be instantiated.
        """
        if file is None:
            raise InputError(
                f"{item(scenario, provider, 'model')}: expected the file of the FMU on the command line; got "
                "none. Add --force-fmu FILE."
            )
        settings, step_ns = provider.fmu, scenario.coupling.step_ns
        self._fmu = _read(file, settings)
        found = mapping.resolve(self._fmu, settings, provider.bodies)
        self._mapping = found
        bodies = body_indices(scenario, provider)
        wind = Wind(scenario).velocity
        self._inputs = Inputs(found, bodies, len(scenario.bodies), wind, scenario.environment.density)
        self._outputs = Outputs(found, bodies)
        timeout = settings.timeout or scenario.coupling.timeout / 2.0
        self._instances = Instances(self._fmu, found, settings, step_ns, timeout)
        self._derivatives: Derivatives | None = None
        if differentiates(self._fmu, found, settings):
            self._derivatives = Derivatives(file, found, bodies, self._instances)
        own = own_step_ns(self._fmu, settings, step_ns)
        self._me = interface(self._fmu, settings)[0] == "me"
        self._step_ns, self._begun = step_ns, False
        self._again = False  # whether the last call was an evaluation
        self.capabilities = Capabilities(
            rollback=self._instances.can_save,
            added_inertia=any(link.quantity == "added_inertia" for link in found.outputs),
            response_size=self._response_size(len(bodies)),
            own_step_ns=0 if own == step_ns else own,
        )
        _log.info("%s", _table(self._fmu, found, scenario, provider))

    def _response_size(self, n: int) -> int:
        if self._derivatives is None:
            return 0
        return 36 * n if self._mapping.per_body else 36 * n * n

    def commit(self, t: float, motion: Motion) -> None:
        """Remember the accepted motion, where an input or the integration needs it."""
        self._again = False
        if self._me:
            self._inputs.fill(t, motion, self._instances.accepted)
        if self._inputs.remembers:
            self._inputs.commit(t, motion)

    def evaluate(self, t: float, motion: Motion, wrench: Wrench) -> None:
        """Step the FMU to time t [s] and fill the wrench.

        The response is that of the outputs to the inputs alone, not through states of the FMU.

        Raises:
            SimulationError: the FMU failed, in whatever way, or returned a number that is not finite.
        """
        instances = self._instances
        self._inputs.fill(t, motion, instances.inputs)
        if not self._begun:
            instances.accepted[:] = instances.inputs
            self._begun = True
        instances.evaluate(round(t * 1e9), again=self._again)
        self._again = True
        if not np.isfinite(instances.outputs).all():
            raise self._not_finite(t)
        if self._derivatives is not None and wrench.response is not None:
            self._derivatives.fill(round(t * 1e9), motion, self._inputs.interval(t), wrench.response)
        self._outputs.wrench(instances.outputs, motion, wrench)

    def _not_finite(self, t: float) -> SimulationError:
        row, place = np.argwhere(~np.isfinite(self._instances.outputs))[0]
        names = [name for variable in self._mapping.output_variables for name in elements(variable)]
        value = self._instances.outputs[row, place]
        self.close()
        of = f" of {self._mapping.bodies[row]}" if self._mapping.per_body else ""
        return SimulationError(
            f"{self._fmu.path}: step {t * 1e9 / self._step_ns:g} (t = {t:g} s): output {names[place]}{of}: "
            f"expected a finite number; got {value}. Has the motion diverged, or does the FMU start badly?"
        )

    def save(self) -> bytes:
        """Return all memory as an opaque blob.

        Raises:
            SimulationError: the FMU has no state, or failed.
        """
        if not self._instances.can_save:
            raise SimulationError(f"{self._fmu.path}: expected an FMU with FMU state; got one without.")
        parts = [self._inputs.save(), *self._instances.save()]
        digest = bytes.fromhex(self._fmu.sha256)
        head = struct.pack(f"<8s32sI{len(parts)}I", _MAGIC, digest, len(parts), *map(len, parts))
        return b"".join([head, *parts])

    def restore(self, blob: bytes) -> None:
        """Take back the memory that ``save`` returned.

        Raises:
            ProtocolError: the blob is not one of this FMU.
            SimulationError: the FMU failed.
        """
        try:
            magic, digest, count = struct.unpack_from("<8s32sI", blob)
            sizes = struct.unpack_from(f"<{count}I", blob, 44) if count < 1000 else ()
        except struct.error:
            magic, digest, sizes = b"", b"", ()
        begin = 44 + 4 * len(sizes)
        if magic != _MAGIC or digest.hex() != self._fmu.sha256 or begin + sum(sizes) != len(blob):
            raise ProtocolError(
                f"{self._fmu.path}: expected a checkpoint of it; got {len(blob)} other bytes."
            )
        parts = []
        for size in sizes:
            parts.append(blob[begin : begin + size])
            begin += size
        self._inputs.restore(parts[0])
        self._instances.restore(parts[1:])
        self._again = False

    def close(self) -> None:
        """End the FMU's process and remove what was unpacked."""
        self._instances.close()
