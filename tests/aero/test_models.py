"""What every registered force model keeps to."""

import math
import typing

import numpy as np
import pytest

from linkwind import aero
from linkwind.scenario import Environment, Gust, Provider
from linkwind.spatial import Motion, Wrench
from linkwind.wind import wind_table
from tests.aero.scenes import PLATE, model

FIELD = '\n[aero.field.plate]\nfx = "sin(t) - vx"\ntz = "theta"\n'


@pytest.fixture(params=aero.MODELS)
def force_model(request):
    text = PLATE.replace('model = "plate"', f'model = "{request.param}"')
    return model(text + (FIELD if request.param == "field" else ""))


def moving():
    motion = Motion.at_rest(1)
    motion.linear[0, :2], motion.angular[0, 2] = (1.0, -0.5), 0.7
    return motion


def test_the_scenario_allows_exactly_the_registered_models():
    assert set(typing.get_args(Provider.model_fields["model"].annotation)) == {*aero.MODELS, *aero.OWN}


def test_the_wrench_is_written_whole(force_model):
    can = force_model.capabilities
    out, empty = (Wrench.zeros(1, added_inertia=can.added_inertia) for _ in range(2))
    for array in (empty.force, empty.torque, *([empty.added_inertia] if can.added_inertia else [])):
        array[:] = np.nan
    for wrench in (out, empty):
        force_model.evaluate(0.3, moving(), wrench)
    assert (out.force == empty.force).all()
    assert (out.torque == empty.torque).all()
    if can.added_inertia:
        added = out.added_inertia[0]
        assert (added == empty.added_inertia[0]).all()
        assert (added == added.T).all()
        assert np.linalg.eigvalsh(added).min() >= 0.0


def test_save_and_restore_give_the_same_bits_again(force_model):
    def evaluate():
        wrench = Wrench.zeros(1, added_inertia=force_model.capabilities.added_inertia)
        force_model.evaluate(0.3, moving(), wrench)
        return wrench.force.tobytes() + wrench.torque.tobytes()

    force_model.commit(0.0, moving())
    blob, before = force_model.save(), evaluate()
    turned = moving()
    turned.orientation[0] = 0.0, 0.0, 0.0, 1.0
    force_model.commit(0.1, turned)
    force_model.restore(blob)
    assert evaluate() == before
    assert force_model.save() == blob


def test_capabilities_are_those_of_an_instantaneous_model_but_for_a_fluid_that_remembers(force_model):
    can = force_model.capabilities
    if isinstance(force_model, (aero.MODELS["flow"], aero.MODELS["vortex"])):
        assert (can.kind, can.rollback, can.response_size, can.own_step_ns) == ("mean", True, 36, 0)
        return
    assert (can.kind, can.rollback, can.response_size, can.own_step_ns) == ("point", True, 0, 0)
    assert can.added_inertia == isinstance(force_model, aero.MODELS["plate"])


def test_the_wind_table_holds_si_units():
    gust = Gust(amplitude=(1.0, 2.0), frequency=3.0, wavenumber=(4.0, 5.0, 6.0), phase_deg=90.0)
    single = Gust(shape="one_minus_cosine", amplitude=(0.0, 9.0), frequency=1.0)
    table = wind_table(Environment(wind=(7.0, 8.0), gusts=(gust, single)), "x")
    assert table.uniform.tolist() == [7.0, 8.0, 0.0]
    assert table.gusts.tolist() == [
        [1.0, 2.0, 0.0, 3.0, 4.0, 5.0, 6.0, math.pi / 2, 0.0],
        [0.0, 9.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0],
    ]
    assert wind_table(Environment(), "x").gusts.shape == (0, 9)
