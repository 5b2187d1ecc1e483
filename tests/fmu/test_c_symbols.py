"""Exported is the standard's interface, all of it and nothing else; instances do not know each other."""

from __future__ import annotations

import shutil
import subprocess
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from tests.fmu.c_model import Instance, dynamics

VERSION_2 = """
GetTypesPlatform GetVersion SetDebugLogging Instantiate FreeInstance SetupExperiment
EnterInitializationMode ExitInitializationMode Terminate Reset GetReal GetInteger GetBoolean GetString
SetReal SetInteger SetBoolean SetString GetFMUstate SetFMUstate FreeFMUstate SerializedFMUstateSize
SerializeFMUstate DeSerializeFMUstate GetDirectionalDerivative EnterEventMode NewDiscreteStates
EnterContinuousTimeMode CompletedIntegratorStep SetTime SetContinuousStates GetDerivatives
GetEventIndicators GetContinuousStates GetNominalsOfContinuousStates SetRealInputDerivatives
GetRealOutputDerivatives DoStep CancelStep GetStatus GetRealStatus GetIntegerStatus GetBooleanStatus
GetStringStatus
"""
TYPES = "Float32 Float64 Int8 UInt8 Int16 UInt16 Int32 UInt32 Int64 UInt64 Boolean String Binary Clock"
VERSION_3 = f"""
GetVersion SetDebugLogging InstantiateModelExchange InstantiateCoSimulation InstantiateScheduledExecution
FreeInstance EnterInitializationMode ExitInitializationMode EnterEventMode Terminate Reset
GetNumberOfVariableDependencies {" ".join(f"Get{name} Set{name}" for name in TYPES.split())}
GetVariableDependencies GetFMUState SetFMUState FreeFMUState SerializedFMUStateSize SerializeFMUState
DeserializeFMUState GetDirectionalDerivative GetAdjointDerivative EnterConfigurationMode
ExitConfigurationMode GetIntervalDecimal GetIntervalFraction GetShiftDecimal GetShiftFraction
SetIntervalDecimal SetIntervalFraction SetShiftDecimal SetShiftFraction EvaluateDiscreteStates
UpdateDiscreteStates EnterContinuousTimeMode CompletedIntegratorStep SetTime SetContinuousStates
GetContinuousStateDerivatives GetEventIndicators GetContinuousStates GetNominalsOfContinuousStates
GetNumberOfEventIndicators GetNumberOfContinuousStates EnterStepMode GetOutputDerivatives DoStep
ActivateModelPartition
"""


@pytest.mark.skipif(not shutil.which("nm"), reason="nm of binutils is not installed")
@pytest.mark.parametrize(("version", "names"), [(2, VERSION_2), (3, VERSION_3)])
def test_exports(compiler, two_link, version, names):
    model = dynamics(two_link.tables, two_link.q0, two_link.v0, scalar=version == 2)
    library = compiler.library(model, version, f"symbols_{version}")
    listed = subprocess.run(
        ["nm", "-D", "--defined-only", library], capture_output=True, text=True, check=True
    ).stdout
    exported = {line.split()[-1] for line in listed.splitlines()}
    assert exported == {f"fmi{version}{name}" for name in names.split()}
    undefined = subprocess.run(
        ["nm", "-D", "--undefined-only", library], capture_output=True, text=True, check=True
    )
    needed = {line.split()[-1].split("@")[0] for line in undefined.stdout.splitlines()}
    assert not {name for name in needed if name.startswith("lw_")}
    listed = subprocess.run(["size", "-A", library], capture_output=True, text=True, check=True).stdout
    sizes = {line.split()[0]: int(line.split()[1]) for line in listed.splitlines() if line.startswith(".")}
    assert sizes[".data"] <= 8  # what the C runtime adds; nothing that instances could share
    assert sizes[".bss"] <= 8


def run(library, model, seed: int) -> bytes:
    fmu = Instance(library, model).initialize()
    force = np.random.default_rng(seed).normal(size=(300, 15))
    for k, values in enumerate(force):
        fmu.set("FORCE", values)
        fmu.step(k * 0.01, 0.01)
    state = fmu.get("Q", "V", "REACTION_FORCE").tobytes()
    fmu.free()
    return state


def test_threads(spatial_library, spatial_model):
    alone = [run(spatial_library, spatial_model, seed) for seed in range(8)]
    with ThreadPoolExecutor(8) as pool:
        together = list(pool.map(lambda seed: run(spatial_library, spatial_model, seed), range(8)))
    assert together == alone
    assert len(set(alone)) == 8


def test_two_instances_step_by_step(planar_library, planar_model):
    fmus = [Instance(planar_library, planar_model).initialize() for _ in range(2)]
    for k in range(50):
        for sign, fmu in zip((1.0, -1.0), fmus, strict=True):
            fmu.set("TORQUE", np.full(6, sign))
            fmu.step(k * 0.01, 0.01)
    alone = Instance(planar_library, planar_model).initialize()
    for k in range(50):
        alone.set("TORQUE", -np.ones(6))
        alone.step(k * 0.01, 0.01)
    assert fmus[1].get("Q").tobytes() == alone.get("Q").tobytes() != fmus[0].get("Q").tobytes()
