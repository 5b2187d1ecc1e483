"""The secure compose file, run: the same bits as outside, and nobody in who has no certificate."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from linkwind.log.reader import open_log
from tests.docker.compose import NOBODY, REASON, Project, digest_outside, docker

if REASON:
    pytest.skip(REASON, allow_module_level=True)


def test_run_over_tls_gives_the_same_bits_as_outside(secure: Project, tmp_path: Path) -> None:
    status, output = secure.up()
    assert status == 0, output
    log = open_log(secure.folder() / "log.mcap")
    assert log.complete
    assert log.final_state_sha256 == digest_outside(tmp_path / "outside", "two_link")
    assert b"PRIVATE KEY" not in (secure.folder() / "log.mcap").read_bytes()
    # A second start finds the certificates of the first.
    status, output = secure.up(END="0.05")
    assert status == 0, output


def test_keys_are_where_they_are_needed_and_nowhere_else(secure: Project, image: str) -> None:
    os.chown(secure.folders["runs"], NOBODY, NOBODY)
    secure.start("up", "--exit-code-from", "dynamics", END="1000")
    secure.await_steps()

    def keys(container: str) -> str:
        found = ("find", "/certs", "-name", "*.pem", "-exec", "stat", "-c", "%n %U %u %a", "{}", "+")
        return docker("exec", "-u", "0", container, *found)

    assert f"/certs/key.pem UNKNOWN {NOBODY} 600" in keys(secure.container("dynamics"))
    assert "/certs/key.pem linkwind 1000 600" in keys(secure.container("aero"))
    assert "ca/key.pem" not in keys(secure.container("certs"))
    assert docker("run", "--rm", image, "find", "/opt/linkwind", "/work", "/tmp", "-name", "key.pem") == ""


def test_peers_without_a_certificate_are_told_so(secure: Project, image: str, tmp_path: Path) -> None:
    up = secure.start("up", "--exit-code-from", "dynamics", END="1000")
    secure.await_steps()
    network, intruder = f"{secure.name}_bus", ["run", "--rm", "--network"]
    plain = ["linkwind", "aero", "--connect", "tcp/dynamics:7447"]
    own = "linkwind certs /tmp/c >/tmp/o; linkwind aero --tls /tmp/c --connect tls/dynamics:7447"
    for command, error in (
        (plain, "there is TLS, and this side has none"),
        (["sh", "-c", own], "the certificate there is not to be trusted"),
    ):
        done = docker(*intruder, network, image, "sh", "-c", '"$@" 2>&1; echo status $?', "-", *command)
        assert error in done
        assert done.endswith("status 4")
    assert up.poll() is None
