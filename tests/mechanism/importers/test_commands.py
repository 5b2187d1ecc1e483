"""The commands as a user gives them."""

import json

import mujoco
import pytest
from typer.testing import CliRunner

from linkwind.cli import app
from linkwind.errors import InputError
from linkwind.scenario import load
from tests.mechanism.importers.robots import random_urdf


def run(*arguments):
    result = CliRunner().invoke(app, ["mechanism", *map(str, arguments)])
    if result.exception and not isinstance(result.exception, SystemExit):
        raise result.exception
    return result.output


@pytest.fixture
def robot(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "robot.urdf").write_text(random_urdf(0))
    return tmp_path / "robot.urdf"


def test_import_writes_a_scenario_and_says_what_it_leaves_out(robot):
    output = run("import", robot)
    assert output.startswith(
        "wrote robot.toml (URDF: 10 bodies, 10 joints); run it with: linkwind run robot.toml\n"
    )
    assert "  links merged into the one that they are fixed to (1): fixed to the world\n" in output
    assert load("robot.toml").planar is False
    with pytest.raises(InputError, match=r"robot\.toml: expected a new file; got one that exists"):
        run("import", robot)


def test_json_and_the_way_back(robot):
    facts = json.loads(run("import", robot, "-o", "a.toml", "--at", "j1=0.5", "--json"))
    assert (facts["file"], facts["kind"], facts["bodies"], facts["joints"]) == ("a.toml", "URDF", 10, 10)
    assert facts["left_out"][-1]["items"] == ["world → world"]
    back = json.loads(run("export", "a.toml", "--json"))
    assert (back["file"], back["links"], back["joints"]) == ("a.urdf", 11, 10)
    assert [group["what"] for group in back["left_out"]] == ["starts"]
    assert mujoco.MjModel.from_xml_path(str(robot.parent / "a.urdf")).nv == 7
