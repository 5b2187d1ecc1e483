"""The export as a whole: the same file each time, errors that tell what to do, the commands."""

from __future__ import annotations

import importlib.util
import json
import subprocess
import sys
import zipfile

import pytest
from typer.testing import CliRunner

from linkwind.cli import app
from linkwind.errors import InputError
from linkwind.fmi import toolchain
from linkwind.fmi.check import check, reference_error
from linkwind.fmi.data import source
from linkwind.fmi.export import content_of, export
from linkwind.fmi.part import aero_part, dynamics_part
from linkwind.fmi.peers import MISSING
from linkwind.scenario import load, loads
from tests.fmi.conftest import FORMS, scenario


def test_two_exports_are_the_same_bytes(fmu, tmp_path):
    """Also from another process, where hashes of strings differ."""
    out = tmp_path / "again.fmu"
    command = [sys.executable, "-m", "linkwind", "fmu", "export", "two_link", "-o", str(out), "--fmi", "3"]
    subprocess.run(command, check=True, capture_output=True)
    assert out.read_bytes() == fmu("two_link", "3").read_bytes()


def test_portable_binaries_are_the_same_bytes_too(everywhere, tmp_path):
    again = export(scenario("two_link"), tmp_path / "again.fmu", fmi="3", platforms=["x86_64-windows"])
    assert again.platforms == ("x86_64-windows",)
    with zipfile.ZipFile(again.file) as own, zipfile.ZipFile(everywhere.file) as first:
        for name in own.namelist():
            assert own.read(name) == first.read(name), name


def test_token_tells_models_apart():
    """The token, which guards states against other models, changes with everything that a model is."""

    def token(changes=(), **form):
        text = content_of(load("two_link", list(changes)), **form)["modelDescription.xml"].decode()
        return text.partition("{")[2].partition("}")[0]

    tokens = [
        token(), token(["bodies.link1.mass=3"]), token(["dynamics.substeps=2"]), token(fmi="3"),
        token(fmi="3", arrays="scalar"), token(part="aero"),
        token(["environment.wind=[-4.0, 0.0]"], part="aero"),
    ]  # fmt: skip
    assert token() == tokens[0]
    assert len(set(tokens)) == len(tokens)


def test_data_keep_every_bit():
    """The C file says in hexadecimal what the scenario says: read it back."""
    part = dynamics_part(scenario("spatial"), native_arrays=True)
    text = source(part, "{token}")
    numbers = text.partition("lw_fmu_start[] = {")[2].partition("}")[0]
    read = [float.fromhex(word) for word in numbers.replace("\n", " ").split(",") if word.strip()]
    assert read == part.start().tolist()
    assert 'lw_fmu_token[] = "{token}"' in text


@pytest.mark.parametrize(("part", "fmi", "arrays"), FORMS)
def test_check_finds_nothing_and_references_are_met_to_the_last_bit(fmu, part, fmi, arrays):
    found = check(fmu("two_link", fmi, part, arrays))
    assert (found.ok, found.errors, found.reference_max_error) == (True, (), 0.0)
    assert found.checkers["fmpy"] == found.checkers["references"] == "ok"


@pytest.mark.parametrize(
    ("name", "part", "fmi"),
    [
        ("spatial", "dynamics", "3"),
        ("spatial", "aero", "3"),
        ("two_link_gust", "aero", "3"),
        ("sheared", "aero", "2"),
        ("sheared", "aero", "3"),
        ("servo", "dynamics", "2"),
        ("servo", "dynamics", "3"),
    ],
)
def test_references_of_other_models(fmu, name, part, fmi):
    assert reference_error(fmu(name, fmi, part)) == 0.0


@pytest.mark.parametrize("fmi", ["2", "3"])
def test_the_forces_on_a_wing_have_the_bits_of_the_library(tmp_path, fmi):
    """One wing, away from its centre of mass, beside two plates, all in eight strips."""
    wing = 'bodies.left_wing.shape={type="wing",points=[[-0.1,-0.3],[0.1,-0.3],[0.12,0.1],[0.05,0.35]]}'
    flapper = load("flapper", [wing])
    out = export(flapper, tmp_path / "wing.fmu", fmi=fmi, part="aero").file
    assert reference_error(out) == 0.0
    with zipfile.ZipFile(out) as archive:
        text = archive.read("modelDescription.xml").decode()
    assert "Mean chord of the wing left_wing" in text
    assert "Length of the plate right_wing" in text


