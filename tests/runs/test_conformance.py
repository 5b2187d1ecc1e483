"""The test of strangers' providers: linkwind's own and the example pass, each way to be wrong is found."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from linkwind.errors import InputError
from linkwind.runs.conformance import CHECKS, conformance
from linkwind.scenario import load

EXAMPLE = Path(__file__).parents[2] / "schemas" / "examples" / "provider.py"
SCHEMA = EXAMPLE.parents[1] / "linkwind" / "v1" / "linkwind.binpb"
OWN = [sys.executable, "-m", "linkwind", "aero", "--connect", "{endpoint}", "--name", "{name}"]

# What is changed in the example, and the checks that must find it, alone.
REMEMBERS = "found.torque.extend([0.0, 0.0, COUNT.append(0) or len(COUNT)])"
EVERYTHING = ["iterations", "goes on", "comes back"]
MUTANTS = {
    "forgets its answer": ("if asked == at and answer:", "if False:", ["repeated motion"]),
    "answers what is old": ('return b""', "return answer", ["older motion"]),
    "remembers iterations": ("found.torque.extend([0.0, 0.0, 0.0])", REMEMBERS, EVERYTHING),
    "saves too late": (
        "step % welcome.checkpoint_every == 0",
        "step % welcome.checkpoint_every == 1",
        ["checkpoints", "goes on", "comes back"],
    ),
    "miscounts": ('"checkpoints": saved}', '"checkpoints": saved + 1}', ["goodbye", "goes on", "comes back"]),
    "no number": ("-DRAG * hypot(*v) * component", "float('nan') * component", ["answers"]),
    "does not miss a motion": ("if asked == (at[0] + 1, 0):", "if asked[1] == 0:", ["lost message"]),
    "does not catch up": ('b"".join(again)', 'b""', ["comes back"]),
    "does not fetch the rest": ("while len(whole) < first.size:", "while False:", ["goes on"]),
    "stays": ("lambda _: inbox.put(None))", "lambda _: None)", ["end of the run"]),
    "says nothing": ("request(welcome.run, ready=ready)", "time.sleep(1000)", ["hand-shake"]),
}


def test_our_own_provider_passes(tmp_path: Path) -> None:
    results = conformance(load("two_link"), "aero", OWN, tmp_path / "out")
    assert {result.check: result.ok for result in results} == dict.fromkeys(CHECKS, True), results


def test_the_example_passes(tmp_path: Path) -> None:
    """From the command line, where it stands for a provider in any language."""
    linkwind = [sys.executable, "-m", "linkwind", "conformance", "two_link", "--json"]
    command = [*linkwind, "--", sys.executable, str(EXAMPLE), "{endpoint}"]
    before = tmp_path / "conformance.log"
    before.write_text("of the test before")
    done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path, timeout=120, check=False)
    assert done.returncode == 0, done.stderr
    assert "of the test before" not in before.read_text()
    checks = json.loads(done.stdout)["checks"]
    assert [check["check"] for check in checks] == list(CHECKS)
    assert all(check["ok"] for check in checks), checks


@pytest.mark.parametrize("name", MUTANTS)
def test_what_is_wrong_is_found(name: str, tmp_path: Path) -> None:
    old, new, expected = MUTANTS[name]
    text = EXAMPLE.read_text()
    assert old in text
    (tmp_path / "wrong.py").write_text("COUNT = []\n" + text.replace(old, new))
    command = [sys.executable, str(tmp_path / "wrong.py"), "{endpoint}", "--schema", str(SCHEMA)]
    scenario = load("two_link", ["coupling.timeout=3.0", "bus.start_timeout=5.0"])
    results = {result.check: result for result in conformance(scenario, "aero", command, tmp_path / "out")}
    wrong = [check for check, result in results.items() if result.ok is False]
    assert wrong[:1] == expected[:1], results
    assert set(wrong) <= set(expected), results
    assert all(results[check].saw for check in wrong)


def test_an_unknown_provider_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="expected one of its providers, aero; got other"):
        conformance(load("two_link"), "other", OWN, tmp_path / "out")


def test_a_program_that_is_not_there_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no-such-program: cannot be started: No such file"):
        conformance(load("two_link"), "aero", ["no-such-program", "{endpoint}"], tmp_path / "out")


def test_a_program_that_ends_is_told(tmp_path: Path) -> None:
    command = [sys.executable, "-c", "exit(7)", "{endpoint}"]
    results = conformance(load("two_link"), "aero", command, tmp_path / "out")
    assert results[0].saw == "its process ended with status 7"
    assert [result.ok for result in results] == [False, *[None] * (len(CHECKS) - 1)]


def test_the_last_line_that_it_printed_is_told(tmp_path: Path) -> None:
    """Of this process: what is in the file before is of others."""
    command = [sys.executable, "-c", "print('begun'); raise ValueError('no table\\n')", "{endpoint}"]
    (tmp_path / "out").write_text("of the life before\n")
    results = conformance(load("two_link"), "aero", command, tmp_path / "out")
    told = "its process ended with status 1; the last that it printed: ValueError: no table"
    assert results[0].saw == told


def test_a_command_without_the_endpoint_is_refused_at_once(tmp_path: Path) -> None:
    linkwind = [sys.executable, "-m", "linkwind", "conformance", "two_link", "--", "python", "my own.py"]
    done = subprocess.run(linkwind, capture_output=True, text=True, cwd=tmp_path, timeout=60, check=False)
    assert done.returncode == 3
    assert "expected {endpoint} in it" in done.stderr
    assert "linkwind conformance SCENARIO -- python 'my own.py' {endpoint}" in done.stderr
    assert "not reached" not in done.stdout
