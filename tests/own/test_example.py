"""The kite of the README: what is printed there is the file, runs as is said, and keeps to the protocol."""

from __future__ import annotations

import json
import math
import shlex
import subprocess
import sys
from pathlib import Path

import linkwind
from linkwind.runs.conformance import CHECKS
from linkwind.scenario import from_json

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")
GUIDE = (ROOT / "services" / "guide" / "forces.md").read_text(encoding="utf-8")
SECTION = README.partition("## A force model of your own\n\n")[2].partition("\n## ")[0]
KITE = ROOT / "schemas" / "examples" / "kite.py"


def command(line: str, *more: str) -> list[str]:
    return [sys.executable, "-m", *shlex.split(line), *more]


def do(arguments: list[str]) -> str:
    done = subprocess.run(arguments, capture_output=True, text=True, cwd=ROOT, timeout=120, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_the_readme_shows_the_file() -> None:
    shown = SECTION.partition("\nThis is [kite.py]")[0]
    text = "".join(line.removeprefix("    ") + "\n" for line in shown.splitlines())
    assert text == KITE.read_text(encoding="utf-8")


def test_the_kite_climbs_to_where_line_weight_and_wind_agree(tmp_path: Path) -> None:
    (line,) = (line for line in SECTION.splitlines() if line.startswith("    linkwind run"))
    done = json.loads(do(command(line.partition("#")[0], "--out", str(tmp_path / "kite"), "--json")))
    log = linkwind.open_log(done["log"])
    assert linkwind.verify(log, models={"aero": f"{KITE}:Kite"}).identical
    end = {name: column[-1] for name, column in linkwind.table(log).items()}
    assert math.hypot(end["sail.linear.x [m/s]"], end["sail.linear.y [m/s]"]) < 0.01
    # Statics: twice the dynamic pressure times the sine of the angle, along the normal, weight, and the line.
    angle = -2.0 * math.atan2(end["sail.orientation.z"], end["sail.orientation.w"])
    press = 1.225 * 8.0**2 * math.sin(angle)
    pull = press * math.sin(angle), press * math.cos(angle) - 0.4 * 9.81
    assert math.isclose(math.hypot(*pull), end["line.force_effort [N]"], rel_tol=0.01)
    s, c = math.sin(angle), math.cos(angle)
    knot = end["sail.position.x [m]"] - 0.23 * c - 0.4 * s, end["sail.position.y [m]"] + 0.23 * s - 0.4 * c
    line_angle = math.atan2(knot[1], knot[0])
    assert math.isclose(line_angle, math.atan2(pull[1], pull[0]), abs_tol=0.005)


def test_the_function_runs(tmp_path: Path) -> None:
    code = GUIDE.partition("where you stand:\n\n")[2].partition("\n`motion`")[0]
    text = "".join(line.removeprefix("    ") + "\n" for line in code.splitlines())
    (tmp_path / "mine.py").write_text(text)
    done = subprocess.run(
        [sys.executable, "mine.py"], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    (folder,) = (tmp_path / "runs").iterdir()
    log = linkwind.open_log(folder / "log.mcap")
    assert from_json(log.scenario_json).providers[0].python.source == "mine.py:drag"
    wrench, path = linkwind.table(log, "wrench_aero"), linkwind.table(log)
    assert wrench["link1.force.x [N]"][0] == -0.5 * path["link1.linear.x [m/s]"][0]


def test_the_kite_keeps_to_the_protocol(tmp_path: Path) -> None:
    own = command("linkwind aero --connect {endpoint} --model", f"{KITE}:Kite")
    test = command("linkwind conformance schemas/examples/kite.toml --json --output", str(tmp_path / "out"))
    checks = json.loads(do([*test, "--", *own]))["checks"]
    assert {check["check"]: check["ok"] for check in checks} == dict.fromkeys(CHECKS, True)
