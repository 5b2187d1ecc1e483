"""Messages that a participant should never get: mutations of good ones, by chance and with intent.

``python -m tests.faults.malformed COUNT SEED`` feeds both ends with them; it fails if any is not refused by
name, or leaves anything behind.
"""

from __future__ import annotations

import gc
import sys
import tracemalloc
from collections import Counter
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from random import Random

import numpy as np

from linkwind.checkpoints import Checkpoint, State
from linkwind.errors import ParticipantError, SimulationError
from linkwind.frames import FlowFrame, Sent, VolumeFrame, WakeFrame
from linkwind.messages import MotionMessage, WrenchMessage
from linkwind.protocol import DynamicsSession, ProviderSession, ProviderState, fault, fault_error
from linkwind.schema import MESSAGES, SHA256
from tests.fakes import FakeModel

RUN = "fuzzed"
LARGE = 200_000  # bytes
GROWTH = 4_000_000  # bytes; Python's table of names may double once, messages come to 100 MB


def good() -> dict[str, bytes]:
    """Return a good message of each kind."""
    motion, wrench = MotionMessage(RUN, 2), WrenchMessage(RUN, "aero", 2)
    for message in (motion, wrench):
        message.stamp(1, 0, 1_000_000)
    frame = FlowFrame(
        1, 1_000_000, (0.0, 0.0), 0.1,
        np.zeros((4, 4, 2), np.float32), np.zeros((4, 4), np.float32), np.zeros((4, 4), np.float32),
    )  # fmt: skip
    wake = WakeFrame(
        1, 1_000_000, 1, np.zeros((2, 4, 3, 3), np.float32), np.zeros((2, 3, 2), np.float32)
    )  # fmt: skip
    box = np.zeros((2, 3, 4, 3), np.float32)
    volume = VolumeFrame(1, 1_000_000, (0.0, 0.0, 0.0), 0.1, box, box[..., 0])
    control = MESSAGES["Control"]
    hello = {"name": "aero", "schema_sha256": SHA256, "version": "0", "instance": "x"}
    welcome = {
        "run": RUN, "scenario_json": "{}", "step_ns": 1_000_000, "steps": 10,
        "bodies": ["a", "b"], "provider_bodies": ["a", "b"],
    }  # fmt: skip
    return {
        "motion": motion.payload(),
        "wrench": wrench.payload(),
        "frame": frame.encode(RUN, "aero", 1),
        "volume": volume.encode(RUN, "aero", 1),
        "wake": wake.encode(RUN, "aero", 1),
        "checkpoint": next(Checkpoint(1, 1, 1_000_000, State.of(b"memory")).pieces(RUN, "aero")),
        "hello": control(hello=hello).SerializeToString(),
        "ready": control(ready={"name": "aero", "instance": "x", "kind": 1}).SerializeToString(),
        "bye": control(bye={"name": "aero"}).SerializeToString(),
        "welcome": control(welcome=welcome).SerializeToString(),
        "fault": fault("aero", 1, 0, ParticipantError("x")),
    }


def flipped(chance: Random, message: bytes) -> bytes:
    data = bytearray(message)
    for _ in range(chance.randint(1, 8)):
        data[chance.randrange(len(data))] ^= 1 << chance.randrange(8)
    return bytes(data)


def truncated(chance: Random, message: bytes) -> bytes:
    return message[: chance.randrange(len(message))]


def extended(chance: Random, message: bytes) -> bytes:
    return message + chance.randbytes(chance.randint(1, 64))


def oversized(chance: Random, message: bytes) -> bytes:
    return (
        message + bytes(chance.choice((b"\x52", b"\x3a"))) + b"\xc0\x84\x3d" + bytes(chance.randint(1, LARGE))
    )


def noise(chance: Random, message: bytes) -> bytes:
    return chance.randbytes(chance.randint(0, 2 * len(message)))


def of_another_run(chance: Random, message: bytes) -> bytes:
    return message.replace(RUN.encode(), b"others")


def of_another_sender(chance: Random, message: bytes) -> bytes:
    return message.replace(b"aero", chance.choice((b"tail", b"\xff\xfe\xfd\xfc", b"dyna")))


def spliced(chance: Random, message: bytes) -> bytes:
    other = chance.choice(list(good().values()))
    return message[: chance.randrange(len(message))] + other[chance.randrange(len(other)) :]


def of_another_step(chance: Random, message: bytes) -> bytes:
    step = chance.choice((0, 2, 3, 10, 11, 2**31, 2**63, 2**64 - 1))
    return message.replace((1).to_bytes(8, "little"), step.to_bytes(8, "little"))


