"""A foreign or own FMU in Co-Simulation, driven step by step through FMPy."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np

from linkwind.errors import InputError
from linkwind.spatial import Array


def read_description(file: Path) -> Any:
    """Return FMPy's model description of an FMU.

    Raises:
        InputError: there is no FMU, or it cannot be read.
    """
    from fmpy import read_model_description

    if not file.is_file():
        got = "a folder" if file.is_dir() else "no such file"
        raise InputError(f"{file}: expected an FMU; got {got}. Check the path.")
    try:
        return read_model_description(str(file), validate=False)
    except Exception as error:  # FMPy has no exception of its own
        raise InputError(f"{file}: expected an FMU; it cannot be read: {error}. Export it again.") from error


class Slave:
    """An instance for Co-Simulation of FMI 2 or 3; to be used in a ``with`` statement.

    Values are arrays of float64 by name of the variable, flat; all are Float64 (Real), but for Booleans that
    are set, 0 or 1.
    """

    def __init__(self, file: Path, start: float = 0.0) -> None:
        """Unpack, load, instantiate and initialise.

        Raises:
            InputError: the FMU cannot do Co-Simulation here, or refuses to start.
        """
        from fmpy import extract
        from fmpy.fmi2 import FMU2Slave
        from fmpy.fmi3 import FMU3Slave

        description = read_description(file)
        if description.coSimulation is None:
            raise InputError(f"{file}: expected an FMU for Co-Simulation; it has none. Use another tool.")
        self._file = file
        self._version = description.fmiVersion[0]
        self._variables = {variable.name: variable for variable in description.modelVariables}
        self._folder = tempfile.mkdtemp(prefix="linkwind-")
        self._time = start
        try:
            extract(str(file), self._folder)
            make = FMU2Slave if self._version == "2" else FMU3Slave
            self._fmu = make(
                guid=description.guid if self._version == "2" else description.instantiationToken,
                unzipDirectory=self._folder,
                modelIdentifier=description.coSimulation.modelIdentifier,
                instanceName=description.modelName,
            )
            self._initialize(start)
        except Exception as error:
            shutil.rmtree(self._folder, ignore_errors=True)
            raise InputError(f"{file}: expected an FMU that starts on this machine; got: {error}.") from error

    def _initialize(self, start: float) -> None:
        self._fmu.instantiate()
        if self._version == "2":
            self._fmu.setupExperiment(startTime=start)
            self._fmu.enterInitializationMode()
        else:
            self._fmu.enterInitializationMode(startTime=start)
        self._fmu.exitInitializationMode()

    def __enter__(self) -> Slave:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            if kind is None:
                self._fmu.terminate()
            self._fmu.freeInstance()
        finally:
            shutil.rmtree(self._folder, ignore_errors=True)

    def set(self, values: Mapping[str, Array]) -> None:
        """Set variables."""
        booleans = {name: value for name, value in values.items() if self._is_boolean(name)}
        if booleans:
            switches = [bool(np.all(value)) for value in booleans.values()]
            self._fmu.setBoolean([self._variables[name].valueReference for name in booleans], switches)
        values = {name: value for name, value in values.items() if name not in booleans}
        references = [self._variables[name].valueReference for name in values]
        if not references:
            return
        numbers = np.concatenate([np.ravel(value) for value in values.values()]).tolist()
        if self._version == "2":
            self._fmu.setReal(references, numbers)
        else:
            self._fmu.setFloat64(references, numbers)

    def _is_boolean(self, name: str) -> bool:
        return bool(self._variables[name].type == "Boolean")

    def get(self, names: Sequence[str]) -> dict[str, Array]:
        """Return variables."""
        references = [self._variables[name].valueReference for name in names]
        sizes = [int(np.prod(self._variables[name].shape or (1,))) for name in names]
        if self._version == "2":
            numbers = self._fmu.getReal(references)
        else:
            numbers = self._fmu.getFloat64(references, nValues=sum(sizes))
        pieces = np.split(np.array(numbers, dtype=np.float64), np.cumsum(sizes)[:-1])
        return dict(zip(names, pieces, strict=True))

    def step(self, step: int, size: float) -> None:
        """Do communication step ``step`` (0 is the first), ``size`` [s] long."""
        self._fmu.doStep(currentCommunicationPoint=self._time + step * size, communicationStepSize=size)
