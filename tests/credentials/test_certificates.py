"""Certificates: what is in them, who may read their keys, and what is said of wrong ones."""

from __future__ import annotations

import datetime
import shutil
import ssl
import subprocess
import sys
from pathlib import Path

import pytest

from linkwind.credentials.authority import DEFAULT_ROLES, Role, issue, role
from linkwind.credentials.checks import load_identity
from linkwind.errors import CertificateError


@pytest.fixture
def certs(tmp_path: Path) -> Path:
    issue(tmp_path / "certs", DEFAULT_ROLES, 30)
    return tmp_path / "certs"


def decoded(path: Path) -> dict[str, object]:
    """Return a certificate as OpenSSL reads it."""
    return ssl._ssl._test_decode_cert(str(path))  # type: ignore[attr-defined]


def test_each_role_has_what_its_machine_needs_and_no_more(certs: Path) -> None:
    assert sorted(path.name for path in certs.iterdir()) == ["aero", "ca", "dynamics", "observer", "operator"]
    for name in ("aero", "dynamics", "observer", "operator"):
        assert sorted(path.name for path in (certs / name).iterdir()) == [
            "ca.pem", "certificate.pem", "key.pem"
        ]  # fmt: skip
        assert (certs / name / "ca.pem").read_bytes() == (certs / "ca" / "certificate.pem").read_bytes()
        assert load_identity(certs / name, name) == load_identity(certs, name)


def test_keys_are_for_their_owner_alone(certs: Path) -> None:
    keys = sorted(certs.glob("*/key.pem"))
    assert len(keys) == 5
    assert {key.stat().st_mode & 0o777 for key in keys} == {0o600}


def test_names_and_lifetimes_are_those_asked_for(certs: Path) -> None:
    dynamics, aero = (decoded(certs / name / "certificate.pem") for name in ("dynamics", "aero"))
    assert dynamics["subject"] == ((("commonName", "dynamics"),),)
    assert dynamics["subjectAltName"] == (
        ("DNS", "localhost"), ("IP Address", "127.0.0.1"), ("IP Address", "0:0:0:0:0:0:0:1")
    )  # fmt: skip
    assert "subjectAltName" not in aero  # nobody connects to it
    begin, end = (ssl.cert_time_to_seconds(str(aero[key])) for key in ("notBefore", "notAfter"))
    now = datetime.datetime.now().timestamp()
    assert now - 3700 < begin < now - 3500
    assert abs(end - now - 30 * 86400) < 100


def test_openssl_finds_the_chain_good(certs: Path) -> None:
    if shutil.which("openssl") is None:
        pytest.skip("needs the openssl command")
    for name, purpose in (("dynamics", "sslserver"), ("dynamics", "sslclient"), ("aero", "sslclient")):
        command = ["openssl", "verify", "-x509_strict", "-purpose", purpose, "-CAfile", "ca/certificate.pem"]
        done = subprocess.run(
            [*command, f"{name}/certificate.pem"], cwd=certs, capture_output=True, text=True, check=False
        )
        assert done.returncode == 0, done.stdout + done.stderr
    command = ["openssl", "verify", "-purpose", "sslserver", "-CAfile", "ca/certificate.pem"]
    assert subprocess.run([*command, "aero/certificate.pem"], cwd=certs, capture_output=True).returncode != 0


def test_nothing_is_written_over_and_more_roles_come_from_the_same_authority(certs: Path) -> None:
    before = {path: path.read_bytes() for path in certs.glob("*/*")}
    with pytest.raises(CertificateError, match="aero: expected a role without a certificate"):
        issue(certs, [Role("tail"), Role("aero")], 30)
    assert not (certs / "tail").exists()
    issue(certs, [Role("tail")], 30)
    assert load_identity(certs, "tail").role == "tail"
    assert {path: path.read_bytes() for path in before} == before
    assert (certs / "tail" / "ca.pem").read_bytes() == (certs / "aero" / "ca.pem").read_bytes()


@pytest.mark.parametrize(
    ("text", "error"),
    [
        ("", "expected NAME or NAME=HOST"),
        ("../x", "expected NAME or NAME=HOST"),
        ("ca", "expected NAME or NAME=HOST"),
        ("dynamics", "expected the names or addresses that others reach it at"),
        ("dynamics=a b", 'expected names or addresses of machines; got "a b"'),
    ],
)
def test_roles_that_are_none(text: str, error: str) -> None:
    with pytest.raises(CertificateError, match=error):
        role(text)


def test_roles_with_hosts() -> None:
    assert role("dynamics=10.0.0.2,sim.example") == Role("dynamics", ("10.0.0.2", "sim.example"))
    assert role("aero") == Role("aero")


def of_another_role(certs: Path) -> str:
    shutil.rmtree(certs / "aero")
    (certs / "observer").rename(certs / "aero")
    return 'expected the certificate of "aero"; got that of "observer"'


def of_another_authority(certs: Path) -> str:
    issue(certs / "other", [Role("aero")], 30)
    (certs / "other" / "aero" / "ca.pem").replace(certs / "aero" / "ca.pem")
    return "issued by the ca.pem beside it; got one of another authority"


def with_another_key(certs: Path) -> str:
    (certs / "observer" / "key.pem").replace(certs / "aero" / "key.pem")
    return "expected the key of the certificate beside it"


def with_a_key_for_all(certs: Path) -> str:
    (certs / "aero" / "key.pem").chmod(0o640)
    return r"expected a key that only its owner may read; got mode 0640. Use: chmod 600"


def without_a_key(certs: Path) -> str:
    (certs / "aero" / "key.pem").unlink()
    return "key.pem: cannot be read: No such file or directory. Make certificates with: linkwind certs DIR"


def with_a_broken_key(certs: Path) -> str:
    (certs / "aero" / "key.pem").write_text("SECRET")
    return r"key.pem: expected a private key \(PEM\)"


def expired(certs: Path) -> str:
    shutil.rmtree(certs / "aero")
    issue(certs, [Role("aero")], 0)
    return "expected one that is valid now"


@pytest.mark.parametrize(
    "spoil",
    [
        of_another_role, of_another_authority, with_another_key, with_a_key_for_all, without_a_key,
        with_a_broken_key, expired,
    ],
)  # fmt: skip
def test_wrong_certificates_are_refused_with_what_is_wrong(certs: Path, spoil) -> None:
    error = spoil(certs)
    with pytest.raises(CertificateError, match=error) as raised:
        load_identity(certs, "aero")
    assert "SECRET" not in str(raised.value)
    assert "PRIVATE" not in str(raised.value)


def test_command_makes_them_and_says_what_for(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "linkwind", "certs", "c", "--role", "dynamics=10.0.0.2", "--days", "7"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True)
    assert "--tls c/dynamics" in done.stdout
    again = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert again.returncode == 3
    assert "c/dynamics: expected a role without a certificate" in again.stderr
