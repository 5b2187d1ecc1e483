"""The doctor: what is well, what is not, and what to do about it."""

from __future__ import annotations

import json
import socket
import subprocess
import sys
from pathlib import Path

import pytest
import typer

from linkwind import doctor
from linkwind.cli.doctor import doctor as command
from linkwind.credentials.authority import Role, issue
from linkwind.doctor import FAIL, OK, WARN, Finding, disk, flight, machine, network, tools


def test_command_checks_everything_here(tmp_path: Path) -> None:
    program = [sys.executable, "-m", "linkwind", "doctor", "--json", "--out", str(tmp_path)]
    done = subprocess.run(program, capture_output=True, text=True, check=False, timeout=120.0)
    said = json.loads(done.stdout)
    assert done.returncode == 0, said
    assert said["ok"] is True
    rows = {row["check"]: row for row in said["rows"]}
    assert set(rows) == {
        "Python", "packages", "cores", "core", "zenoh", "round trip", "ports", "multicast", "TLS", "disk",
        "Docker", "FMU export", "FMU of Windows", "qemu",
    }  # fmt: skip
    assert rows["core"]["status"] == OK, "the bits of two_link have changed: doctor.flight.KNOWN is to follow"
    assert rows["zenoh"]["status"] == OK
    assert all(bool(row["change"]) == (row["status"] != OK) for row in said["rows"])
    assert not list(tmp_path.iterdir())  # and leaves nothing behind


def test_failure_is_the_exit_code(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(flight, "core", lambda: iter(()))
    monkeypatch.setattr(flight, "zenoh", lambda: iter(()))
    with pytest.raises(typer.Exit) as ended:
        command(Path("/proc/runs"))
    assert ended.value.exit_code == 1
    said = capsys.readouterr().out
    assert "fail  disk" in said
    assert "→ make room, or choose another --out" in said


def only(findings: object) -> Finding:
    (finding,) = list(findings)  # type: ignore[call-overload]
    return finding


def test_other_bits_are_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(flight, "KNOWN", "0" * 64)
    found = only(flight.core())
    assert found.status == WARN
    assert "expected 000000000000…" in found.found


def test_what_a_check_dies_of_is_a_finding() -> None:
    def broken() -> object:
        raise OSError("liblinkwind.so: cannot open")

    found = only(doctor.guarded("core", broken))  # type: ignore[arg-type]
    assert (found.status, found.found) == (FAIL, "OSError: liblinkwind.so: cannot open")


def test_port_that_is_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        monkeypatch.setattr(network, "PORT", taken.getsockname()[1])
        found = only(network.ports())
    assert found.status == WARN
    assert "use another --listen" in found.change


def test_machine_that_cannot_be_reached_and_one_that_can() -> None:
    with socket.create_server(("127.0.0.1", 0)) as listening:
        endpoint = f"tcp/127.0.0.1:{listening.getsockname()[1]}"
        # Nobody there takes part in a TLS hand-shake, so nobody there demands one.
        listening.settimeout(5.0)
        assert only(network.reach("tcp/127.0.0.1:1", None)).status == FAIL
        assert only(network.reach("tcp/nonsense", None)).status == FAIL
    assert only(network.reach(endpoint, None)).status == FAIL  # closed by now


def test_certificates_with_their_days(tmp_path: Path) -> None:
    issue(tmp_path, [Role("aero")], 397)
    issue(tmp_path, [Role("old")], 0)
    issue(tmp_path, [Role("soon")], 10)
    found = {
        finding.found.split('"')[1] if '"' in finding.found else "old": finding
        for finding in network.certificates(tmp_path)
    }
    assert {name: finding.status for name, finding in found.items()} == {
        "aero": OK,
        "old": FAIL,
        "soon": WARN,
    }
    assert "397 days left" in found["aero"].found
    assert only(network.certificates(tmp_path / "aero")).status == OK


def test_full_and_slow_disks(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert [finding.status for finding in disk.check(tmp_path / "not" / "there")] == [OK, OK]
    monkeypatch.setattr(disk, "SLOWEST", 1e9)
    monkeypatch.setattr(disk, "LITTLE", 1e18)
    assert [finding.status for finding in disk.check(tmp_path)] == [WARN, WARN]
    monkeypatch.setattr(disk, "TOO_LITTLE", 1e18)
    assert only(disk.check(tmp_path)).status == FAIL


def test_missing_programs_are_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("shutil.which", lambda name: None)
    monkeypatch.setattr(tools.wine, "needed", lambda: "wine64 (apt-get install wine64)")
    monkeypatch.setattr(tools.toolchain, "has_zig", lambda: False)
    found = [tools.docker(), *tools.fmu_platforms()]
    assert {finding.status for finding in found} == {WARN}
    assert all("install" in finding.change for finding in found)


def test_one_core_and_old_python(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("os.sched_getaffinity", lambda pid: {0})
    monkeypatch.setattr(machine, "OLDEST", (9, 9))
    assert [finding.status for finding in machine.check()] == [FAIL, OK, WARN]
