"""The JSON Schema that editors complete scenario files with."""

import json
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from linkwind.scenario import template
from linkwind.scenario.schema import schema, text
from tests.scenario.texts import BUILTIN

SCHEMA = schema()
COMMITTED = Path(__file__).parents[2] / "schemas" / "scenario.schema.json"


def test_the_committed_schema_is_current():
    command = "python -m linkwind.scenario.schema schemas/scenario.schema.json"
    assert COMMITTED.read_text(encoding="utf-8") == text(), f"run: {command}"


def test_the_module_writes_it_to_stdout_or_a_file(tmp_path):
    command = [sys.executable, "-W", "error", "-m", "linkwind.scenario.schema"]
    assert subprocess.run(command, capture_output=True, check=True).stdout.decode() == text()
    subprocess.run([*command, str(tmp_path / "s.json")], check=True)
    assert (tmp_path / "s.json").read_text(encoding="utf-8") == text()


def resolve(node, kind=None):
    """Return the schema that a reference leads to, through `or null`; of several kinds, by their `type`."""
    options = [option for option in node.get("anyOf", []) if option != {"type": "null"}]
    if len(options) == 1:
        return resolve(options[0], kind)
    if "oneOf" in node and kind is not None:
        return resolve({"$ref": node["discriminator"]["mapping"][kind]})
    if "$ref" in node:
        return resolve(SCHEMA["$defs"][node["$ref"].rpartition("/")[2]])
    return node


def keys(node, path="", seen=()):
    """Yield path and schema of every key, into lists and tables of tables."""
    for kind in node.get("discriminator", {}).get("mapping", ()):
        yield from keys(resolve(node, kind), path)
    for name, inner in node.get("properties", {}).items():
        yield f"{path}{name}", inner
        target = resolve(inner)
        if isinstance(target.get("items"), dict):
            target = resolve(target["items"])
        elif isinstance(target.get("additionalProperties"), dict):
            target = resolve(target["additionalProperties"])
        yield from keys(target, f"{path}{name}.")


def test_every_key_is_described_and_every_number_has_its_unit():
    found = dict(keys(SCHEMA))
    some = {
        "time.end",
        "bodies.shape.span",
        "bodies.shape.points",
        "environment.gusts.phase_deg",
        "aero.field.let",
    }
    assert some <= set(found)
    for path, inner in found.items():
        assert inner.get("description"), path
        kinds = json.dumps(inner)
        if '"type": "number"' in kinds:
            assert f"[{inner['unit']}]" in inner["description"], path


def unknown(data, node, path=""):
    """Yield the keys of a TOML file that the schema does not know, and the required ones it lacks."""
    node = resolve(node)
    yield from (f"{path}{key} is missing" for key in node.get("required", []) if key not in data)
    for key, value in data.items():
        inner = node.get("properties", {}).get(key)
        if inner is None:
            inner = node.get("additionalProperties")
            if not isinstance(inner, dict):
                yield f"{path}{key} is unknown"
                continue
        entries = value if isinstance(value, list) else [value]
        target = resolve(inner, value.get("type") if isinstance(value, dict) else None)
        for entry in entries:
            if isinstance(entry, dict):
                items = target.get("items", {}) if isinstance(value, list) else target
                yield from unknown(entry, resolve(items, entry.get("type")), f"{path}{key}.")


@pytest.mark.parametrize("name", [*sorted(BUILTIN), "template"])
def test_files_fit_the_schema(name):
    source = template() if name == "template" else BUILTIN[name]
    assert list(unknown(tomllib.loads(source), SCHEMA)) == []


def test_the_schema_refuses_what_the_parser_refuses():
    data = tomllib.loads(BUILTIN["two_link"])
    data["bodies"][0]["angle"] = 1
    del data["bodies"][1]["mass"]
    del data["time"]
    assert list(unknown(data, SCHEMA)) == [
        "time is missing",
        "bodies.angle is unknown",
        "bodies.mass is missing",
    ]


def test_the_template_shows_every_key():
    missing = [path for path, _ in keys(SCHEMA) if not re.search(rf"\b{path.split('.')[-1]}\b", template())]
    assert missing == []


@pytest.mark.parametrize("name", sorted(BUILTIN))
def test_builtins_name_the_schema_for_editors(name):
    first = BUILTIN[name].splitlines()[0]
    library = Path(__file__).parents[2] / "services" / "linkwind" / "scenario" / "library"
    assert (library / first.removeprefix("#:schema ")).resolve() == COMMITTED
