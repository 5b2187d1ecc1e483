"""Every public exception of linkwind.

::

    LinkwindError                    exit code 1
    ├── InputError                   3   something that the user gave is wrong
    │   ├── ScenarioError                a scenario file, a key or an override
    │   ├── MechanismError               bodies and joints that do not make a mechanism
    │   ├── ExpressionError              a force-field expression
    │   ├── LogError                     a log file that is missing, damaged or foreign
    │   └── CertificateError             certificates that are missing, expired or somebody else's
    ├── ParticipantError             4   a participant ended the run
    │   ├── RefusedError                 the dynamics refused a participant
    │   ├── TrustError                   two machines do not trust each other: TLS, certificates
    │   ├── ProtocolError                a message that the lock-step protocol does not allow
    │   ├── LostError                    a participant died, stopped or never came
    │   ├── AnswerTimeoutError           a participant is alive but does not answer
    │   ├── MissedError                  a listener has missed messages of a run
    │   ├── FaultError                   a participant reported that it cannot go on
    │   └── SimulationError              numerical trouble: NaN, singular inertia, step underflow
    ├── MismatchError                5   what was recorded does not come out again
    └── StoppedError               130   somebody stopped the run: Ctrl-C or SIGTERM

A message says what, which item, expected, got, and what to do. That two runs differ is an answer, not an
exception: the commands that compare end with exit code 5 (``linkwind.cli.options.DIFFERENT``). A run that is
resumed cannot go on from there: a ``MismatchError``, with the same code.
"""

from __future__ import annotations


class LinkwindError(Exception):
    """Base of every exception that linkwind raises on purpose."""

    exit_code = 1


class InputError(LinkwindError):
    """Something that the user gave is wrong."""

    exit_code = 3


class ScenarioError(InputError):
    """A scenario file, one of its keys or an override is wrong."""


class MechanismError(InputError):
    """Bodies and joints that do not make a mechanism."""


class ExpressionError(InputError):
    """A force-field expression cannot be parsed or evaluated."""


class LogError(InputError):
    """A log file is missing, damaged or not one of linkwind's."""


class CertificateError(InputError):
    """Certificates are missing, expired or somebody else's."""


class ParticipantError(LinkwindError):
    """A participant ended the run."""

    exit_code = 4


class RefusedError(ParticipantError):
    """The dynamics refused a participant."""


class TrustError(ParticipantError):
    """Two machines do not trust each other: no TLS on one side, or a certificate that the other rejects."""


class ProtocolError(ParticipantError):
    """A message that the lock-step protocol does not allow."""


class LostError(ParticipantError):
    """A participant died, was stopped, or never came.

    Attributes:
        provider: that was lost in the middle of a run and may come back; empty if that is no question.
    """

    def __init__(self, text: str, provider: str = "") -> None:
        super().__init__(text)
        self.provider = provider


class AnswerTimeoutError(ParticipantError):
    """A participant is alive but did not answer in time."""


class MissedError(ParticipantError):
    """A listener has missed messages of a run."""


class FaultError(ParticipantError):
    """A participant reported that it cannot go on."""


class SimulationError(ParticipantError):
    """Numerical trouble: not a number, singular inertia, step-size underflow."""


class MismatchError(LinkwindError):
    """A run that is resumed does not do again, bit for bit, what was recorded."""

    exit_code = 5


class StoppedError(LinkwindError):
    """Somebody stopped the run."""

    exit_code = 130
