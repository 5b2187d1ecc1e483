"""The scenarios in a log: as they were, or an error that says whose they are."""

from __future__ import annotations

import json

import pytest

from linkwind.errors import ScenarioError
from linkwind.log import writer as writing
from linkwind.log.reader import open_log
from linkwind.log.scenarios import last_recorded, recorded, recorded_changes
from linkwind.log.versions import versions
from linkwind.scenario import load
from tests.log.sample import new_writer

ONE, OTHER = load("two_link"), load("two_link", ["time.end=2.4"])


def log_of(path, text, **metadata):
    with new_writer(path, scenario_json=text, metadata=metadata) as writer:
        writer.close(final_state_sha256="00")
    return open_log(path)


def test_scenarios_of_a_run_and_of_what_it_went_on_with(tmp_path):
    changes = json.dumps({"7": OTHER.to_json()})
    log = log_of(tmp_path / "log.mcap", ONE.to_json(), changes=changes)
    assert recorded(log) == ONE
    assert recorded_changes(log) == {7: OTHER}
    assert last_recorded(log) == OTHER
    assert recorded(log, ["time.end=3.0"]) == load("two_link", ["time.end=3.0"])


def test_a_scenario_of_another_version_is_told_from_a_wrong_setting(tmp_path, monkeypatch):
    here = versions()["linkwind"]
    monkeypatch.setattr(writing, "versions", lambda: {"linkwind": "0.0.9"})
    data = json.loads(ONE.to_json())
    data["environment"]["humidity"] = 0.3
    path = tmp_path / "log.mcap"
    with pytest.raises(ScenarioError) as error:
        recorded(log_of(path, json.dumps(data)), ["time.end=3.0"])
    whose, what = str(error.value).splitlines()
    assert whose.startswith(f"{path}: expected a log of this linkwind, {here}; got one of 0.0.9, ")
    assert whose.endswith("Use that version, or make the run again.")
    assert what.startswith(f"{path}: scenario: environment.humidity: expected a key among gravity, ")
    with pytest.raises(ScenarioError, match=r"^--set time\.end=-1: time\.end: expected a number above 0"):
        recorded(log_of(tmp_path / "ours.mcap", ONE.to_json()), ["time.end=-1"])
