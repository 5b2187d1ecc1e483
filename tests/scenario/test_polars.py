"""Tables of coefficients: from a file or written out, the numbers are in the scenario, or it says why not."""

import json

import pytest

from linkwind.errors import ScenarioError
from linkwind.scenario import from_json, load, loads
from tests.scenario.texts import SMALL

PLATE = SMALL + 'shape = { type = "plate", length = 0.5 }\n[aero]\nmodel = "plate"\n[aero.plate]\n'
TABLED = PLATE + 'coefficients = "table"\n'
CSV = """# a thin plate, by somebody
cl, alpha_deg, re, cd, cm
0,0,1e4,0.05,0

0.9,20,1e4,0.4,-0.02
0,90,1e4,1.9,-0.475
"""
ROWS = ((0.0, 0.0, 0.05, 0.0), (20.0, 0.9, 0.4, -0.02), (90.0, 0.0, 1.9, -0.475))
COLUMNS = "alpha_deg, cl, cd, cm"


def table_of(scenario):
    return scenario.providers[0].plate.table


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "mine.toml").write_text(TABLED + 'table = "wing.csv"\n', encoding="utf-8")
    (tmp_path / "wing.csv").write_text(CSV, encoding="utf-8")
    return tmp_path


def test_a_file_is_found_beside_the_scenario_and_its_numbers_are_in_it(folder):
    scenario = load(folder / "mine.toml")
    assert table_of(scenario) == ROWS
    written = json.loads(scenario.to_json())["providers"][0]["plate"]
    assert written == {"coefficients": "table", "strips": 1, "table": [list(row) for row in ROWS]}
    (folder / "wing.csv").unlink()
    assert from_json(scenario.to_json()) == scenario


def test_rows_may_be_written_out():
    assert table_of(loads(f"{TABLED}table = {[list(row) for row in ROWS]}", "a.toml")) == ROWS


def test_a_file_on_the_command_line_starts_where_the_command_does(folder, tmp_path_factory, monkeypatch):
    elsewhere = tmp_path_factory.mktemp("elsewhere")
    (elsewhere / "other.csv").write_text(CSV.replace("0.9", "0.8"), encoding="utf-8")
    monkeypatch.chdir(elsewhere)
    scenario = load(folder / "mine.toml", ["aero.plate.table=other.csv"])
    assert table_of(scenario)[1] == (20.0, 0.8, 0.4, -0.02)
    again = from_json(load(folder / "mine.toml").to_json(), overrides=["aero.plate.table=other.csv"])
    assert again == scenario


def test_a_table_may_wait_while_another_set_is_used(folder):
    scenario = load(folder / "mine.toml", ["aero.plate.coefficients=andersen"])
    assert (scenario.providers[0].plate.coefficients, table_of(scenario)) == ("andersen", ROWS)


def test_a_scenario_from_elsewhere_names_no_file(folder):
    data = json.loads(load(folder / "mine.toml").to_json())
    data["providers"][0]["plate"]["table"] = str(folder / "wing.csv")
    with pytest.raises(
        ScenarioError, match=r"plate\.table: expected rows .*got .*Name files in a scenario's own"
    ):
        from_json(json.dumps(data), overrides=["time.end=0.5"])


FILES = [
    ("alpha_deg, re", "alpha, re",
     f"the columns {COLUMNS} in the first line of wing.csv, each once; got cl, alpha, re, cd, cm. "
     'Correct "alpha_deg".'),
    ("re, cd", "cm, cd",
     f"the columns {COLUMNS} in the first line of wing.csv, each once; got cl, alpha_deg, cm, cd, cm. "
     'Correct "cm".'),
    (CSV, "", f"the columns {COLUMNS} in the first line of wing.csv, each once; got nothing. "
     'Correct "alpha_deg".'),
    ("0.9,20", "nan,20", 'a finite number for cl in line 5 of wing.csv; got "nan". Correct it.'),
    ("1.9,", "x,", 'a finite number for cd in line 6 of wing.csv; got "x". Correct it.'),
    ("0.9,20,", "0.9,20;", "5 columns in line 5 of wing.csv; got 4. Separate them by commas."),
    ("0.9,20", "0.9,0", "alpha_deg above 0.0 of the row before in line 5 of wing.csv; got 0.0. "
     "Sort the rows; each comes once."),
    ("0,90", "0,80", "rows from alpha_deg -180 to 180, from 0 to 180 or from 0 to 90 in wing.csv; "
     "got 0.0 to 80.0. A plate that moves meets the air from all sides: add rows."),
    ("1e4,0.4", "1e4,-0.4", "cd of at least 0 in line 5 of wing.csv; got -0.4. "
     "Drag takes energy: correct the sign."),
    ("0,0,1e4", "0.1,0,1e4", "cl 0 by symmetry at 0 degrees in line 3 of wing.csv; got 0.1. "
     "Correct it, or write the table from -180 to 180."),
    ("-0.475", "-0.4", "cm -0.475 by symmetry at 90 degrees (-cd/4: no moment about the middle of the chord) "
     "in line 6 of wing.csv; got -0.4. Correct it, or write the table from -180 to 180."),
]  # fmt: skip


