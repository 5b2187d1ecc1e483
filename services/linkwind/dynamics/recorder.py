"""What the dynamics writes to the log: messages as they are, accepted states with what follows from them."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from linkwind.coupling import CommunicationPoint
from linkwind.dynamics.plant import State
from linkwind.log import LogWriter, StateMessage, StepMessage, TimingMessage
from linkwind.mechanism import Mechanism
from linkwind.native.multibody import Multibody
from linkwind.scenario import Scenario


class Recorder:
    """Writes the log of one run and keeps what the summary needs.

    Attributes:
        joint_gap_max: largest distance of two joint points so far, from the poses [m].
        force_max: largest aerodynamic force on a body so far [N].
    """
