"""The library gives the same bits whoever compiles it: zig's against the installed one."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from tests.fmu.c_model import build_hook

pytest.importorskip("ziglang")

ROOT = Path(__file__).parents[2]
RUN = """
import sys
from linkwind.native import library
_, file, *rest = sys.argv
if file:
    library._path = lambda: file
from linkwind.cli import main
sys.argv = ["linkwind", "run", "--json", *rest]
main()
"""


@pytest.fixture(scope="module")
def by_zig(tmp_path_factory: pytest.TempPathFactory) -> str:
    target = tmp_path_factory.mktemp("zig") / "liblinkwind.so"
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("CC", f"{sys.executable} -m ziglang cc -mcpu=baseline")
        build_hook().compile_library(ROOT, target)
    return str(target)


@pytest.mark.parametrize(
    ("scenario", "end", "integrator"),
    [
        ("two_link", "0.3", "rk4"),
        ("two_link_gust", "0.3", "rk4"),
        ("two_link_gust", "0.1", "radau5"),
        ("two_link_flow", "0.01", "rk4"),
    ],
)
def test_a_run_with_the_library_of_another_compiler_has_the_same_bits(
    by_zig, scenario, end, integrator, tmp_path
):
    """What zig's runtime has of libm, and pulls in on some occasions, differs in the last bit."""
    digests = []
    for name, library in (("own", ""), ("zig", by_zig)):
        settings = [
            "--set",
            f"time.end={end}",
            "--set",
            f"dynamics.integrator={integrator}",
            "--set",
            "bus.transport=inprocess",
            "--out",
            str(tmp_path / name),
        ]
        command = [sys.executable, "-c", RUN, library, scenario, *settings]
        done = subprocess.run(command, capture_output=True, text=True, check=True)
        digests.append(json.loads(done.stdout)["final_state_sha256"])
    assert digests[0] == digests[1]