@pytest.mark.parametrize("fmi", ["2", "3"])
def test_a_motion_by_table_has_the_bits_of_the_core(tmp_path, fmi):
    table = "{ table = [[0, 0], [0.05, 0.3], [0.07, 0.1], [0.1, 1e-17]], periodic = true }"
    text = f"""
[time]
end = 0.2
[[bodies]]
name = "arm"
mass = 1.0
inertia = 0.1
[[joints]]
name = "pin"
type = "revolute"
parent = "world"
child = "arm"
[[forces]]
type = "motion"
name = "beat"
joint = "pin"
position = {table}
"""
    made = export(loads(text, "beat.toml"), tmp_path / "beat.fmu", fmi=fmi)
    assert reference_error(made.file) == 0.0


def test_check_notices_wrong_references(fmu, tmp_path):
    """One digit of one result is changed."""
    wrong = tmp_path / "wrong.fmu"
    with zipfile.ZipFile(fmu("two_link", "3")) as good, zipfile.ZipFile(wrong, "w") as bad:
        for name in good.namelist():
            content = good.read(name)
            if name.endswith("_ref.csv"):
                head, row, *rest = content.decode().splitlines()
                cells = row.split(",")
                first, *others = cells[1].split()
                cells[1] = " ".join([str(float(first) + 0.01), *others])
                content = "\n".join([head, ",".join(cells), *rest]).encode()
            bad.writestr(name, content)
    found = check(wrong)
    assert not found.ok
    assert found.checkers["references"] == "failed"
    assert found.reference_max_error == pytest.approx(0.01, rel=1e-6)


def test_check_notices_a_wrong_description(fmu, tmp_path):
    wrong = tmp_path / "wrong.fmu"
    with zipfile.ZipFile(fmu("two_link", "2", "aero")) as good, zipfile.ZipFile(wrong, "w") as bad:
        for name in good.namelist():
            content = good.read(name)
            if name == "modelDescription.xml":
                content = content.replace(b'unit="kg/m3"', b'unit="pints"')
            if "fmi-ls-ref" not in name:
                bad.writestr(name, content)
    found = check(wrong)
    assert any("pints" in error for error in found.errors)
    assert found.reference_max_error is None
    assert found.checkers["references"] == "none in the FMU"


def test_bodies_without_mass_have_no_references():
    """Without the fluid's added inertia they cannot move; the export does without reference results."""
    changes = ["bodies.link1.mass=0", "bodies.link2.mass=0"]
    content = content_of(load("two_link", changes))
    assert not [name for name in content if name.startswith("extra/")]
    assert b"fmi-ls-ref" not in content["documentation/index.html"]


# ---- refusals ----


def test_unknown_platform():
    with pytest.raises(InputError, match=r'expected names out of host, all, x86_64-linux.*got "vax"'):
        toolchain.choose(["x86_64-linux", "vax"])


def test_missing_zig(monkeypatch):
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    with pytest.raises(InputError, match=r"pip install 'linkwind\[fmu\]'"):
        toolchain.command("x86_64-windows", portable=True)
    monkeypatch.setattr(toolchain, "host", lambda: "x86_64-linux")
    assert toolchain.command("x86_64-linux", portable=True)  # by the system's compiler


def test_missing_compiler(monkeypatch):
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    monkeypatch.setattr(toolchain.shutil, "which", lambda name: None)
    monkeypatch.delenv("CC", raising=False)
    with pytest.raises(InputError, match="expected a C compiler"):
        toolchain.command(toolchain.host(), portable=False)


def test_compiler_that_fails(monkeypatch, tmp_path):
    monkeypatch.setenv("CC", "false")
    with pytest.raises(InputError, match="expected the compiler to succeed"):
        export(scenario("two_link"), tmp_path / "x.fmu")
    monkeypatch.setenv("CC", "no-such-compiler")
    with pytest.raises(InputError, match="no-such-compiler cannot be started"):
        export(scenario("two_link"), tmp_path / "x.fmu")
    assert list(tmp_path.iterdir()) == []


