"""What a force model in Python may be, what it sees, and what is said of one that is wrong."""

from __future__ import annotations

import functools
import re
from pathlib import Path

import numpy as np
import pytest

import linkwind
from linkwind import aero
from linkwind.aero.source import python_source
from linkwind.errors import InputError, ProtocolError, SimulationError
from linkwind.scenario import load, loads
from linkwind.spatial import Motion, Wrench
from tests.own import models

SCENARIO = load("two_link", ["aero.model=python"])


def built(model, scenario=SCENARIO):
    return aero.build(scenario, scenario.providers[0], aero.own(model))


def moving(n=2):
    motion = Motion.at_rest(n)
    motion.linear[:] = np.arange(1.0, 3 * n + 1).reshape(n, 3)
    return motion


def evaluated(model, motion=None, t=0.003, n=2):
    wrench = Wrench.zeros(n, added_inertia=model.capabilities.added_inertia)
    model.evaluate(t, moving(n) if motion is None else motion, wrench)
    return wrench


def write(folder: Path, text: str, name: str = "mine.py") -> str:
    (folder / name).write_text(text)
    return str(folder / name)


class Model(linkwind.ForceModel):
    def evaluate(self, t, motion, wrench):
        wrench.force[:, 1] = t


def test_a_function_writes_into_a_wrench_that_is_zero():
    def pull(t, motion, wrench):
        assert not wrench.force.any()
        wrench.force[0, 0] += t + motion.linear[0, 0]

    model, wrench = built(pull), Wrench.zeros(2)
    for _ in range(2):
        model.evaluate(0.25, moving(), wrench)
    assert wrench.force.tolist() == [[1.25, 0.0, 0.0], [0.0, 0.0, 0.0]]
    assert model.capabilities == linkwind.Capabilities()
    assert model.save() == b""


def test_a_function_sees_the_bodies_of_its_provider_and_a_class_sees_all():
    text = '[[providers]]\nname = "tail"\nmodel = "python"\nbodies = ["link2", "link1"]\n'
    text += '[[providers]]\nname = "rest"\nmodel = "none"\n'
    base = "\n".join(
        f'[[bodies]]\nname = "{name}"\nmass = 1.0\ninertia = 1.0' for name in ("a", "link1", "link2")
    )
    scenario = loads(f"[time]\nend = 1.0\n{base}\n{text}", "three.toml")
    seen = []
    model = built(lambda t, motion, wrench: seen.append(motion.linear[:, 0].tolist()), scenario)
    evaluated(model, moving(3))

    class All(linkwind.ForceModel):
        def evaluate(self, t, motion, wrench):
            seen.append(len(motion))
            assert len(wrench) == 2

    evaluated(built(All, scenario), moving(3))
    assert seen == [[7.0, 4.0], 3]


def test_what_makes_a_model_is_a_class_or_calls_one():
    class Strong(Model):
        def __init__(self, scenario, provider, factor=1.0):
            self.factor = factor * len(provider.bodies) + scenario.environment.density

        def evaluate(self, t, motion, wrench):
            wrench.force[:, 1] = self.factor

    assert evaluated(built(Strong)).force[1, 1] == 2.0 + 1.225
    assert evaluated(built(functools.partial(Strong, factor=3.0))).force[1, 1] == 6.0 + 1.225
    assert evaluated(built(lambda scenario, provider: Model(scenario, provider))).force[1, 1] == 0.003


def test_the_motion_cannot_be_written_to():
    def nudge(t, motion, wrench):
        motion.linear[0] += 1.0

    motion = moving()
    with pytest.raises(SimulationError, match=r"test_models\.py:\d+, in nudge: step 3 .*read-only"):
        evaluated(built(nudge), motion)
    assert motion.linear[0].tolist() == [1.0, 2.0, 3.0]
    follower = built(lambda t, motion, wrench: wrench.force.__setitem__(slice(None), motion.linear))
    evaluated(follower, motion)
    motion.linear[:] = 7.0  # the next message, in the same memory
    assert (evaluated(follower, motion).force == 7.0).all()


def test_the_motion_of_some_bodies_cannot_be_written_to_either():
    text = '[[providers]]\nname = "tail"\nmodel = "python"\nbodies = ["b"]\n'
    bodies = "\n".join(f'[[bodies]]\nname = "{name}"\nmass = 1.0\ninertia = 1.0' for name in "ab")
    model = built(
        lambda t, motion, wrench: motion.linear.fill(0.0),
        loads(f"[time]\nend = 1.0\n{bodies}\n{text}", "two"),
    )
    with pytest.raises(SimulationError, match="read-only"):
        evaluated(model, moving())


class Returns(linkwind.ForceModel):
    def evaluate(self, t, motion, wrench):
        return [1.0, 2.0, 3.0]


