"""The names that a scenario may use are the names of what exists."""

import pkgutil
from typing import get_args

from linkwind import bus
from linkwind.aero import MODELS, OWN
from linkwind.coupling import SCHEMES
from linkwind.mechanism.loops import KEPT
from linkwind.native.forces import COMPONENTS, Coefficients
from linkwind.native.multibody import JOINT_TYPES, Integrator
from linkwind.scenario.bodies import JointType
from linkwind.scenario.providers import AeroModel, FieldExpressions, PlateCoefficients
from linkwind.scenario.settings import IntegratorName, Scheme, Transport


def test_joint_types():
    assert get_args(JointType) == (*JOINT_TYPES, "distance")
    assert {*KEPT, "free"} == {*get_args(JointType)}


def test_integrators():
    assert get_args(IntegratorName) == tuple(integrator.name.lower() for integrator in Integrator)


def test_aero_models():
    assert get_args(AeroModel) == (*MODELS, *OWN)


def test_plate_coefficients():
    assert get_args(PlateCoefficients) == tuple(each.name.lower() for each in Coefficients)


def test_schemes():
    assert get_args(Scheme) == tuple(SCHEMES)


def test_transports():
    assert {*get_args(Transport), "base"} == {module.name for module in pkgutil.iter_modules(bus.__path__)}


def test_field_components():
    assert tuple(FieldExpressions.model_fields) == ("let", *COMPONENTS)
