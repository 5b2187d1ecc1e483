"""The files that a participant shows who it is with."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

AUTHORITY = "ca"  # folder of the authority; its key leaves it for no other machine
CA, CERTIFICATE, KEY = "ca.pem", "certificate.pem", "key.pem"
DYNAMICS, OBSERVER, OPERATOR, ROUTER = "dynamics", "observer", "operator", "router"


@dataclass(frozen=True)
class Identity:
    """Files of one role.

    Attributes:
        role: the name in the certificate.
        folder: with the certificate, its key, and the certificate of the authority that all trust.
    """

    role: str
    folder: Path

    @property
    def ca(self) -> Path:
        """Certificate of the authority."""
        return self.folder / CA

    @property
    def certificate(self) -> Path:
        """Certificate of the role."""
        return self.folder / CERTIFICATE

    @property
    def key(self) -> Path:
        """Private key of the role."""
        return self.folder / KEY
