"""New dynamics under recorded forces: here, with changed settings, or elsewhere on the bus."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from pathlib import Path

from linkwind.bus.inprocess import InProcessLink
from linkwind.credentials import identity_in
from linkwind.dynamics.service import DynamicsService
from linkwind.log.contents import DYNAMICS
from linkwind.log.reader import Log
from linkwind.log.scenarios import recorded
from linkwind.mechanism import build
from linkwind.runs import folder as folders
from linkwind.runs.recorded_forces import check_fits, recorded_session
from linkwind.runs.run import Beginning, Outcome, Progress, drive
from linkwind.runs.substitution import changed, metadata


def live_dynamics(log: Log, overrides: Sequence[str], out: Path | None, progress: Progress) -> Outcome:
    """Run the dynamics of a log again under its recorded forces.

    Args:
        log: of the run; may be cut or damaged.
        overrides: ``KEY=VALUE`` settings of the new dynamics.
        out: folder for the results; None for a new one under ``runs/``.
        progress: is told now and then how many steps are done.

    Raises:
        InputError: a setting is wrong, or the record does not fit it.
        LinkwindError: the run ended early, where the record ends say; its log and report tell as well.
    """
    scenario, changes = changed(log, overrides)
    check_fits(log, scenario)
    service = DynamicsService(scenario, build(scenario), log.run, changes)
    link = InProcessLink(service.session, [recorded_session(log, name) for name in log.provider_bodies])
    folder = folders.create(scenario.name, out)
    return drive(service, folder, progress, link, beginning=Beginning(metadata(log, DYNAMICS, changes)))


def answer_dynamics(
    log: Log,
    listen: Sequence[str],
    connect: Sequence[str],
    tls: Path | None = None,
    opened: Callable[[str], None] = lambda name: None,
) -> int:
    """Take part in a run elsewhere, in the place of every provider, with the forces of a log.

    Args:
        log: of the run that the forces come from.
        listen: zenoh endpoints to listen on.
        connect: zenoh endpoints of the dynamics or a router.
        tls: folder with the certificate of each provider; None without TLS.
        opened: is told the name of each provider whose endpoints are open.

    Returns:
        The last step that was answered.

    Raises:
        LostError: no dynamics came, or it went away.
        FaultError, RefusedError: as they say.
        InputError: the record does not fit the run.
    """
    from linkwind.aero.service import serve
    from linkwind.bus.zenoh import ZenohProviderLink

    timeout = recorded(log).bus.start_timeout

    def answer(name: str) -> int:
        provider = recorded_session(log, name)
        link = ZenohProviderLink(connect, listen, name=name, identity=identity_in(tls, name))
        with closing(link):
            opened(name)
            serve(link, provider, timeout)
        return provider.at[0]

    names = list(log.provider_bodies)
    with ThreadPoolExecutor(len(names)) as pool:
        return max(pool.map(answer, names))
