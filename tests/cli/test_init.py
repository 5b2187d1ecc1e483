"""``linkwind init``: a scenario to start from."""

import pytest
from typer.testing import CliRunner

import linkwind
from linkwind.cli import app
from linkwind.errors import InputError
from linkwind.scenario import builtin_names


def init(*arguments):
    return CliRunner().invoke(app, ["init", *map(str, arguments)])


def test_the_template_loads(tmp_path):
    file = tmp_path / "my.toml"
    assert init(file).exit_code == 0
    linkwind.load(file)


@pytest.mark.parametrize("name", builtin_names())
def test_a_copy_is_the_built_in_scenario(name, tmp_path):
    file = tmp_path / f"{name}.toml"
    assert init(file, "--from", name).exit_code == 0
    assert linkwind.load(file) == linkwind.load(name)


def test_what_is_there_stays(tmp_path):
    file = tmp_path / "my.toml"
    file.write_text("mine")
    assert isinstance(init(file).exception, InputError)
    assert file.read_text() == "mine"


def test_an_unknown_name_leaves_no_file(tmp_path):
    file = tmp_path / "my.toml"
    with pytest.raises(InputError, match=r"got another\. Use \"flutter\""):
        raise init(file, "--from", "fluter").exception
    assert not file.exists()
