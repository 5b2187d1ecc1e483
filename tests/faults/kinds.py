"""What can go wrong with a run, at a random moment each: how it ends, how soon, and what its log is worth."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from random import Random

from linkwind.bus.base import PREFIX
from linkwind.bus.zenoh import LARGEST, LEASE
from tests.faults import containers, recovered
from tests.faults.programs import Programs
from tests.faults.shutdown import COMMANDS, WAYS, stop
from tests.faults.test_disk import on_a_disk_that_fails, on_a_full_disk
from tests.faults.truth import truthful
from tests.networks.namespaces import Machines
from tests.security.attacks import hostile
from tests.security.bed import Bed, attacker

PATIENCE = 120.0  # s for a machine under load
MESSAGES = 5000  # malformed ones in one trial


@dataclass
class Trial:
    """How a fault ended.

    Attributes:
        within: s from the fault to its end, or to its recovery.
        lost: s of the run that are not in its log; None where that is no question.
    """

    within: float
    lost: float | None = None


def ended(process: subprocess.Popen[str], code: int, *errors: str) -> float:
    """Wait for a process to end as it should; return when that was."""
    _, said = process.communicate(timeout=PATIENCE)
    now = time.monotonic()
    assert process.returncode == code, f"status {process.returncode}: {said}"
    assert any(error in said for error in errors), said
    assert "Traceback" not in said, said
    return now


def hit(side: str, number: signal.Signals, folder: Path, chance: Random) -> Trial:
    """Send a signal to one side of a run."""
    programs = Programs(folder)
    try:
        sides = {"dynamics": programs.dynamics("coupling.timeout=60"), "aero": programs.aero()}
        programs.await_steps()
        time.sleep(chance.uniform(0.0, 1.0))
        os.kill(sides[side].pid, number)
        began, flushed = time.monotonic(), time.time()
        if side == "aero":
            within = ended(sides["dynamics"], 4, '"aero" was lost at step ') - began
            truthful(programs.log())
            return Trial(within, 0.0)
        within = ended(sides["aero"], 4, "the dynamics was lost") - began
        os.kill(sides["dynamics"].pid, signal.SIGKILL)
        sides["dynamics"].wait()
        lost = max(0.0, flushed - programs.log().stat().st_mtime)
        truthful(programs.log())
        return Trial(within, lost)
    finally:
        programs.end()


def cut(folder: Path, chance: Random) -> Trial:
    """Pull the cable between two machines for 0.1 to 10 s."""
    machines, log = Machines(folder), folder / "out" / "log.mcap"
    try:
        machines.add("d", "a")
        here, _ = machines.connect("d", "a")
        aero = machines.start("a", "aero", "--connect", f"tcp/{here}:7447")
        options = ["--out", "out", "--json", "--set=time.end=1000", "--set=coupling.timeout=60"]
        dynamics = machines.start("d", "dynamics", "two_link", "--listen", "tcp/0.0.0.0:7447", *options)
        grows(log, dynamics)
        machines.cable("d", 1, "down")
        began, gone = time.monotonic(), 0.1 * 100.0 ** chance.random()
        time.sleep(gone)
        machines.cable("d", 1, "up")
        if gone < 0.5 * LEASE:  # TCP may take as long again before it looks once more
            grows(log, dynamics)
            within = time.monotonic() - began
            dynamics.send_signal(signal.SIGINT)
            ended(dynamics, 130, "stopped at step ")
        else:
            # Close to the lease, either side may have noticed first; or nobody, and the run goes on.
            deadline = began + gone + 5.0 * LEASE
            while dynamics.poll() is None and time.monotonic() < deadline:
                time.sleep(0.05)
            if dynamics.poll() is None and gone < 2.0 * LEASE:
                grows(log, dynamics)
                dynamics.send_signal(signal.SIGINT)
                ended(dynamics, 130, "stopped at step ")
                within = gone
            else:
                within = ended(dynamics, 4, '"aero" was lost at step ', '"aero" stopped at step ') - began
                ended(aero, 4, "the dynamics was lost", '"dynamics" stopped at step ')
        truthful(log)
        return Trial(max(0.0, within - gone), 0.0)
    finally:
        machines.end()


def resident(pid: int) -> int:
    """Return the memory that a process holds [bytes]."""
    return int(Path(f"/proc/{pid}/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")


def grows(log: Path, writer: subprocess.Popen[str]) -> None:
    """Wait until a log grows."""
    deadline = time.monotonic() + PATIENCE
    goal = 100_000 + (log.stat().st_size if log.exists() else 0)
    while not log.exists() or log.stat().st_size < goal:
        assert time.monotonic() < deadline, "the run does not go on"
        assert writer.poll() is None, writer.communicate()
        time.sleep(0.01)


def twice(folder: Path, chance: Random) -> Trial:
    """Start the aero side late, then once more."""
    programs = Programs(folder)
    try:
        dynamics = programs.dynamics("coupling.timeout=60")
        time.sleep(chance.uniform(0.0, 2.0))
        programs.aero()
        programs.await_steps()
        began = time.monotonic()
        again = programs.aero()
        assert dynamics.poll() is None, dynamics.communicate()
        within = ended(again, 4, "already takes part in run") - began
        programs.forget_last()
        programs.await_steps()
        dynamics.send_signal(signal.SIGINT)
        ended(dynamics, 130, "stopped at step ")
        truthful(programs.log())
        return Trial(within, 0.0)
    finally:
        programs.end()


def struck(folder: Path, chance: Random) -> Trial:
    """Publish a hostile message into a run that trusts its network."""
    key, payload = chance.choice([item for item in hostile().items() if item[0] != "motion"])
    with Bed(folder, secure=False) as bed, closing(attacker(bed.by_router, None)) as session:
        while not any(True for _ in session.info.routers_zid()):
            time.sleep(0.01)
        time.sleep(0.2)
        began = time.monotonic()
        while bed.alive() and time.monotonic() < began + 10.0:
            session.put(f"linkwind/v1/attacked/{key}", payload)
            time.sleep(0.05)
        within = time.monotonic() - began
        said = bed.stop()
        assert re.search(
            r"error: (wrench|frame|checkpoint) from|error: \"aero\" (stopped|was lost) at", said
        ), said
    truthful(bed.log)
    return Trial(within, 0.0)


def oversized(folder: Path, chance: Random) -> Trial:
    """Publish wrenches far larger than any that the run could need; they are dropped, and cost no memory."""
    programs = Programs(folder)
    try:
        dynamics = programs.dynamics("coupling.timeout=60", run="attacked")
        programs.aero()
        programs.await_steps()
        before = resident(dynamics.pid)
        with closing(attacker(programs.endpoint, None)) as session:
            while not any(True for _ in session.info.peers_zid()):
                time.sleep(0.01)
            began = time.monotonic()
            for size in (2 * LARGEST, chance.randrange(100_000, 50_000_000)):
                session.put(f"{PREFIX}/attacked/wrench/aero", bytes(size))
            within = time.monotonic() - began
            programs.await_steps()
        grown = resident(dynamics.pid) - before
        assert grown < 1.2 * LARGEST, f"{grown / 1e6:.0f} MB more"
        dynamics.send_signal(signal.SIGINT)
        ended(dynamics, 130, "stopped at step ")
        truthful(programs.log())
        return Trial(within, 0.0)
    finally:
        programs.end()


def malformed(folder: Path, chance: Random) -> Trial:
    """Give both ends 5,000 malformed messages; none may be an unnamed error, leave a trace, or memory."""
    program = [sys.executable, "-m", "tests.faults.malformed", str(MESSAGES), str(chance.randrange(2**31))]
    began = time.monotonic()
    done = subprocess.run(program, capture_output=True, text=True, timeout=PATIENCE, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return Trial((time.monotonic() - began) / MESSAGES)


def full(folder: Path, chance: Random) -> Trial:
    """Let the disk be full in the middle of a run."""
    began = time.monotonic()
    done = on_a_full_disk(folder)
    assert done.returncode == 3
    assert "expected to write the log; got File too large. The file is cut there." in done.stderr
    truthful(folder / "out" / "log.mcap")
    return Trial(time.monotonic() - began)


def read_only(folder: Path, chance: Random) -> Trial:
    """Let the disk become one that can only be read in the middle of a run, which may need its log or not."""
    required, after = chance.random() < 0.5, chance.uniform(0.0, 0.3)
    took = on_a_disk_that_fails(folder, required=required, after=after)
    return Trial(took if required else 0.0)  # or the run came to its own end


Kind = Callable[[Path, Random], Trial]
KINDS: dict[str, Kind] = {
    f"{side} {name}": lambda folder, chance, side=side, number=number: hit(side, number, folder, chance)
    for side in ("aero", "dynamics")
    for name, number in (("killed", signal.SIGKILL), ("stopped", signal.SIGSTOP))
} | {
    "aero killed, comes back": lambda folder, chance: Trial(recovered.killed(folder, chance)),
    "aero silent, is replaced": lambda folder, chance: Trial(recovered.silent(folder, chance)),
    "network cut, comes back": lambda folder, chance: Trial(recovered.cut_off(folder, chance)),
    "network cut, 0.1 to 10 s": cut,
    "late, then twice": twice,
    "hostile message, no TLS": struck,
    "oversized message, no TLS": oversized,
    "5,000 malformed messages": malformed,
    "disk full": full,
    "disk becomes read-only": read_only,
    "container killed": lambda folder, chance: Trial(containers.killed(folder, chance), 0.0),
}  # fmt: skip

STOPS: dict[str, Kind] = {
    f"stop {name}": lambda folder, chance, command=command: Trial(stop(command, chance.choice(WAYS), folder))
    for name, command in COMMANDS.items()
}
