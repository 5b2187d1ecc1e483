"""Whole runs with an FMU in the place of the aero model, and the commands around it."""

from __future__ import annotations

import hashlib
import zipfile

import pytest
from typer.testing import CliRunner

import linkwind
from linkwind import aero
from linkwind.cli import app
from linkwind.cli.own import load_with
from linkwind.errors import InputError, SimulationError
from linkwind.fmi.export import export
from linkwind.log.reader import open_log
from linkwind.runs.run import run
from linkwind.scenario import from_json, load
from tests.fmi_host.foreign import Foreign, Variable, fmu, vector

SHORT = ["time.end=0.3"]
DRAG = Foreign(
    (*vector("vel", "input"), *vector("force", "output")),
    code="#define OUTPUTS(m) do { for (int i = 0; i < 3; i++) m->v[3 + i] = -0.5 * m->v[i]; } while (0)",
)


def fly(scenario, folder, files=None):
    return run(scenario, folder, lambda step: None, files or {})


@pytest.fixture(scope="module")
def native(tmp_path_factory):
    """Hash of the native plate's trajectory, and the plate as FMUs."""
    folder = tmp_path_factory.mktemp("native")
    scenario = load("two_link", [*SHORT, "bus.transport=inprocess"])
    files = {
        fmi: export(scenario, folder / f"plate{fmi}.fmu", fmi=fmi, part="aero").file for fmi in ("2", "3")
    }
    return fly(scenario, folder / "run").result.final_state_sha256, files


@pytest.mark.parametrize("interface", ["cs", "me"])
@pytest.mark.parametrize("fmi", ["2", "3"])
def test_the_plate_as_fmu_gives_the_native_trajectory(tmp_path, native, fmi, interface):
    """Over zenoh, with a worker: bit for bit."""
    expected, files = native
    overrides = [*SHORT, f"providers.aero.fmu.interface={interface}"]
    scenario, named, tables = load_with("two_link", overrides, [str(files[fmi])])
    assert "link1.A[1,1] … link1.A[6,6]" in tables[0]
    outcome = fly(scenario, tmp_path / "run", named)
    assert outcome.result.final_state_sha256 == expected
    logged = from_json(open_log(outcome.log).scenario_json).providers[0].fmu
    assert logged.sha256 == hashlib.sha256(files[fmi].read_bytes()).hexdigest()
    assert logged.variables["link2.v[1]"].quantity == "link2.velocity.x"
    assert str(files[fmi].parent) not in open_log(outcome.log).scenario_json


def test_a_program_puts_it_in_place(tmp_path, native):
    expected, files = native
    scenario = load("two_link", [*SHORT, "bus.transport=inprocess"])
    outcome = linkwind.run(scenario, tmp_path / "run", models={"aero": str(files["3"])}, report=False)
    assert outcome.result.final_state_sha256 == expected
    assert linkwind.verify(outcome.log, models={"aero": files["3"]}).identical


def test_strips_and_their_table_as_fmu_give_the_native_trajectory(tmp_path):
    """In space, where strips differ: the numbers of the table go with the FMU."""
    rows = "[[0,0,0.05,0],[10,0.8,0.1,0],[45,1,1,-0.25],[90,0,1.9,-0.475]]"
    settings = ["aero.plate.strips=8", "aero.plate.coefficients=table", f"aero.plate.table={rows}"]
    overrides = ["time.end=0.1", "bus.transport=inprocess"]
    scenario = load("flapper", [*overrides, *settings])
    expected = fly(scenario, tmp_path / "native").result.final_state_sha256
    assert fly(load("flapper", overrides), tmp_path / "without").result.final_state_sha256 != expected
    file = export(scenario, tmp_path / "wings.fmu", fmi="3", part="aero").file
    with zipfile.ZipFile(file) as archive:
        page = archive.read("documentation/index.html").decode()
    assert "8 equal strips" in page
    assert "<td>45.0</td><td>1.0</td><td>1.0</td><td>-0.25</td>" in page
    scenario, named, _ = load_with("flapper", overrides, [str(file)])
    assert fly(scenario, tmp_path / "fmu", named).result.final_state_sha256 == expected


