"""Tables of functions: from a file or written out, the numbers are in the scenario, or it says why not."""

import json

import pytest

from linkwind.errors import ScenarioError
from linkwind.scenario import from_json, load
from tests.scenario.texts import SMALL

DRIVEN = (
    SMALL
    + """
[[joints]]
name = "pin"
type = "revolute"
parent = "world"
child = "a"
[[forces]]
type = "motion"
name = "beat"
joint = "pin"
position = { table = "kin.csv", periodic = true }
"""
)
CSV = """# measured by somebody
t, q
0, 0.0
0.25, 1

0.5, 0.5
1.0, -2e-16
"""
POINTS = ((0.0, 0.0), (0.25, 1.0), (0.5, 0.5), (1.0, 0.0))


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "mine.toml").write_text(DRIVEN, encoding="utf-8")
    (tmp_path / "kin.csv").write_text(CSV, encoding="utf-8")
    return tmp_path


def test_a_file_is_found_beside_the_scenario_and_its_numbers_are_in_it(folder):
    scenario = load(folder / "mine.toml")
    assert scenario.forces[0].position.table == POINTS
    assert scenario.forces[0].position.interpolation == "spline"
    written = json.loads(scenario.to_json())["forces"][0]["position"]
    assert written["table"] == [list(point) for point in POINTS]
    (folder / "kin.csv").unlink()
    assert from_json(scenario.to_json()) == scenario


def test_names_of_columns_may_be_left_out(folder):
    (folder / "kin.csv").write_text(CSV.replace("t, q\n", ""), encoding="utf-8")
    assert load(folder / "mine.toml").forces[0].position.table == POINTS


def test_a_file_on_the_command_line_starts_where_the_command_does(folder, tmp_path_factory, monkeypatch):
    elsewhere = tmp_path_factory.mktemp("elsewhere")
    (elsewhere / "other.csv").write_text(CSV.replace("0.5, 0.5", "0.5, 0.75"), encoding="utf-8")
    monkeypatch.chdir(elsewhere)
    scenario = load(folder / "mine.toml", ["forces.beat.position.table=other.csv"])
    assert scenario.forces[0].position.table[2] == (0.5, 0.75)


def test_a_scenario_from_elsewhere_names_no_file(folder):
    data = json.loads(load(folder / "mine.toml").to_json())
    data["forces"][0]["position"]["table"] = str(folder / "kin.csv")
    with pytest.raises(ScenarioError, match=r"table: expected points .*Name files in a scenario's own"):
        from_json(json.dumps(data))


def test_an_expression_called_table_is_no_file(folder):
    more = """
[[forces]]
type = "point_force"
name = "jet"
body = "a"
let = { table = "sin(t)" }
fx = "2*table"
"""
    (folder / "mine.toml").write_text(DRIVEN + more, encoding="utf-8")
    assert load(folder / "mine.toml").forces[1].let == {"table": "sin(t)"}


FILES = [
    ("0.25, 1", "0.25; 1", "2 columns, variable and value, in line 4 of kin.csv; got 1. Separate them by a "
     "comma."),
    ("0.25, 1", "0.25, x", 'finite numbers in line 4 of kin.csv; got "x". Correct it.'),
    ("0.25, 1", "nan, 1", 'finite numbers in line 4 of kin.csv; got "nan". Correct it.'),
    ("0.5, 0.5", "0.25, 0.5", "a variable above 0.25 of the point before in line 6 of kin.csv; "
     "got [0.25, 0.5]. Sort the points; each comes once."),
    ("-2e-16", "0.1", "the first value again, 0.0 (periodic) in line 7 of kin.csv; "
     "got [1.0, 0.1]. Correct it."),
    (CSV, "t, q\n0, 1\n", "at least 2 points in kin.csv; got 1. Add rows: variable, value."),
    (CSV, "", "at least 2 points in kin.csv; got 0. Add rows: variable, value."),
]  # fmt: skip


@pytest.mark.parametrize(("old", "new", "expected"), FILES)
def test_what_is_wrong_with_a_file(folder, old, new, expected):
    (folder / "kin.csv").write_text(CSV.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(ScenarioError) as error:
        load(folder / "mine.toml")
    path = folder / "mine.toml"
    assert str(error.value) == f'{path}: forces[0] "beat".position.table: expected {expected}'


def test_a_file_that_is_not_there(folder):
    (folder / "kin.csv").unlink()
    with pytest.raises(ScenarioError) as error:
        load(folder / "mine.toml")
    assert str(error.value) == (
        f'{folder / "mine.toml"}: forces[0] "beat".position.table: expected a file with the columns variable '
        f"and value; got {folder / 'kin.csv'}: No such file or directory. Check the path."
    )
