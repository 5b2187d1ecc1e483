"""What `import linkwind` offers: the block in the README runs; nothing heavy is loaded before it is used."""

from __future__ import annotations

import ast
import csv
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from importlib import import_module
from pathlib import Path

import pytest

import linkwind
from linkwind.log.export import export_csv
from linkwind.runs.labels import labels_of
from linkwind.scenario import builtin_text

README = Path(__file__).parents[1] / "README.md"


def test_the_block_of_the_readme_runs(tmp_path: Path) -> None:
    text = README.read_text(encoding="utf-8")
    block = text.partition("## From Python\n\n")[2].partition("\n`bus.transport")[0]
    code = "\n".join(line.removeprefix("    ") for line in block.splitlines())
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, cwd=tmp_path, timeout=120, check=False
    )
    assert done.returncode == 0, done.stderr
    lines = done.stdout.splitlines()
    assert [line.split()[0] for line in lines] == ["1.0", "2.0", "4.0"]
    assert len(list(tmp_path.glob("runs/two_link-*/report.html"))) == 3


def test_names_are_those_that_are_said() -> None:
    assert all(callable(getattr(linkwind, name)) for name in linkwind.__all__)
    assert set(linkwind.__all__) <= set(dir(linkwind))
    with pytest.raises(AttributeError, match="no attribute 'fly'"):
        _ = linkwind.fly
    with pytest.raises(linkwind.LinkwindError, match="two_lnk"):
        linkwind.load("two_lnk")


def test_editors_and_checkers_know_the_same_names() -> None:
    stub = ast.parse(Path(linkwind.__file__).with_suffix(".pyi").read_text(encoding="utf-8"))
    imports = [node for node in stub.body if isinstance(node, ast.ImportFrom)]
    places = {name.asname or name.name: (node.module, name.name) for node in imports for name in node.names}
    assert sorted(places) == linkwind.__all__
    for name, (module, attribute) in places.items():
        assert getattr(linkwind, name) is getattr(import_module(str(module)), attribute)


def test_a_run_by_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    file = tmp_path / "short.toml"
    text = builtin_text("two_link").replace("end = 1.2", "end = 0.01")
    file.write_text(text + '[bus]\ntransport = "inprocess"\n', encoding="utf-8")
    by_name, loaded = (linkwind.run(each, report=False) for each in ("short.toml", linkwind.load(file)))
    assert by_name.result.final_state_sha256 == loaded.result.final_state_sha256


def test_a_run_and_what_programs_do_with_its_log(tmp_path: Path) -> None:
    scenario = linkwind.load("two_link", ["bus.transport=inprocess", "time.end=0.05"])
    seen: list[int] = []
    whole = linkwind.run(scenario, tmp_path / "whole", report=False, progress=seen.append)
    assert (whole.report, whole.as_json()["report"], seen[-1]) == (None, None, 50)
    assert not (tmp_path / "whole" / "report.html").exists()
    assert linkwind.verify(tmp_path / "whole").identical
    other = linkwind.resume(
        linkwind.open_log(whole.log),
        tmp_path / "other",
        from_step=20,
        overrides=["environment.gravity=[0, 0, 0]"],
        report=False,
    )
    assert linkwind.verify(str(other.log)).identical
    falls = [linkwind.table(log)["link1.linear.y [m/s]"] for log in (whole.log, other.log)]
    assert falls[0][:21].tolist() == falls[1][:21].tolist()
    assert falls[0][50] < falls[1][50]
    done = linkwind.export_fmu(scenario, str(tmp_path / "two_link.fmu"))
    assert done.file.stat().st_size == done.bytes > 0


def test_an_export_takes_what_load_takes(tmp_path: Path) -> None:
    files = [
        linkwind.export_fmu(scenario, tmp_path / f"{index}.fmu").file.read_bytes()
        for index, scenario in enumerate(["two_link", linkwind.load("two_link")])
    ]
    assert files[0] == files[1]


def test_a_table_has_the_columns_that_are_exported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    scenario = linkwind.load("two_link", ["bus.transport=inprocess", "time.end=0.01"])
    log = linkwind.open_log(linkwind.run(scenario, tmp_path / "run", report=False).log)
    monkeypatch.setattr("linkwind.log.export.BLOCK", 4)  # more than one
    for path in export_csv(log, tmp_path / "csv", labels_of(log)):
        columns = linkwind.table(log, path.stem)
        with path.open(encoding="utf-8") as file:
            head, *rows = csv.reader(file)
        assert list(columns) == head
        for name, cells in zip(head, zip(*rows, strict=True), strict=True):
            assert [repr(value) for value in columns[name].tolist()] == list(cells), name
    path = log.trajectory()
    assert linkwind.table(log)["link2.position.y [m]"].tolist() == path.position[:, 1, 1].tolist()
    assert linkwind.table(log)["hinge.q [rad]"].tolist() == path.q[:, 3].tolist()
    with pytest.raises(linkwind.LinkwindError, match="trajectory, steps, wrench_aero; got wrench_areo"):
        linkwind.table(log, "wrench_areo")


def test_runs_in_threads_beside_each_other(tmp_path: Path) -> None:
    scenario = linkwind.load("two_link", ["bus.transport=inprocess", "time.end=0.05"])
    with ThreadPoolExecutor(2) as pool:
        outcomes = list(pool.map(lambda name: linkwind.run(scenario, tmp_path / name), "abcd"))
    assert len({outcome.result.final_state_sha256 for outcome in outcomes}) == 1


def test_importing_loads_nothing_heavy() -> None:
    code = "import linkwind, sys; assert not {'numpy', 'zenoh', 'pydantic', 'google'} & set(sys.modules)"
    subprocess.run([sys.executable, "-c", code], check=True)
