"""Whole runs with a force model in Python: the same bits in every process, into the log and out of it."""

from __future__ import annotations

import hashlib
import json
import os
import signal
import sys
import threading
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import linkwind
from linkwind import aero
from linkwind.bus.zenoh import loopback_endpoint
from linkwind.cli import app
from linkwind.errors import FaultError, InputError
from linkwind.log import contents
from linkwind.log.origin import origin
from linkwind.log.reader import open_log
from linkwind.runs.conformance import conformance
from linkwind.scenario import from_json
from tests.faults.recovered import LONG, child_of, under_way, unharmed
from tests.faults.test_processes import Programs
from tests.own import models

FILE = Path(models.__file__)
SHA256 = hashlib.sha256(FILE.read_bytes()).hexdigest()
SHORT = ["time.end=0.1"]
HERE = [*SHORT, "bus.transport=inprocess"]


def messages(log: Path) -> list[tuple[str, int, bytes]]:
    """Return all messages in order but for how long exchanges took."""
    return [tuple(m) for m in open_log(log).raw() if m.topic != contents.TIMING]


def fly(folder: Path, model=None, settings=HERE):
    """Run two_link in a folder of one name, so that all runs have the same id."""
    models_ = {} if model is None else {"aero": model}
    return linkwind.run(linkwind.load("two_link", settings), folder / "run", models=models_, report=False)


@pytest.fixture(scope="module")
def native(tmp_path_factory):
    return messages(fly(tmp_path_factory.mktemp("native")).log)


@pytest.mark.parametrize("model", [models.Native, f"{FILE}:Native"], ids=["class", "file"])
def test_the_native_plate_called_from_python_sends_the_same_messages(tmp_path, native, model):
    outcome = fly(tmp_path, model)
    assert messages(outcome.log) == native
    assert outcome.report is None
    assert not (tmp_path / "run" / "report.html").exists()


def test_over_zenoh_as_well(tmp_path, native):
    outcome = fly(tmp_path, f"{FILE}:Native", SHORT)
    assert messages(outcome.log) == native
    assert from_json(open_log(outcome.log).scenario_json).bus.transport == "zenoh"


def test_a_provider_in_python_that_is_killed_comes_back_to_the_same_bits(tmp_path):
    programs = Programs(tmp_path)
    try:
        options = [f"--set={setting}" for setting in (*LONG, "log.checkpoint_every=200")]
        run = programs.start("run", "two_link", "--model", f"{FILE}:Wake", "--out", "out", "--json", *options)
        under_way(programs.log())
        os.kill(child_of(run), signal.SIGKILL)
        assert unharmed(run, programs.log(), {"aero": aero.own(f"{FILE}:Wake")})["returns"]
    finally:
        programs.end()


@pytest.mark.parametrize(
    "model", [models.drag, models.Wake, f"{FILE}:Wake"], ids=["function", "class", "file"]
)
def test_the_log_says_which_model_it_was_and_is_verified_with_it_alone(tmp_path, model):
    log = fly(tmp_path, model).log
    name = "drag" if model is models.drag else "Wake"
    said = from_json(open_log(log).scenario_json).providers[0]
    assert (said.model, said.python.source, said.python.sha256) == ("python", f"models.py:{name}", SHA256)
    assert list(origin(open_log(log))) == [
        f'the forces of "aero" come from models.py:{name} with SHA-256 {SHA256}'
    ]
    assert linkwind.verify(log, models={"aero": f"{FILE}:{name}"}).identical
    assert linkwind.verify(log, models={"aero": getattr(models, name)}).identical
    assert linkwind.verify(log.parent, from_recorded_wrenches=True).identical
    with pytest.raises(
        InputError, match=rf"models\.py:{name}, SHA-256 {SHA256}; got none\. Add --model aero="
    ):
        linkwind.verify(log)
    with pytest.raises(InputError, match=rf"expected models\.py:{name} with .*; got models\.py:Native"):
        linkwind.verify(log, models={"aero": f"{FILE}:Native"})


