"""Every provider of a run on this machine: as processes of their own, or in this one."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path

from linkwind.aero import Own, PythonSource
from linkwind.bus.base import DynamicsLink
from linkwind.bus.inprocess import InProcessLink
from linkwind.credentials import DYNAMICS, Identity, identity_in
from linkwind.errors import InputError
from linkwind.protocol import DynamicsSession
from linkwind.runs.children import children
from linkwind.runs.own import refuse_missing
from linkwind.scenario import Scenario

PORTS_TRIED = 5


@contextmanager
def providers_here(
    session: DynamicsSession,
    scenario: Scenario,
    folder: Path,
    own: Mapping[str, Own],
    tls: Path | None = None,
) -> Iterator[tuple[DynamicsLink, Callable[[], None]]]:
    """Start the providers of a session, over the scenario's transport, and end them.

    Args:
        session: of the dynamics.
        scenario: says how.
        folder: for what the processes print.
        own: models of the user's own, by provider.
        tls: folder with a certificate for each participant; None without TLS.

    Raises:
        InputError: a model of the user's own is missing, or another one than the scenario says.

    Yields:
        The dynamics' end of the bus, to be closed; and what raises LostError once a process has ended with
        an error, or, with bus.recovery, starts it again.
    """
    refuse_missing(scenario, own, session.providers)
    if scenario.bus.transport == "inprocess":
        yield inprocess_link(session, own), lambda: None
        return
    link, endpoint = _listen_here(session, scenario, tls)
    with children(folder, session) as providers:
        for name in session.providers:
            arguments = ["aero", "--connect", endpoint, "--name", name, "--run", session.run]
            if tls:
                arguments += ["--tls", str(tls)]
            arguments += _option(own.get(name))
            providers.start(name, [*arguments, "--start-timeout", str(scenario.bus.start_timeout)])
        yield link, providers.check


def _option(own: Own | None) -> list[str]:
    """Return how a process is told its model."""
    if isinstance(own, PythonSource):
        return ["--model", own.argument]
    return ["--force-fmu", str(own.resolve())] if own else []


def inprocess_link(session: DynamicsSession, own: Mapping[str, Own]) -> InProcessLink:
    """Return a bus whose providers are in this process."""
    from linkwind.aero.service import session as provider_session

    return InProcessLink(session, [provider_session(name, own.get(name)) for name in session.providers])


def zenoh_link(
    session: DynamicsSession,
    scenario: Scenario,
    listen: Sequence[str],
    connect: Sequence[str],
    identity: Identity | None = None,
) -> DynamicsLink:
    """Open the dynamics' end of a zenoh bus.

    Raises:
        InputError: an endpoint cannot be opened.
    """
    from linkwind.bus.zenoh import ZenohDynamicsLink

    timeout, first = scenario.coupling.timeout, scenario.bus.start_timeout
    return ZenohDynamicsLink(session, listen, connect, timeout, identity, first)


def _listen_here(session: DynamicsSession, scenario: Scenario, tls: Path | None) -> tuple[DynamicsLink, str]:
    """Open the dynamics' end on a free port of this machine; return it and its endpoint."""
    from linkwind.bus.zenoh import loopback_endpoint

    identity = identity_in(tls, DYNAMICS)
    for _ in range(PORTS_TRIED):
        endpoint = loopback_endpoint("tls" if tls else "tcp")
        try:
            return zenoh_link(session, scenario, [endpoint], [], identity), endpoint
        except InputError as error:  # somebody took the port between asking and listening
            taken = error
    raise taken