def test_place_that_cannot_be_written(monkeypatch, tmp_path):
    monkeypatch.setattr("linkwind.fmi.build.binaries", lambda *args, **keys: {})
    with pytest.raises(InputError, match="cannot be written: No such file"):
        export(scenario("two_link"), tmp_path / "missing" / "x.fmu")


def test_force_model_that_is_not_there():
    with pytest.raises(InputError, match=r'expected one with model plate or field.*got "none"'):
        aero_part(load("two_link", ["aero.model=none"]), native_arrays=True)


@pytest.mark.parametrize("content", [None, b"no zip file"])
def test_check_of_something_else(tmp_path, content):
    file = tmp_path / "x.fmu"
    if content is not None:
        file.write_bytes(content)
    with pytest.raises(InputError, match=r"x\.fmu: expected an FMU"):
        check(file)


# ---- commands ----


def invoke(*arguments: str):
    return CliRunner().invoke(app, ["fmu", *map(str, arguments)], env={"COLUMNS": "200"})


def test_an_export_says_what_is_not_in_it(tmp_path):
    for name, part, told in (
        ("two_link", "dynamics", True),
        ("two_link", "aero", False),
        ("four_bar", "dynamics", False),
    ):
        done = invoke("export", name, "-o", tmp_path / "some.fmu", "--part", part)
        assert done.stdout.startswith("wrote ")
        assert ("The forces of aero are inputs of it" in done.stdout) == told


def test_export_command(tmp_path):
    out = tmp_path / "plate.fmu"
    done = invoke("export", "two_link", "-o", out, "--fmi", "3", "--part", "aero", "--json")
    assert done.exit_code == 0
    summary = json.loads(done.stdout)
    assert summary == {
        "file": str(out), "bytes": out.stat().st_size, "fmi": "3", "platforms": [toolchain.host()],
    }  # fmt: skip


def test_check_command(fmu):
    done = invoke("check", fmu("two_link", "2"), "--json")
    found = json.loads(done.stdout)
    assert done.exit_code == 0
    assert set(found) == {"ok", "errors", "checkers", "reference_max_error"}
    assert (found["ok"], found["reference_max_error"]) == (True, 0.0)
    assert found["checkers"]["ecos"] in ("ok", MISSING.format("ecospy"))


def test_info_command(fmu):
    text = invoke("info", fmu("two_link", "3")).stdout
    for expected in (
        "two_link",
        toolchain.host(),
        "providesAdjointDerivatives",
        "link2.orientation",
        "6 × 6",
        "kg",
    ):
        assert expected in text
    # In one piece, where there is no terminal that could be too narrow.
    assert "Added inertia of link1 at its centre of mass, in the body frame" in text


def test_info_for_programs(fmu):
    found = json.loads(invoke("info", fmu("two_link", "3"), "--json").stdout)
    assert (found["model"], found["fmi"], found["platforms"]) == (
        "two_link", "3.0", [toolchain.host(), "sources"]
    )  # fmt: skip
    assert (found["stop_s"], found["step_s"]) == (1.2, 1e-3)
    assert found["interfaces"]["CoSimulation"]["canGetAndSetFMUState"] is True
    assert "ScheduledExecution" not in found["interfaces"]
    inertia = next(each for each in found["variables"] if each["name"] == "link1.A")
    assert (inertia["shape"], inertia["causality"], inertia["type"]) == ([6, 6], "input", "Float64")


def test_info_of_what_is_no_fmu(tmp_path):
    (tmp_path / "no.fmu").write_bytes(b"PK")
    for path, got in (
        (tmp_path / "no.fmu", "it cannot be read: File is not a zip file"),
        (tmp_path / "absent.fmu", "got no such file"),
        (tmp_path, "got a folder"),
    ):
        error = invoke("info", path, "--json").exception
        assert isinstance(error, InputError)
        assert str(error).startswith(f"{path}: expected an FMU; {got}")
