"""Checkers of FMUs: FMPy, and further tools where they are installed.

Each takes a file and returns the problems that it finds, or one line that says why it did not look.
"""

from __future__ import annotations

import importlib.util
import logging
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

from linkwind.fmi.slave import read_description

MISSING = "not installed: pip install {}"
_TIMEOUT = 60.0  # s, of a foreign tool
# Ten steps of a millisecond, each in a process of its own: these tools are native code.
_ECOS = """
import sys
from ecospy import EcosSimulation, EcosSimulationStructure
structure = EcosSimulationStructure()
structure.add_model("model", sys.argv[1])
simulation = EcosSimulation(structure=structure, step_size=1e-3)
simulation.init()
simulation.step(10)
simulation.terminate()
"""
_LIBCOSIM = """
import sys
from libcosimpy.CosimEnums import CosimErrorCode
from libcosimpy.CosimExecution import CosimExecution
from libcosimpy.CosimSlave import CosimLocalSlave
execution = CosimExecution.from_step_size(1_000_000)
execution.add_local_slave(CosimLocalSlave(sys.argv[1], "model"))
execution.step(10)
status = execution.status()
assert status.current_time == 10_000_000, status
"""


def fmpy(file: Path) -> list[str] | str:
    """Validate the model description: schema, names, start values, units, structure."""
    from fmpy.validation import validate_fmu

    return list(validate_fmu(str(file)))


def fmu_manipulation_toolbox(file: Path) -> list[str] | str:
    """Let fmutool check schema and semantics."""
    if importlib.util.find_spec("fmu_manipulation_toolbox") is None:
        return MISSING.format("fmu-manipulation-toolbox")
    from fmu_manipulation_toolbox.checker import get_checkers
    from fmu_manipulation_toolbox.operations import FMU

    problems = list[str]()

    class Collector(logging.Handler):
        def emit(self, record: logging.LogRecord) -> None:
            problems.append(record.getMessage())

    logger, collector = logging.getLogger("fmu_manipulation_toolbox"), Collector(logging.ERROR)
    logger.addHandler(collector)
    try:
        fmu = FMU(str(file))
        for checker in get_checkers():
            fmu.apply_operation(checker())
    except Exception as error:  # whatever a foreign tool raises is a finding
        problems.append(repr(error))
    finally:
        logger.removeHandler(collector)
    return problems


def ecos(file: Path) -> list[str] | str:
    """Simulate with Ecos."""
    return _simulate("ecospy", _ECOS, file)


def libcosim(file: Path) -> list[str] | str:
    """Simulate with libcosim, which reads FMI 2."""
    if read_description(file).fmiVersion != "2.0":
        return "reads FMI 2 only"
    return _simulate("libcosimpy", _LIBCOSIM, file)


def _simulate(module: str, script: str, file: Path) -> list[str] | str:
    if importlib.util.find_spec(module) is None:
        return MISSING.format(module)
    command = [sys.executable, "-c", script, str(file.resolve())]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=_TIMEOUT, check=False)
    except subprocess.TimeoutExpired:
        return [f"expected ten steps within {_TIMEOUT:g} s; it still runs"]
    if done.returncode == 0:
        return []
    last = done.stderr.strip().splitlines()[-1:] or ["no message"]
    return [f"expected ten steps; it ended with {done.returncode}: {last[0]}"]


CHECKERS: dict[str, Callable[[Path], list[str] | str]] = {
    "fmpy": fmpy,
    "fmu-manipulation-toolbox": fmu_manipulation_toolbox,
    "ecos": ecos,
    "libcosim": libcosim,
}