def test_a_stiff_drag_flies_with_the_derivatives_of_the_fmu(tmp_path):
    """Drag times step over mass is 50: without derivatives the coupling is unstable at any order."""
    code = DRAG.code.replace("-0.5", "-1e5")
    attributes = f'{DRAG.attributes} canGetAndSetFMUstate="true" providesDirectionalDerivative="true"'
    file = fmu(tmp_path, Foreign(DRAG.variables, code=code, attributes=attributes), "stiff")
    overrides = ["time.end=0.1", "bus.transport=inprocess"]
    scenario, named, _ = load_with("two_link", overrides, [str(file)])
    assert fly(scenario, tmp_path / "with", named).result.force_max_N < 1e4
    scenario, named, _ = load_with(
        "two_link", [*overrides, "providers.aero.fmu.derivatives=false"], [str(file)]
    )
    with pytest.raises(SimulationError, match="overflow"):
        fly(scenario, tmp_path / "without", named)


def test_a_crash_ends_the_run_with_one_error(tmp_path):
    code = DRAG.code + "\n#define STEP(m, t, h) (t > 0.01 ? raise(SIGSEGV) : 0)"
    file = fmu(tmp_path, Foreign(DRAG.variables, code=code), "crash")
    arguments = ["run", "two_link", "--force-fmu", str(file), "--out", str(tmp_path / "run"), "--json"]
    result = CliRunner().invoke(app, arguments)
    text = str(result.exception)
    assert "crash.fmu: step 12 (t = 0.012 s): its process died in fmi2DoStep: signal SIGSEGV" in text
    assert open_log(tmp_path / "run/log.mcap").steps == 11


def test_run_prints_the_mapping_and_names_the_file(tmp_path):
    file = fmu(tmp_path, DRAG)
    arguments = ["run", "two_link", "--force-fmu", f"aero={file}", "--set", "time.end=0.01"]
    arguments += ["--set", "bus.transport=inprocess", "--out", str(tmp_path / "run")]
    result = CliRunner().invoke(app, arguments)
    assert result.exit_code == 0, result.output
    assert "vel.x … vel.z" in result.output
    assert "force x y z of each body" in result.output


def test_map_prints_the_table_and_writes_it(tmp_path):
    file, table = fmu(tmp_path, DRAG), tmp_path / "table.toml"
    result = CliRunner().invoke(app, ["fmu", "map", str(file), "two_link", "-o", str(table)])
    assert result.exit_code == 0, result.output
    assert "→ in   vel.x … vel.z" in result.output
    assert '"vel.y" = "velocity.y"' in table.read_text()


def test_map_of_what_is_not_understood_still_prints(tmp_path):
    knobs = tuple(Variable(f"knob{i}", "input") for i in range(9))
    variables = (Variable("knob", "input"), *knobs, Variable("Fx", "output"))
    file = fmu(tmp_path, Foreign(variables, code="#define OUTPUTS(m)"))
    result = CliRunner().invoke(app, ["fmu", "map", str(file), "two_link"])
    assert "NOT MAPPED" in result.output
    assert isinstance(result.exception, InputError)
    assert "input knob" in str(result.exception)
    assert str(result.exception).splitlines()[-1].endswith(": and 4 more")


def test_the_fmu_of_a_mechanism_is_no_force_model(tmp_path):
    file = tmp_path / "two_link.fmu"
    assert CliRunner().invoke(app, ["fmu", "export", "two_link", "-o", str(file)]).exit_code == 0
    with pytest.raises(InputError, match=r"link1\.F\[1\].*the FMU of a mechanism\. .*--part aero\.$"):
        load_with("two_link", [], [str(file)])


def test_files_and_scenarios_that_do_not_fit(tmp_path):
    file = fmu(tmp_path, DRAG)
    with pytest.raises(InputError, match=r"expected the FMU with SHA-256 0{64}; got [0-9a-f]{64}"):
        load_with("two_link", [f'providers.aero.fmu.sha256="{"0" * 64}"'], [str(file)])
    result = CliRunner().invoke(app, ["run", "two_link", "--set", "providers.aero.model=fmu"])
    assert "Add --force-fmu aero=FILE" in str(result.exception)
    with pytest.raises(InputError, match=r"--force-fmu areo=.*expected a provider of .*, aero; got areo"):
        load_with("two_link", [], [f"areo={file}"])
    scenario = load("two_link")
    with pytest.raises(
        InputError, match=r'aero\.model: expected "fmu" for .*--set providers\.aero\.model=fmu'
    ):
        aero.build(scenario, scenario.providers[0], file)
