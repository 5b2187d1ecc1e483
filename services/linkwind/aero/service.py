"""The aero service: a force model that answers motion with wrenches until the run is over."""

from __future__ import annotations

import contextlib
import logging

from linkwind import aero
from linkwind.aero import Own
from linkwind.bus.base import ProviderLink
from linkwind.errors import FaultError, LostError
from linkwind.protocol import Model, ProviderSession, ProviderState
from linkwind.scenario import from_json

_log = logging.getLogger("linkwind")

GOODBYE_TIMEOUT = 2.0  # s; a dynamics that is gone by then does not need the Bye


def session(name: str, own: Own | None = None) -> ProviderSession:
    """Return the protocol state of the provider ``name``, which takes its scenario from the dynamics.

    Args:
        name: of the provider.
        own: its model, if that is the user's own, known on this side only.
    """

    def build(scenario_json: str, provider: str) -> Model:
        scenario = from_json(scenario_json)
        return aero.build(scenario, next(p for p in scenario.providers if p.name == provider), own)

    return ProviderSession(name, build)


def serve(link: ProviderLink, provider: ProviderSession, start_timeout: float) -> None:
    """Take part in one run.

    Args:
        link: an open end of the bus.
        provider: protocol state, new.
        start_timeout: [s] to wait for the dynamics.

    Raises:
        RefusedError: the dynamics refuses this provider.
        TrustError: the other side's TLS or certificate, or ours, will never do.
        LostError: no dynamics came, or it went away in the middle of the run.
        FaultError: somebody else ended the run.
        SimulationError: the force model failed (the dynamics has been told).
    """
    _log.info('"%s": waiting for a dynamics', provider.name)
    provider.welcome(link.request(provider.hello(), start_timeout))
    _log.info('"%s": takes part in run %s', provider.name, provider.run)
    try:
        while (missing := provider.fetch()) is not None:
            provider.fetched(link.request(missing, start_timeout))
        provider.build()
        link.join(provider.run)
        provider.catch_up()
        provider.started(link.request(provider.ready(), start_timeout))
        while provider.state is not ProviderState.DONE:
            answer = provider.answer(link.receive())
            for frame in provider.frames():
                link.show(frame)
            for piece in provider.pieces():
                link.keep(piece)
            if answer is not None:
                link.reply(answer)
    except Exception as error:
        if not isinstance(error, LostError | FaultError):
            with contextlib.suppress(LostError):  # nobody is left to be told
                link.request(provider.fault(error), GOODBYE_TIMEOUT)
        raise
    finally:
        provider.close()
    link.request(provider.bye(), GOODBYE_TIMEOUT)
    _log.info('"%s": done, step %d was the last', provider.name, provider.at[0])
