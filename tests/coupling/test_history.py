"""What is kept of the answers."""

import numpy as np
import pytest

from linkwind.coupling import Answer
from linkwind.coupling.history import History
from linkwind.errors import SimulationError


def filled(count, depth=4):
    history = History(2, depth)
    for step in range(count):
        history.add(step, Answer(np.full((2, 6), float(step))))
    return history


def test_newest_first_and_no_more_than_the_depth():
    history = filled(7)
    assert history.wrenches[:, 1, 3].tolist() == [6, 5, 4, 3]
    assert history.count == 4
    assert filled(2).count == 2


def test_polynomials_are_the_same_contiguous_arrays_at_every_step():
    history = filled(5)
    before = [(nodes, wrenches) for nodes, wrenches in history.behind + history.through]
    history.add(5, Answer(np.zeros((2, 6))))
    for (nodes, wrenches), (nodes_now, wrenches_now) in zip(
        before, history.behind + history.through, strict=True
    ):
        assert nodes is nodes_now
        assert wrenches is wrenches_now
        assert wrenches.flags.c_contiguous
    assert history.behind[3][0].tolist() == [0, -1, -2]
    assert history.through[3][0].tolist() == [1, 0, -1]


def test_added_inertia_is_copied_followed_and_forgotten():
    history = History(1, 1)
    added = np.eye(6)[None] * 2.0
    history.add(0, Answer(np.zeros((1, 6)), added))
    first = history.added_inertia
    added *= 3.0
    assert first[0, 0, 0] == 2.0
    history.add(1, Answer(np.zeros((1, 6)), added))
    assert history.added_inertia[0, 0, 0] == 6.0
    assert first[0, 0, 0] == 2.0, "the one of the step before still belongs to its point"
    history.add(2, Answer(np.zeros((1, 6))))
    assert history.added_inertia is None


@pytest.mark.parametrize(
    ("entries", "message"),
    [
        ({(1, 0, 1): 1e-3}, "mirror image"),
        ({(1, 2, 2): np.nan}, "not finite"),
        ({(1, 2, 2): np.inf}, "not finite"),
        ({(1, 2, 2): -0.1}, "eigenvalue"),
        ({(1, 0, 5): 5.0, (1, 5, 0): 5.0}, "eigenvalue"),
    ],
)
def test_a_wrong_added_inertia_is_refused(entries, message):
    added = np.array([np.eye(6), np.eye(6)])
    for entry, value in entries.items():
        added[entry] = value
    with pytest.raises(SimulationError, match=rf"step 4: added inertia of body 1.*{message}"):
        History(2, 1).add(4, Answer(np.zeros((2, 6)), added))


def test_an_added_inertia_with_massless_directions_is_accepted():
    normal = np.array([0.6, 0.8, 0, 0, 0, 0])
    History(1, 1).add(0, Answer(np.zeros((1, 6)), 0.3 * np.outer(normal, normal)[None]))