def test_a_model_that_has_changed_since_is_refused(tmp_path):
    file = tmp_path / "mine.py"
    file.write_text("def pull(t, motion, wrench):\n    wrench.force[:, 0] = 1.0\n")
    log = fly(tmp_path, f"{file}:pull").log
    assert linkwind.verify(log, models={"aero": f"{file}:pull"}).identical
    file.write_text("def pull(t, motion, wrench):\n    wrench.force[:, 0] = 2.0\n")
    with pytest.raises(InputError, match=r"expected mine\.py:pull with SHA-256 .*; got mine\.py:pull with"):
        linkwind.verify(log, models={"aero": f"{file}:pull"})


def test_a_run_goes_on_with_its_model_from_a_checkpoint(tmp_path):
    settings = [*HERE, "log.checkpoint_every=30"]
    for name, model in (("file", f"{FILE}:Wake"), ("class", models.Wake)):
        whole = fly(tmp_path / name, model, settings)
        folder = tmp_path / name / "again"
        again = linkwind.resume(whole.log, folder, from_step=70, models={"aero": model}, report=False)
        assert again.result.final_state_sha256 == whole.result.final_state_sha256
        assert open_log(again.log).metadata[contents.RESUMED_STEP] == "70"
        assert linkwind.verify(again.log, models={"aero": model}).identical
        with pytest.raises(InputError, match="expected the Python of its model"):
            linkwind.resume(whole.log, tmp_path / "none", from_step=70)
        assert not (tmp_path / "none").exists()


def test_a_function_that_fails_ends_the_run_with_one_error(tmp_path):
    text = r"stopped at step 12: SimulationError: .*models\.py:68, in fails_later: step 12 \(t = 0\.012 s\)"
    for name, settings in (("here", HERE), ("zenoh", SHORT)):
        with pytest.raises(FaultError, match=text):
            fly(tmp_path / name, f"{FILE}:fails_later", settings)
        log = open_log(tmp_path / name / "run" / "log.mcap")
        assert log.steps == 11
        assert "models.py:68" in log.error
        assert linkwind.verify(log, models={"aero": f"{FILE}:fails_later"}).identical
    assert "print(1.0 / (t - t))" in (tmp_path / "zenoh" / "run" / "aero.log").read_text()  # the traceback


def test_all_that_a_model_can_return_is_used_and_logged(tmp_path):
    log = fly(tmp_path, models.Everything).log
    answers, path = linkwind.table(log, "wrench_aero"), linkwind.table(log)
    assert answers["link2.added_inertia.22"][0] == 0.1
    assert answers["response.0"][0] == 2.0
    assert (
        answers["speed [m/s]"][0] == np.hypot(path["link1.linear.x [m/s]"], path["link1.linear.y [m/s]"])[0]
    )
    assert linkwind.verify(log, models={"aero": models.Everything}).identical


def test_a_branch_keeps_the_memory(tmp_path):
    whole = fly(tmp_path, f"{FILE}:Wake", [*HERE, "log.checkpoint_every=30"])
    own = {"aero": f"{FILE}:Wake"}
    settings = ["environment.gravity=[0, 0, 0]"]
    branch = linkwind.resume(
        whole.log, tmp_path / "b", from_step=70, overrides=settings, models=own, report=False
    )
    force, other = (linkwind.table(run.log, "wrench_aero")["link1.force.y [N]"] for run in (whole, branch))
    assert force[:71].tolist() == other[:71].tolist()
    assert 0.0 < abs(other[72] - force[72]) < 0.1 * abs(force[72])  # without memory it would be a fifth
    assert linkwind.verify(branch.log, models=own).identical


