"""Strips of wings: their areas and centres, against polygons cut by hand and a sum over many points."""

import numpy as np
import pytest

from linkwind.aero import planform
from linkwind.scenario.shapes import Plate, Wing

DELTA = Wing(type="wing", points=[[-0.4, 0], [0.2, 0.6], [0.2, -0.6]])
STEPPED = Wing(
    type="wing", points=[[0, 0], [0.3, 0.1], [0.3, 0.5], [0.2, 0.5], [0.2, 1.1], [-0.1, 1.1], [-0.2, 0.2]]
)


@pytest.mark.parametrize("wing", [DELTA, STEPPED])
@pytest.mark.parametrize("count", [1, 2, 3, 7])
def test_strips_have_the_area_and_the_centre_of_their_part(wing, count):
    """Midpoints of many narrow slices, each with the chord that the shape has there."""
    low, high = planform.ends(wing)
    found = planform.strips(wing, count)
    width = (high - low) / count
    slices = low + (np.arange(4000 * count) + 0.5) * width / 4000
    front, back = np.array([wing.chord(z) for z in slices]).T
    cut = [part.reshape(count, -1) for part in (back - front, 0.5 * (front + back), slices)]
    length, x, z = cut
    expected = [length.mean(1), (length * x).mean(1) / length.mean(1), (length * z).mean(1) / length.mean(1)]
    np.testing.assert_allclose(found, np.transpose(expected), rtol=0, atol=2e-5)


def test_a_delta_has_its_centre_at_two_thirds():
    assert planform.mean_chord(DELTA) == pytest.approx(0.3, rel=1e-15)
    np.testing.assert_allclose(planform.middle(DELTA), [0.0, 0.0], rtol=0, atol=1e-16)
    np.testing.assert_allclose(planform.ends_and_middle(DELTA), [[0.2, -0.6], [-0.1, 0.0], [0.2, 0.6]])


def test_a_rectangle_is_a_plate():
    plate = Plate(type="plate", length=0.4, span=1.2)
    wing = Wing(type="wing", points=[[-0.2, -0.6], [0.2, -0.6], [0.2, 0.6], [-0.2, 0.6]])
    assert planform.strips(wing, 1).tolist() == planform.strips(plate, 1).tolist() == [[0.4, 0.0, 0.0]]
    np.testing.assert_allclose(planform.strips(wing, 8), planform.strips(plate, 8), rtol=0, atol=1e-15)
    assert planform.ends_and_middle(wing).tolist() == planform.ends_and_middle(plate).tolist()


def test_wings_that_fold_are_found():
    assert DELTA.folds is STEPPED.folds is None
    swallow = Wing(type="wing", points=[[0, 0], [2, 0], [2, 1], [1, 0.4], [0, 1]])
    assert swallow.folds == pytest.approx(0.7)
