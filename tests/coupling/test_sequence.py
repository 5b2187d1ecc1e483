"""Who is asked what, and when: the order of exchange of every scheme."""

import numpy as np
import pytest

from linkwind.coupling import SCHEMES, Answer, Settings

WEIGHT = np.ones((1, 6))


class Counting:
    """A plant whose state tells which steps led to it, as text."""

    def advance(self, state, nodes, wrenches, added_inertia):
        terms = "+".join(f"W{w[0, 0]:.0f}@{at:g}" for at, w in zip(nodes, wrenches, strict=True))
        held = "" if added_inertia is None else f"|A{added_inertia[0, 0, 0]:.0f}"
        return f"{state}({terms}{held})"


class Script:
    """An exchange that answers W = step (and A = 10 + step), in an array that it reuses, and keeps notes."""

    def __init__(self, *, added=False):
        self.asked = []
        self.answer = Answer(np.zeros((1, 6)), np.zeros((1, 6, 6)) if added else None)

    def __call__(self, step, iteration, accepted, trial):
        self.asked.append((step, iteration, accepted, trial))
        self.answer.wrench[:] = step
        if self.answer.added_inertia is not None:
            self.answer.added_inertia[:] = np.eye(6) * (10 + step)
        return self.answer


def points(scheme, script, steps, **settings):
    return list(SCHEMES[scheme](Counting(), script, "s", steps, Settings(WEIGHT, **settings)))


@pytest.mark.parametrize("scheme", ["explicit", "pec"])
@pytest.mark.parametrize("order", range(4))
@pytest.mark.parametrize("steps", [0, 1, 2, 3, 4, 5, 6, 9])
def test_every_point_is_asked_once_and_yielded_once_in_order(scheme, order, steps):
    script = Script()
    done = points(scheme, script, steps, order=order)
    assert [(step, iteration) for step, iteration, _, _ in script.asked] == [(k, 0) for k in range(steps + 1)]
    assert [point.step for point in done] == list(range(steps + 1))
    assert script.asked[0][2:] == ("s", "s")
    assert done[0].state == "s"
    assert [point.trial for point in done] == [trial for _, _, _, trial in script.asked]


def test_explicit_holds_the_wrench_and_accepts_the_trial():
    script = Script(added=True)
    done = points("explicit", script, 2)
    assert script.asked[1] == (1, 0, "s", "s(W0@0|A10)")
    assert script.asked[2] == (2, 0, "s(W0@0|A10)", "s(W0@0|A10)(W1@0|A11)")
    assert [point.state for point in done] == [trial for _, _, _, trial in script.asked]
    assert [point.wrench[0, 0] for point in done] == [0, 1, 2]
    assert [point.added_inertia[0, 0, 0] for point in done] == [10, 11, 12]


def test_pec_of_order_0_predicts_by_holding_and_corrects_linearly():
    script = Script(added=True)
    done = points("pec", script, 2, order=0)
    first = "s(W1@1+W0@0|A11)"
    assert script.asked[1] == (1, 0, "s", "s(W0@0|A10)")
    assert script.asked[2] == (2, 0, first, first + "(W1@0|A11)")
    assert [point.state for point in done] == ["s", first, first + "(W2@1+W1@0|A12)"]


def test_pec_of_order_1_predicts_linearly_from_the_second_step():
    script = Script()
    done = points("pec", script, 2, order=1)
    assert script.asked[1][3] == "s(W0@0)"
    assert script.asked[2][3] == done[1].state + "(W1@0+W0@-1)"
    assert [point.order for point in done] == [0, 0, 1]


def test_pec_starts_by_integrating_again_through_all_wrenches():
    script = Script(added=True)
    done = points("pec", script, 3, order=2)
    first = "s(W1@1+W0@0|A11)"
    again = "s(W2@2+W1@1+W0@0|A11)"
    both = again + "(W2@1+W1@0+W0@-1|A12)"
    assert script.asked[2][2] == first, "what is known of t_1 when t_2 is asked for"
    assert script.asked[3][2] == both
    assert [point.state for point in done[:3]] == ["s", again, both], "final after the second answer"
    assert done[3].trial == both + "(W2@0+W1@-1+W0@-2|A12)"
    assert done[3].state == both + "(W3@1+W2@0+W1@-1|A13)"


def test_points_are_yielded_as_soon_as_they_are_final():
    script = Script()
    run = SCHEMES["pec"](Counting(), script, "s", 9, Settings(WEIGHT, order=2))
    asked = []
    for _ in run:
        asked.append(len(script.asked))
    assert asked == [3, 3, 3, 4, 5, 6, 7, 8, 9, 10]


def test_mean_wrenches_are_held_over_the_step_that_they_belong_to():
    script = Script()
    done = points("pec", script, 2, order=3, held=True)
    assert done[1].trial == "s(W0@0)"
    assert done[2].trial == "s(W1@1)(W1@0)"
    assert done[2].state == "s(W1@1)(W2@1)"


def test_a_failing_exchange_ends_the_run():
    def failing(step, iteration, accepted, trial):
        raise RuntimeError(f"at {step}")

    with pytest.raises(RuntimeError, match="at 0"):
        list(SCHEMES["pec"](Counting(), failing, "s", 3, Settings(WEIGHT)))


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"weight": np.ones(6)}, "shape"),
        ({"weight": np.full((1, 6), np.inf)}, "finite"),
        ({"weight": WEIGHT, "order": 4}, "0, 1, 2 or 3"),
    ],
)
def test_wrong_settings_are_refused(settings, message):
    with pytest.raises(ValueError, match=message):
        Settings(**settings)