@pytest.mark.parametrize("model", [lambda t, motion, wrench: -0.5 * motion.linear, Returns])
def test_forces_that_are_returned_are_not_lost_in_silence(model):
    with pytest.raises(
        SimulationError, match=r"step 3 .*expected forces written into wrench; got (ndarray|list)"
    ):
        evaluated(built(model))
    assert evaluated(built(lambda t, motion, wrench: wrench)).force.tolist() == [[0.0] * 3] * 2


def test_a_function_of_the_wrong_arguments_is_told_which():
    def two(t, motion):
        """Forget the wrench."""

    with pytest.raises(
        InputError, match=r"expected a function of t, motion and wrench, .*two\(t, motion\), which"
    ):
        built(two)


def test_an_exception_says_file_line_step_and_time():
    model = built(f"{models.__file__}:fails_later")
    evaluated(model, t=0.011)
    text = f"{models.__file__}:68, in fails_later: step 12 (t = 0.012 s): ZeroDivisionError: float division"
    with pytest.raises(SimulationError, match="^" + re.escape(text)) as error:
        evaluated(model, t=0.012)
    assert isinstance(error.value.__cause__, ZeroDivisionError)


def test_the_line_is_that_of_the_users_code_and_not_what_it_calls():
    def wrong(t, motion, wrench):
        np.linalg.inv(np.zeros((2, 2)))

    line = wrong.__code__.co_firstlineno + 1
    with pytest.raises(SimulationError, match=rf"test_models\.py:{line}, in wrong: .*LinAlgError"):
        evaluated(built(wrong))


def test_shapes_that_do_not_fit_are_said():
    def flat(t, motion, wrench):
        wrench.force[:] = [1.0, 2.0]

    def replaced(t, motion, wrench):
        wrench.force = -motion.linear

    with pytest.raises(SimulationError, match=r"in flat: step 3 .*could not broadcast"):
        evaluated(built(flat))
    with pytest.raises(SimulationError, match=r"replaced: step 3 .*Write wrench\.force\[:\] = …"):
        evaluated(built(replaced))


class OnlyCommits(Model):
    def commit(self, t, motion):
        self.last = t


class OnlySaves(Model):
    def save(self):
        return b"x"


class NoBytes(Model):
    def save(self):
        return np.zeros(3)

    def restore(self, blob):
        raise KeyError("lost")

    def frame(self):
        return 1 / 0

    def close(self):
        raise OSError("gone")


def test_an_end_of_the_program_is_one_of_the_run():
    def leaves(t, motion, wrench):
        raise SystemExit(3)

    with pytest.raises(SimulationError, match=r"in leaves: step 3 \(t = 0\.003 s\): SystemExit: 3"):
        evaluated(built(leaves))


def test_what_remembers_has_to_save():
    for model, has in ((OnlyCommits, "commit"), (OnlySaves, "save")):
        with pytest.raises(
            InputError, match=rf"{model.__name__}: expected commit, save and restore .*{has}\."
        ):
            built(model)
    free = type("Free", (OnlyCommits,), {"capabilities": linkwind.Capabilities(rollback=False)})
    assert not built(free).capabilities.rollback
    model = built(models.Wake)
    model.commit(0.0, moving())
    before, blob = evaluated(model).force.tolist(), model.save()
    model.commit(0.001, moving())
    assert evaluated(model).force.tolist() != before
    again = built(models.Wake)
    again.restore(blob)
    assert evaluated(again).force.tolist() == before


def test_memory_that_goes_wrong_is_said(caplog):
    model = built(NoBytes)
    with pytest.raises(ProtocolError, match=r"NoBytes: save: expected bytes; got ndarray"):
        model.save()
    with pytest.raises(ProtocolError, match=r"test_models\.py:\d+, in restore: restore: KeyError: 'lost'"):
        model.restore(b"")
    with pytest.raises(ProtocolError, match=r"in frame: frame: ZeroDivisionError"):
        model.frame()
    model.close()
    assert "in close: close: OSError: gone" in caplog.text
    assert not hasattr(built(Model), "frame")
    with pytest.raises(ProtocolError, match="expected an empty checkpoint; got 1 bytes"):
        built(Model).restore(b"x")


class Half:
    def __init__(self, scenario, provider):
        self.capabilities = linkwind.Capabilities()

    def evaluate(self, t, motion, wrench):
        pass


class Boastful(Model):
    capabilities = "added_inertia"


class Fails(Model):
    def __init__(self, scenario, provider):
        raise ValueError("no wind")


class Empty(linkwind.ForceModel):
    pass


