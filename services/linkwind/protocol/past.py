"""What a provider that was lost needs to come back: its last checkpoint, and what it has answered since."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from typing import NamedTuple

from linkwind.checkpoints import Checkpoint


class Answered(NamedTuple):
    """A motion that a provider has answered: step, message, SHA-256 of the answer."""

    step: int
    motion: bytes
    sha256: bytes


class Past:
    """What the dynamics keeps of one provider; as long as checkpoints come, that stays small.

    Attributes:
        step: of the checkpoint; -1 for the beginning.
        number: of the checkpoint; 0 for the beginning.
        state: what the provider had saved then.
        frames: that it had shown until then.
        answers: since then, in order.
        torn: whether a checkpoint did not come when it was due; then nothing is kept any more.
    """

    def __init__(self, every: int, step: int = -1, number: int = 0, state: bytes = b"") -> None:
        """Begin.

        Args:
            every: steps from one checkpoint to the next.
            step: that the provider begins after.
            number: of the checkpoint that it begins from.
            state: in that checkpoint.
        """
        self._every = every
        self.frames = 0
        self.torn = False
        self.answers: list[Answered] = []
        self._begin(step, number, state)

    def _begin(self, step: int, number: int, state: bytes) -> None:
        self.step, self.number, self.state = step, number, state
        # A checkpoint comes with the first answer to the step behind its own, and is taken right after that.
        self._due = (max(step, 0) // self._every + 1) * self._every + 1

    def add(self, step: int, motion: bytes, answer: bytes) -> None:
        """Keep what was answered; what comes from a log, from before the beginning, is left out."""
        if self.torn or step <= self.step:
            return
        if step > self._due:
            self.torn = True
            self.answers.clear()
            return
        self.answers.append(Answered(step, motion, hashlib.sha256(answer).digest()))

    def save(self, number: int, checkpoint: Checkpoint, frames: int) -> None:
        """Begin again at a checkpoint.

        Args:
            number: of the checkpoint.
            checkpoint: of the provider.
            frames: that the provider had shown when it made it.
        """
        self._begin(checkpoint.step, number, checkpoint.state)
        self.frames = frames
        self.answers = [answered for answered in self.answers if answered.step > checkpoint.step]

    @property
    def sha256(self) -> bytes:
        """Hash of the answers."""
        return digest(answered.sha256 for answered in self.answers)


def digest(answers: Iterable[bytes]) -> bytes:
    """Return the SHA-256 of the SHA-256s of some answers."""
    return hashlib.sha256(b"".join(answers)).digest()
