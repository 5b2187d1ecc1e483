"""A look at an identity before anything is sent: what is wrong here is better said here."""

from __future__ import annotations

import datetime
from pathlib import Path

from cryptography import x509
from cryptography.exceptions import InvalidSignature
from cryptography.hazmat.primitives import serialization
from cryptography.x509.oid import NameOID

from linkwind.credentials.identity import CA, CERTIFICATE, Identity
from linkwind.errors import CertificateError


def load_identity(folder: Path, role: str) -> Identity:
    """Return the identity of ``role`` after a look at its files.

    Args:
        folder: of the role, or the one that ``linkwind certs`` made, with a folder for each role.
        role: that is needed.

    Raises:
        CertificateError: a file is missing or no certificate, is another role's, has expired, was not
            issued by the authority beside it, or others may read the key.
    """
    home = folder / role if (folder / role).is_dir() else folder
    identity = Identity(role, home.resolve())
    certificate = _certificate(identity.certificate)
    if _name(certificate) != role:
        raise CertificateError(
            f'--tls {folder}: expected the certificate of "{role}"; got that of "{_name(certificate)}"'
        )
    now = datetime.datetime.now(datetime.UTC)
    begin, end = certificate.not_valid_before_utc, certificate.not_valid_after_utc
    if not begin <= now <= end:
        raise CertificateError(
            f"{identity.certificate}: expected one that is valid now; got one from {begin} to {end}. "
            "Make a new one with linkwind certs, or set this machine's clock"
        )
    try:
        certificate.verify_directly_issued_by(_certificate(identity.ca))
    except (ValueError, TypeError, InvalidSignature) as error:
        raise CertificateError(
            f"{identity.certificate}: expected a certificate issued by the {CA} beside it; got one of "
            "another authority. Copy the whole folder of the role"
        ) from error
    _check_key(identity.key, certificate)
    return identity


def role_in(folder: Path) -> str:
    """Return the name in the certificate of a folder.

    Raises:
        CertificateError: there is no certificate.
    """
    return _name(_certificate(folder / CERTIFICATE))


def days_left(identity: Identity) -> float:
    """Return for how many days a certificate is valid still."""
    end = _certificate(identity.certificate).not_valid_after_utc
    return (end - datetime.datetime.now(datetime.UTC)).total_seconds() / 86400


def _name(certificate: x509.Certificate) -> str:
    names = certificate.subject.get_attributes_for_oid(NameOID.COMMON_NAME)
    return str(names[0].value) if names else ""


def _read(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError as error:
        raise CertificateError(
            f"{path}: cannot be read: {error.strerror}. Make certificates with: linkwind certs DIR"
        ) from error


def _certificate(path: Path) -> x509.Certificate:
    try:
        return x509.load_pem_x509_certificate(_read(path))
    except ValueError as error:
        raise CertificateError(f"{path}: expected a certificate (PEM); got something else") from error


def _check_key(path: Path, certificate: x509.Certificate) -> None:
    """Raise CertificateError unless the key is this certificate's, and its owner's alone."""
    try:
        key = serialization.load_pem_private_key(_read(path), None)
    except (ValueError, TypeError):
        raise CertificateError(f"{path}: expected a private key (PEM); got something else") from None
    if key.public_key() != certificate.public_key():
        raise CertificateError(f"{path}: expected the key of the certificate beside it; got another one")
    mode = path.stat().st_mode & 0o777
    if mode & 0o077:
        raise CertificateError(
            f"{path}: expected a key that only its owner may read; got mode {mode:04o}. Use: chmod 600 {path}"
        )
