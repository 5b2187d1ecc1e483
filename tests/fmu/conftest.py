"""Binaries that several test files share."""

from __future__ import annotations

import numpy as np
import pytest

from linkwind.mechanism import build
from linkwind.scenario import load
from tests.fmu import c_model
from tests.native.mechanisms import Body, tables


def tilted(*axis_angle: float) -> np.ndarray:
    from scipy.spatial.transform import Rotation

    return Rotation.from_rotvec(axis_angle).as_matrix()


def spatial_mechanism():
    """Return tables and start of a tree with every joint type but fixed."""
    bodies = [
        Body(-1, "free", 2.0, np.diag([0.3, 0.5, 0.6]), child_point=(0.1, 0.0, 0.0)),
        Body(
            0,
            "spherical",
            1.0,
            np.diag([0.1, 0.12, 0.2]),
            (0.3, 0.1, 0.0),
            (-0.2, 0.0, 0.05),
            stiffness=3.0,
            damping=0.1,
        ),
        Body(
            1,
            "revolute",
            0.7,
            np.diag([0.05, 0.04, 0.06]),
            (0.2, 0.0, 0.0),
            (-0.2, 0.0, 0.0),
            parent_rotation=tilted(0.3, 0.4, 0.0),
            child_rotation=tilted(0.3, 0.4, 0.0),
            stiffness=2.0,
        ),
        Body(
            0,
            "prismatic",
            0.5,
            np.diag([0.02, 0.03, 0.02]),
            (0.0, 0.2, 0.0),
            parent_rotation=tilted(0.8, 0.0, 0.0),
            stiffness=5.0,
            damping=0.2,
        ),
        Body(-1, "planar", 1.2, np.diag([0.1, 0.1, 0.1]), child_point=(0.05, 0.0, 0.0)),
    ]
    found = tables(bodies, gravity=(0.3, -9.81, 0.5))
    random = np.random.default_rng(3)
    q = np.concatenate(
        [random.normal(size=3), [0.8, 0.0, 0.6, 0.0], [0.96, 0.28, 0.0, 0.0], random.normal(size=1 + 1 + 3)]
    )
    return found, q, random.normal(size=len(found.stiffness))


@pytest.fixture(scope="session")
def compiler(tmp_path_factory):
    return c_model.Compiler(tmp_path_factory.mktemp("fmu_objects"))


@pytest.fixture(scope="session")
def two_link():
    return build(load("two_link"))


@pytest.fixture(scope="session")
def planar_model(two_link):
    return c_model.dynamics(two_link.tables, two_link.q0, two_link.v0)


@pytest.fixture(scope="session")
def planar_library(compiler, planar_model):
    return compiler.library(planar_model, 3, "planar")


@pytest.fixture(scope="session")
def spatial_model():
    return c_model.dynamics(*spatial_mechanism())


@pytest.fixture(scope="session")
def spatial_library(compiler, spatial_model):
    return compiler.library(spatial_model, 3, "spatial")
