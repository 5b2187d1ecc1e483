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
        checkpoint: the last one; None for the beginning.
        frames: that it had shown until then.
        answers: since then, in order.
        torn: whether a checkpoint did not come when it was due; then nothing is kept any more.
    """

    def __init__(self, every: int, checkpoint: Checkpoint | None = None) -> None:
        """Begin.

        Args:
            every: steps from one checkpoint to the next.
            checkpoint: that the provider begins from; None for the beginning.
        """
        self._every = every
        self.frames = 0
        self.torn = False
        self.answers: list[Answered] = []
        self._begin(checkpoint)

    def _begin(self, checkpoint: Checkpoint | None) -> None:
        self.checkpoint = checkpoint
        self._step = -1 if checkpoint is None else checkpoint.step
        # A checkpoint comes with the first answer to the step behind its own.
        self._due = (max(self._step, 0) // self._every + 1) * self._every + 1

    def add(self, step: int, motion: bytes, answer: bytes) -> None:
        """Keep what was answered; what comes from a log, from before the beginning, is left out."""
        if self.torn or step <= self._step:
            return
        if step > self._due:
            self.torn = True
            self.answers.clear()
            return
        self.answers.append(Answered(step, motion, hashlib.sha256(answer).digest()))

    def save(self, checkpoint: Checkpoint, frames: int) -> None:
        """Begin again at a checkpoint of the provider; ``frames`` that it had shown when it made it."""
        self._begin(checkpoint)
        self.frames = frames
        self.answers = [answered for answered in self.answers if answered.step > checkpoint.step]

    @property
    def sha256(self) -> bytes:
        """Hash of the answers."""
        return digest(answered.sha256 for answered in self.answers)


def digest(answers: Iterable[bytes]) -> bytes:
    """Return the SHA-256 of the SHA-256s of some answers."""
    return hashlib.sha256(b"".join(answers)).digest()
