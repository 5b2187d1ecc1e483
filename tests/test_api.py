"""What `import linkwind` offers: the block in the README runs; nothing heavy is loaded before it is used."""

from __future__ import annotations

import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

import linkwind

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


def test_runs_in_threads_beside_each_other(tmp_path: Path) -> None:
    scenario = linkwind.load("two_link", ["bus.transport=inprocess", "time.end=0.05"])
    with ThreadPoolExecutor(2) as pool:
        outcomes = list(pool.map(lambda name: linkwind.run(scenario, tmp_path / name), "abcd"))
    assert len({outcome.result.final_state_sha256 for outcome in outcomes}) == 1


def test_importing_loads_nothing_heavy() -> None:
    code = "import linkwind, sys; assert not {'numpy', 'zenoh', 'pydantic', 'google'} & set(sys.modules)"
    subprocess.run([sys.executable, "-c", code], check=True)
