"""A router: participants that cannot reach each other meet there; with TLS it knows what each may do."""

from __future__ import annotations

from collections.abc import Sequence

from linkwind.bus.zenoh.access import of_hub
from linkwind.bus.zenoh.session import Security, close_session, open_router
from linkwind.credentials import DYNAMICS, Identity


class ZenohRouter:
    """Passes messages on until it is closed."""

    def __init__(
        self,
        listen: Sequence[str],
        connect: Sequence[str],
        providers: Sequence[str],
        identity: Identity | None,
    ) -> None:
        """Open the router.

        Args:
            listen: zenoh endpoints that participants connect to.
            connect: zenoh endpoints of participants that it goes to itself.
            providers: names of those that a secure bus lets in.
            identity: what the router shows; None without TLS.

        Raises:
            InputError: an endpoint cannot be opened.
        """
        security = Security(identity, of_hub(providers, DYNAMICS)) if identity else None
        self._session = open_router(listen, connect, security)

    def close(self) -> None:
        """Leave the bus."""
        close_session(self._session)