def test_a_hidden_memory_is_found(tmp_path):
    scenario = linkwind.load("two_link", ["aero.model=python"])
    command = [
        sys.executable,
        "-m",
        "linkwind",
        "aero",
        "--connect",
        "{endpoint}",
        "--model",
        f"{FILE}:counts",
    ]
    found = {result.check: result.ok for result in conformance(scenario, "aero", command, tmp_path / "out")}
    assert {check for check, ok in found.items() if ok is False} == {"iterations", "goes on", "comes back"}


def test_numbers_that_are_none_are_refused(tmp_path):
    def nothing(t, motion, wrench):
        wrench.torque[1, 2] = float("nan") if t > 0.005 else 0.0

    with pytest.raises(linkwind.LinkwindError, match=r'"aero": .*step 6.* torque on link2: expected finite'):
        fly(tmp_path, nothing)


def test_a_model_that_cannot_be_loaded_leaves_no_folder(tmp_path):
    with pytest.raises(InputError, match="got drug"):
        fly(tmp_path, f"{FILE}:drug")
    assert not (tmp_path / "run").exists()
    with pytest.raises(InputError, match=r"expected a provider of two_link\.toml, aero; got areo"):
        linkwind.run(linkwind.load("two_link"), models={"areo": models.drag})


def test_a_provider_is_served_from_python(tmp_path, native):
    """The dynamics, with its own end of the bus, in a thread: as in another process."""
    from linkwind.runs.run import Ends, dynamics

    endpoint = loopback_endpoint()
    scenario = linkwind.load("two_link", [*SHORT, "aero.model=python"])
    runs: list[Path] = []

    def other() -> None:
        runs.append(dynamics(scenario, tmp_path / "run", lambda step: None, Ends([endpoint], [])).log)

    thread = threading.Thread(target=other)
    thread.start()
    linkwind.serve("aero", models.Native, connect=endpoint)
    thread.join(60.0)
    assert messages(runs[0]) == native


def invoke(*arguments: object):
    return CliRunner().invoke(app, [*map(str, arguments)])


def test_the_commands(tmp_path):
    quick = [f"--set={setting}" for setting in (*HERE, "log.checkpoint_every=30")]
    done = invoke("run", "two_link", "--model", f"{FILE}:Wake", *quick, "--json", "--out", tmp_path / "a")
    assert done.exit_code == 0, done.output
    whole, log = json.loads(done.stdout), tmp_path / "a" / "log.mcap"
    assert "models.py:Wake" in invoke("log", "info", log).stdout
    assert invoke("verify", log, "--model", f"aero={FILE}:Wake").exit_code == 0
    assert "Add --model aero=FILE.py:NAME" in str(invoke("verify", log).exception)
    back = ("resume", log, "--from-step", 50, "--json", "--out")
    assert "Add --model aero=FILE.py:NAME" in str(invoke(*back, tmp_path / "b").exception)
    done = invoke(*back, tmp_path / "b", "--model", f"{FILE}:Wake")
    assert json.loads(done.stdout)["final_state_sha256"] == whole["final_state_sha256"]
    other = ("replay", log, "--substitute", "aero", "--json", "--out")
    done = invoke(*other, tmp_path / "c", "--model", f"{FILE}:Wake")
    assert json.loads(done.stdout)["identical_answers"] == 101
    done = invoke(*other, tmp_path / "d", "--model", f"{FILE}:drag")
    assert json.loads(done.stdout)["identical_answers"] < 101


def test_options_that_do_not_fit(tmp_path):
    assert "Add --model aero=FILE.py:NAME" in str(
        invoke("run", "two_link", "--set", "aero.model=python").exception
    )
    done = invoke("run", "two_link", "--model", f"areo={FILE}:drag")
    assert "--model areo=" in str(done.exception)
    assert "expected a provider of two_link.toml before the =, aero; got areo" in str(done.exception)
    done = invoke("run", "two_link", "--model", f"{FILE}:drag", "--model", f"aero={FILE}:Wake")
    assert "expected one model for aero; got models.py:drag as well" in str(done.exception)
    assert "got both" in invoke("aero", "--model", f"{FILE}:drag", "--force-fmu", "x.fmu").output