def not_finite(chance: Random, message: bytes) -> bytes:
    value = np.float64(chance.choice((np.nan, np.inf, -np.inf, 1e308))).tobytes()
    at = message.find(bytes(16))
    return message if at < 0 else message[: at + 8] + value + message[at + 16 :]


MUTATIONS: tuple[Callable[[Random, bytes], bytes], ...] = (
    flipped, truncated, extended, oversized, noise, of_another_run, of_another_sender, spliced,
    of_another_step, not_finite,
)  # fmt: skip


@dataclass
class Fuzzed:
    """What came of it.

    Attributes:
        messages: tried.
        answers: how many were refused, or taken, by each end.
        unexpected: exceptions that are not linkwind's, by where and what they are.
        grown: memory from the middle to the end [bytes].
    """

    messages: int
    answers: Counter[str]
    unexpected: Counter[str]
    grown: int


class Ends:
    """Both ends of a run, each fed with messages by hand."""

    def __init__(self) -> None:
        self.dynamics = DynamicsSession(RUN, "{}", 1_000_000, 10, ["a", "b"], {"aero": ["a", "b"]})
        self.provider = ProviderSession("aero", lambda scenario, name: FakeModel())
        self.provider.welcome(self.dynamics.control(self.provider.hello()))
        self.provider.build()
        self.provider.started(self.dynamics.control(self.provider.ready()))
        first = self.provider.answer(self.dynamics.post(0, 0))
        assert first is not None
        assert self.dynamics.accept("aero", first)
        self.motion = self.dynamics.post(1, 0)

    def feed(self, kind: str, payload: bytes) -> str:
        """Give a message to the end that it is for; return what became of it."""
        dynamics = self.dynamics
        if kind == "motion":
            if self.provider.answer(payload) is not None:
                return "answered"
            return "taken" if self.provider.state is ProviderState.DONE else "dropped"
        if kind == "wrench":
            if dynamics.accept("aero", payload):
                with suppress(SimulationError):  # not finite: the run would end here, by name
                    dynamics.total()
                return "taken"
            return "dropped"
        if kind == "frame":
            dynamics.frame("aero", Sent("flow", payload))
        elif kind in ("volume", "wake"):
            dynamics.frame("aero", Sent(kind, payload))
        elif kind == "checkpoint":
            dynamics.piece("aero", payload)
        elif kind == "welcome":
            ProviderSession("aero", lambda scenario, name: FakeModel()).welcome(payload)
        elif kind == "fault":
            fault_error(payload)
        else:
            reply = MESSAGES["Control"].FromString(dynamics.control(payload, "aero"))
            return reply.WhichOneof("body")  # type: ignore[no-any-return]
        return "taken"

    def goes_on(self) -> bool:
        """Tell whether good messages are answered as ever, after all that was refused."""
        answer = self.provider.answer(self.motion)
        return answer is not None and self.dynamics.accept("aero", answer)


def fuzz(count: int, seed: int) -> Fuzzed:
    """Feed that many mutated messages, to new ends once one was taken; refused ones must leave no trace."""
    chance, originals = Random(seed), good()
    kinds = list(originals)
    answers: Counter[str] = Counter()
    unexpected: Counter[str] = Counter()
    ends, pristine, base = Ends(), True, 0
    tracemalloc.start()
    for number in range(count):
        if number == count // 2:
            ends, pristine = Ends(), True
            base = _held()
        kind = kinds[number % len(kinds)]
        mutate = chance.choice(MUTATIONS)
        payload = mutate(chance, originals[kind])
        try:
            became = ends.feed(kind, payload)
        except ParticipantError:
            became = "refused"
        except Exception as error:
            unexpected[f"{kind}, {mutate.__name__}: {type(error).__name__}: {str(error)[:80]}"] += 1
            became = "unexpected"
        answers[became] += 1
        pristine = pristine and became in ("refused", "refuse", "dropped")
        if not pristine or number % 500 == 499:
            if pristine and not ends.goes_on():
                unexpected["a refused message left a trace"] += 1
            ends, pristine = Ends(), True
    ends, payload = Ends(), b""
    grown = _held() - base
    tracemalloc.stop()
    return Fuzzed(count, answers, unexpected, grown)


def _held() -> int:
    """Return the memory that is in use, without what is only waiting to be collected [bytes]."""
    gc.collect()
    return tracemalloc.get_traced_memory()[0]


if __name__ == "__main__":
    done = fuzz(int(sys.argv[1]), int(sys.argv[2]))
    print(done)
    sys.exit(bool(done.unexpected) or done.grown > GROWTH or done.answers["taken"] == 0)