@pytest.mark.parametrize(
    ("model", "error"),
    [
        (Half, r"Half: expected a force model; got Half without commit, save, restore"),
        (Boastful, r"Boastful: capabilities: expected linkwind\.Capabilities; got 'added_inertia'"),
        (Fails, r"test_models\.py:\d+, in __init__: ValueError: no wind"),
        (Empty, r"Can't instantiate abstract class Empty .*evaluate"),
        (lambda t: None, r"expected a function of t, motion and wrench, or a class"),
        (Model(SCENARIO, SCENARIO.providers[0]), r"Give the class, not an object of it"),
        (3.0, r"expected a function of t, motion and wrench, .*; got 3\.0"),
    ],
)
def test_what_is_no_model_is_refused(model, error):
    with pytest.raises(InputError, match=error):
        built(model)


@pytest.mark.parametrize(
    ("text", "name", "error"),
    [
        (
            "def f(t, m, w): ...\nclass K: ...",
            None,
            r"expected FILE\.py:NAME, such as .*mine\.py:f, .*mine\.py:K; got no",
        ),
        ("def f(t, m, w): ...", "g", r"mine\.py: expected one of f; got g"),
        ("def f(t, m, w):\n    g = 1", "g", r"mine\.py: expected one of f; got g"),
        ("x = 1\ndef f(:\n", "f", r"mine\.py:2: expected Python; got: invalid syntax"),
        ("import numpy\n1/0\nf = 1", "f", r"mine\.py:2, in <module>: ZeroDivisionError"),
        ("raise SystemExit(3)\nf = 1", "f", r"mine\.py:1, in <module>: SystemExit: 3"),
        (
            "import linkwind\ndef f(t, m, w): ...\nlinkwind.run(linkwind.load('chain'), models={'aero': f})",
            "f",
            r"mine\.py:3, in <module>: InputError: expected a file that only defines.* if __name__",
        ),
        ("f = 3", "f", r"mine\.py:f: expected a function of t, motion and wrench, .*; got 3"),
    ],
)
def test_a_file_that_is_wrong_is_said(tmp_path, text, name, error):
    file = write(tmp_path, text)
    with pytest.raises(InputError, match=error):
        built(f"{file}:{name}" if name else file)


def test_a_file_that_is_not_there_is_said(tmp_path):
    with pytest.raises(InputError, match=r"none\.py: No such file or directory"):
        python_source(str(tmp_path / "none.py:f"))


def test_a_file_is_executed_anew_for_each_model_and_finds_those_beside_it(tmp_path):
    write(tmp_path, "FACTOR = 2.0", "beside_it.py")
    file = write(
        tmp_path,
        "import beside_it\nCOUNT = [0]\ndef f(t, motion, wrench):\n    COUNT[0] += 1\n"
        "    wrench.force[0, 0] = beside_it.FACTOR * COUNT[0]\n",
    )
    source = python_source(f"{file}:f")
    Path(file).write_text("raise ValueError('changed since')")
    for _ in range(2):
        assert evaluated(built(source)).force[0, 0] == 2.0


def test_another_file_or_name_is_refused(tmp_path):
    file, other = (
        write(tmp_path, "def f(t, m, w): ...\ndef g(t, m, w): ..."),
        write(tmp_path, "f = 1", "other.py"),
    )
    source = python_source(f"{file}:f")
    settings = [f"aero.python.source={source}", f"aero.python.sha256={source.sha256}"]
    scenario = load("two_link", ["aero.model=python", *settings])
    built(source, scenario)
    expected = rf"aero\.python: expected mine\.py:f with SHA-256 {source.sha256}; got "
    with pytest.raises(InputError, match=expected + r"mine\.py:g with"):
        built(f"{file}:g", scenario)
    with pytest.raises(InputError, match=expected + r"other\.py:f with"):
        built(f"{other}:f", scenario)
    with pytest.raises(InputError, match=expected + r"models\.py:partial\(drag\)"):
        built(functools.partial(models.drag), scenario)


def test_a_model_that_the_scenario_does_not_ask_for_is_refused():
    plate = load("two_link")
    with pytest.raises(InputError, match=r'expected "python" for models\.py:drag; got "plate"'):
        built(models.drag, plate)
    with pytest.raises(InputError, match=r"Add --model FILE\.py:NAME"):
        aero.build(SCENARIO, SCENARIO.providers[0])


def test_rotation_matrices_turn_body_vectors_into_the_world():
    motion, half = Motion.at_rest(2), np.sqrt(0.5)
    motion.orientation[1] = half, 0.0, 0.0, half  # 90° about z
    first, second = motion.rotation()
    assert first.tolist() == np.eye(3).tolist()
    assert np.allclose(second @ [1.0, 2.0, 3.0], [-2.0, 1.0, 3.0], rtol=0, atol=1e-15)
    motion.orientation[0] = half, half, 0.0, 0.0  # about x
    assert np.allclose(motion.rotation()[0] @ [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], rtol=0, atol=1e-15)
