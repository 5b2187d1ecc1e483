"""The lock-step protocol (v1) as two state machines that know no network.

Each side takes bytes and gives bytes; ``bus/`` moves them. The protocol itself is written down in
``schemas/README.md``, so that a stranger can implement a participant from it.
"""

from linkwind.protocol.control import fault, fault_error, refuse
from linkwind.protocol.dynamics import DynamicsSession
from linkwind.protocol.handshake import Course
from linkwind.protocol.memory import Model
from linkwind.protocol.provider import ProviderSession, ProviderState

__all__ = [
    "Course",
    "DynamicsSession",
    "Model",
    "ProviderSession",
    "ProviderState",
    "fault",
    "fault_error",
    "refuse",
]