@pytest.mark.parametrize(("old", "new", "expected"), FILES)
def test_what_is_wrong_with_a_file(folder, old, new, expected):
    (folder / "wing.csv").write_text(CSV.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(ScenarioError) as error:
        load(folder / "mine.toml")
    assert str(error.value) == f"{folder / 'mine.toml'}: aero.plate.table: expected {expected}"


def test_a_file_that_is_not_there_hides_nothing_else(folder):
    (folder / "wing.csv").unlink()
    with pytest.raises(ScenarioError) as error:
        load(folder / "mine.toml", ["coupling.order=9"])
    first, second = str(error.value).splitlines()
    assert first == (
        f"{folder / 'mine.toml'}: aero.plate.table: expected a file with the columns {COLUMNS}; "
        f"got {folder / 'wing.csv'}: No such file or directory. Check the path."
    )
    assert "coupling.order" in second


def test_an_override_is_named_where_its_file_is_wrong(folder):
    (folder / "bytes.csv").write_bytes(b"\xff\xfe\x00")
    argument = f"aero.plate.table={folder / 'bytes.csv'}"
    with pytest.raises(ScenarioError, match="no text in UTF-8") as error:
        load(folder / "mine.toml", [argument])
    assert str(error.value).startswith(f"--set {argument}: aero.plate.table: expected a file")


CLOSED = [[-180, 0.1, 0.05, 0], [0, 0.3, 0.02, -0.05], [180, 0.1, 0.05, 0]]
INLINE = [
    ("table = 3", f"table: expected rows [{COLUMNS}]; got 3. "
     "For example [[0, 0, 0.1, 0], [90, 0, 1.9, -0.475]]."),
    ("table = [[0, 0, 0.1]]", f"table: expected rows [{COLUMNS}]; got [[0, 0, 0.1]]. "
     "For example [[0, 0, 0.1, 0], [90, 0, 1.9, -0.475]]."),
    ('table = [[0, 0, 0.1, "0"], [90, 0, 1.9, 0]]', f"table: expected rows of 4 numbers [{COLUMNS}]; "
     'got [0, 0, 0.1, "0"]. Write numbers without units or quotes.'),
    (f"table = {[CLOSED[0], CLOSED[2], CLOSED[1]]}", "table[2]: expected alpha_deg above 180.0 of the row "
     "before; got 0.0. Sort the rows; each comes once."),
    (f"table = {[*CLOSED[:2], [180, 0.2, 0.05, 0]]}", "table[2]: expected cl 0.1 as at -180 degrees; "
     "got 0.2. It is the same angle: correct one of the two."),
    ("", f"table: expected rows [{COLUMNS}], or a CSV file with these columns; got nothing. Add table."),
    (f"table = {CLOSED}\nstrips = 0", "strips: expected a number of at least 1; got 0. Change the value."),
]  # fmt: skip


@pytest.mark.parametrize(("text", "expected"), INLINE)
def test_what_is_wrong_with_rows_that_are_written_out(text, expected):
    with pytest.raises(ScenarioError) as error:
        loads(TABLED + text, "a.toml")
    assert str(error.value).splitlines()[0] == f"a.toml: aero.plate.{expected}"


def test_a_table_that_nothing_would_use_is_told():
    with pytest.raises(ScenarioError) as error:
        loads(f"{PLATE}table = {CLOSED}", "a.toml")
    assert str(error.value) == (
        'a.toml: aero.plate.coefficients: expected "table", or another set; got nothing. '
        'Add coefficients = "table".'
    )
