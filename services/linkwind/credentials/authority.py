"""A certificate authority of one's own, and what it issues: ECDSA on P-256, PEM files."""

from __future__ import annotations

import datetime
import ipaddress
import os
import re
import secrets
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

from linkwind.credentials.identity import (
    AUTHORITY,
    CA,
    CERTIFICATE,
    DYNAMICS,
    KEY,
    OBSERVER,
    OPERATOR,
    ROUTER,
)
from linkwind.errors import CertificateError

AUTHORITY_DAYS = 3650
CLOCKS = datetime.timedelta(hours=1)  # that the clocks of two machines may differ


@dataclass(frozen=True)
class Role:
    """Whom a certificate is for.

    Attributes:
        name: of the role.
        hosts: names and addresses that others reach it at; only a role with some can be listened at.
    """

    name: str
    hosts: tuple[str, ...] = ()


DEFAULT_ROLES = (
    Role(DYNAMICS, ("localhost", "127.0.0.1", "::1")),
    Role("aero"),
    Role(OBSERVER),
    Role(OPERATOR),
)


def role(text: str) -> Role:
    """Return the role that ``NAME`` or ``NAME=HOST,HOST`` means.

    Raises:
        CertificateError: it means none.
    """
    name, _, hosts = text.partition("=")
    listed = tuple(host for host in hosts.split(",") if host)
    if not re.fullmatch(r"[A-Za-z0-9_.-]{1,64}", name) or name == AUTHORITY or name.startswith("."):
        raise CertificateError(
            f'--role: expected NAME or NAME=HOST,HOST, such as dynamics=10.0.0.2 or aero; got "{text}"'
        )
    for host in listed:
        if not re.fullmatch(r"[A-Za-z0-9_.:-]+", host):
            raise CertificateError(f'--role {name}: expected names or addresses of machines; got "{host}"')
    if not listed and name in (DYNAMICS, ROUTER):
        raise CertificateError(
            f"--role {name}: expected the names or addresses that others reach it at, such as {name}=10.0.0.2"
        )
    return Role(name, listed)


def issue(folder: Path, roles: Sequence[Role], days: int) -> list[Path]:
    """Make an authority unless ``folder`` has one, and a certificate for each role; return their folders.

    Args:
        folder: new, empty, or one that this function has made before.
        roles: each gets a folder of its own with all that its machine needs.
        days: that the certificates of the roles are valid.

    Raises:
        CertificateError: something is there already, or cannot be written; then nothing has been changed
            that was there.
    """
    names = [one.name for one in roles]
    for name in names:
        if names.count(name) > 1:
            raise CertificateError(f"--role {name}: expected each role once; got {names.count(name)}")
        if (folder / name).exists():
            raise CertificateError(
                f"{folder / name}: expected a role without a certificate; got one that exists, and none is "
                "written over. Remove that folder, or choose another DIR"
            )
    try:
        return [_issue(folder, one, days, *_authority(folder)) for one in roles]
    except OSError as error:
        raise CertificateError(f"{error.filename}: cannot be written: {error.strerror}") from error


def _authority(folder: Path) -> tuple[x509.Certificate, ec.EllipticCurvePrivateKey]:
    """Return the authority in ``folder``, made if it is not there."""
    home = folder / AUTHORITY
    if home.exists():
        try:
            certificate = x509.load_pem_x509_certificate((home / CERTIFICATE).read_bytes())
            key = serialization.load_pem_private_key((home / KEY).read_bytes(), None)
        except (OSError, ValueError) as error:
            raise CertificateError(
                f"{home}: expected the authority's {CERTIFICATE} and {KEY}; got something else. Choose a new "
                "folder"
            ) from error
        assert isinstance(key, ec.EllipticCurvePrivateKey)
        return certificate, key
    key = ec.generate_private_key(ec.SECP256R1())
    name = _named(f"linkwind CA {secrets.token_hex(4)}")  # two authorities are told apart by their names
    certificate = (
        _builder(name, name, key, AUTHORITY_DAYS)
        .add_extension(x509.BasicConstraints(ca=True, path_length=0), critical=True)
        .add_extension(_usage(signs_certificates=True), critical=True)
        .sign(key, hashes.SHA256())
    )
    _write(home, certificate, key)
    return certificate, key


def _issue(
    folder: Path, role: Role, days: int, authority: x509.Certificate, signing: ec.EllipticCurvePrivateKey
) -> Path:
    """Make key and certificate of a role."""
    key = ec.generate_private_key(ec.SECP256R1())
    uses = [ExtendedKeyUsageOID.CLIENT_AUTH]
    builder = _builder(_named(role.name), authority.subject, key, days)
    if role.hosts:
        uses.append(ExtendedKeyUsageOID.SERVER_AUTH)
        names = x509.SubjectAlternativeName([_host(host) for host in role.hosts])
        builder = builder.add_extension(names, critical=False)
    certificate = (
        builder.add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
        .add_extension(_usage(signs_certificates=False), critical=True)
        .add_extension(x509.ExtendedKeyUsage(uses), critical=False)
        .add_extension(
            x509.AuthorityKeyIdentifier.from_issuer_public_key(signing.public_key()), critical=False
        )
        .sign(signing, hashes.SHA256())
    )
    home = folder / role.name
    _write(home, certificate, key)
    (home / CA).write_bytes(authority.public_bytes(serialization.Encoding.PEM))
    return home


def _builder(
    subject: x509.Name, issuer: x509.Name, key: ec.EllipticCurvePrivateKey, days: int
) -> x509.CertificateBuilder:
    now = datetime.datetime.now(datetime.UTC)
    return (
        x509.CertificateBuilder()
        .subject_name(subject)
        .issuer_name(issuer)
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - CLOCKS)
        .not_valid_after(now + datetime.timedelta(days=days))
        .add_extension(x509.SubjectKeyIdentifier.from_public_key(key.public_key()), critical=False)
    )


def _named(name: str) -> x509.Name:
    return x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, name)])


def _host(host: str) -> x509.GeneralName:
    try:
        return x509.IPAddress(ipaddress.ip_address(host))
    except ValueError:
        return x509.DNSName(host)


def _usage(*, signs_certificates: bool) -> x509.KeyUsage:
    return x509.KeyUsage(
        digital_signature=not signs_certificates,
        key_cert_sign=signs_certificates,
        crl_sign=signs_certificates,
        content_commitment=False,
        key_encipherment=False,
        data_encipherment=False,
        key_agreement=False,
        encipher_only=False,
        decipher_only=False,
    )


def _write(home: Path, certificate: x509.Certificate, key: ec.EllipticCurvePrivateKey) -> None:
    """Write both into a new folder; the key for its owner's eyes from the first byte on."""
    home.mkdir(parents=True)
    private = key.private_bytes(
        serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8, serialization.NoEncryption()
    )
    with os.fdopen(os.open(home / KEY, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "wb") as file:
        file.write(private)
    (home / CERTIFICATE).write_bytes(certificate.public_bytes(serialization.Encoding.PEM))
