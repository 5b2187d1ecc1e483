"""Who is who on a secure bus: certificates for mutual TLS, one for each role.

The name in a certificate is the role: ``dynamics``, ``observer`` (reads), ``operator``
(commands events), ``router``, or the name of a provider.
Certificates are files on the machine of their role. They are in no scenario, so in no log and no message.
``authority`` issues them, ``checks`` loads them.
"""

from __future__ import annotations

from pathlib import Path

from linkwind.credentials.identity import DYNAMICS, OBSERVER, OPERATOR, ROUTER, Identity

__all__ = ["DYNAMICS", "OBSERVER", "OPERATOR", "ROUTER", "Identity", "identity_in"]


def identity_in(folder: Path | None, role: str) -> Identity | None:
    """Return what a role shows on a secure bus; None for a bus without TLS, which needs no cryptography.

    Raises:
        CertificateError: the folder has no good certificate for the role.
    """
    if folder is None:
        return None
    from linkwind.credentials.checks import load_identity

    return load_identity(folder, role)
