"""The stated structure against what really changes when a known is changed."""

from __future__ import annotations

import xml.etree.ElementTree as ET
import zipfile

import numpy as np
import pytest
from fmpy import extract
from fmpy.fmi3 import FMU3Slave

from linkwind.fmi.slave import read_description

STEP = 0.03


class Probe:
    """An FMI 3 instance in initialisation mode, where states and inputs can be set at will."""

    def __init__(self, file, folder) -> None:
        self.description = read_description(file)
        extract(str(file), str(folder))
        self.variables = {v.valueReference: v for v in self.description.modelVariables}
        self.fmu = FMU3Slave(
            guid=self.description.instantiationToken, unzipDirectory=str(folder),
            modelIdentifier=self.description.coSimulation.modelIdentifier, instanceName="probe",
        )  # fmt: skip
        self.fmu.instantiate()
        self.fmu.enterInitializationMode()

    def size(self, reference: int) -> int:
        return int(np.prod(self.variables[reference].shape or (1,)))

    def get(self, reference: int) -> np.ndarray:
        return np.array(self.fmu.getFloat64([reference], nValues=self.size(reference)))

    def set(self, reference: int, value: np.ndarray) -> None:
        self.fmu.setFloat64([reference], value.tolist())


@pytest.fixture
def probe(tmp_path):
    opened = []

    def make(file) -> Probe:
        opened.append(Probe(file, tmp_path / "model"))
        return opened[-1]

    yield make
    for each in opened:
        each.fmu.freeInstance()


def structure(file, tag: str) -> dict[int, dict[int, str]]:
    with zipfile.ZipFile(file) as archive:
        root = ET.fromstring(archive.read("modelDescription.xml")).find("ModelStructure")
    return {
        int(e.get("valueReference")): dict(
            zip(map(int, e.get("dependencies").split()), e.get("dependenciesKind").split(), strict=True)
        )
        for e in root.iter(tag)
    }


def direction(probe: Probe, reference: int) -> np.ndarray:
    """A change that keeps an added inertia symmetric and positive, and masses above zero."""
    size = probe.size(reference)
    if size == 36:
        factor = np.random.default_rng(reference).normal(size=(6, 6))
        return 0.1 * (factor @ factor.T).ravel()
    if probe.variables[reference].name.endswith(".inertia"):
        return np.array([1.0, 1.0, 1.0, 0.0, 0.0, 0.0])
    return np.random.default_rng(reference).uniform(0.5, 1.0, size=size)


def changes(probe: Probe, known: int, unknowns: list[int]) -> dict[int, tuple[np.ndarray, np.ndarray]]:
    """Return by how much each unknown changes for one and for two steps of a known."""
    start, step = probe.get(known), STEP * direction(probe, known)
    base = {unknown: probe.get(unknown) for unknown in unknowns}
    found = []
    for factor in (1.0, 2.0):
        probe.set(known, start + factor * step)
        found.append({unknown: probe.get(unknown) - base[unknown] for unknown in unknowns})
    probe.set(known, start)
    return {unknown: (found[0][unknown], found[1][unknown]) for unknown in unknowns}


@pytest.mark.parametrize(
    ("name", "part", "tag"),
    [("spatial", "dynamics", "Output"), ("spatial", "dynamics", "ContinuousStateDerivative"),
     ("spatial", "dynamics", "InitialUnknown"), ("servo", "dynamics", "Output"),
     ("servo", "dynamics", "ContinuousStateDerivative"), ("two_link_free", "dynamics", "InitialUnknown"),
     ("two_link", "aero", "InitialUnknown"), ("two_link_gust", "aero", "Output"),
     ("sheared", "aero", "Output")],
)  # fmt: skip
def test_nothing_depends_on_more_than_is_stated(fmu, probe, name, part, tag):
    file = fmu(name, "3", part)
    model = probe(file)
    stated = structure(file, tag)
    unknowns = list(stated)
    tunable = tag == "InitialUnknown"
    knowns = [
        reference
        for reference, v in model.variables.items()
        if v.type == "Float64"
        and (v.causality == "input" or v.initial == "exact")
        and (tunable or v.causality != "parameter")
        and not v.name.startswith("solver.")
    ]
    _shake(model, knowns)
    used = 0
    for known in knowns:
        for unknown, (one, two) in changes(model, known, unknowns).items():
            kind = stated[unknown].get(known)
            size = np.abs(two).max()
            if known == unknown:
                assert kind == "constant"
            elif kind is None:
                assert size == 0.0, (model.variables[unknown].name, model.variables[known].name)
            elif kind == "constant":
                np.testing.assert_allclose(two, 2.0 * one, rtol=0.0, atol=1e-12)
            used += kind is not None and size > 0.0
    assert used > 0.6 * sum(len(each) for each in stated.values())  # and most of what is stated is true


def _shake(model: Probe, knowns: list[int]) -> None:
    """Leave the special point at which all starts are zero."""
    for known in knowns:
        if model.variables[known].causality == "input" or not np.any(model.get(known)):
            model.set(known, model.get(known) + 0.5 * direction(model, known))


def test_separate_trees_do_not_depend_on_each_other(fmu):
    file = fmu("two_link_free", "3")
    names = {v.valueReference: v.name for v in read_description(file).modelVariables}
    for unknown, knowns in structure(file, "Output").items():
        if names[unknown].startswith("link1."):
            assert {names[known].split(".")[0] for known in knowns} <= {"link1", "world_link1"}
