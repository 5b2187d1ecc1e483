"""Eclipse zenoh as the transport: two processes find each other without a broker.

Publishers and subscribers carry the lock step, a queryable the control requests, liveliness tokens tell
who is there. Multicast, gossip and shared memory are off: endpoints are explicit, messages small.
"""

from linkwind.bus.zenoh.diagnosis import check_trust
from linkwind.bus.zenoh.dynamics import SPIN, ZenohDynamicsLink
from linkwind.bus.zenoh.listener import ZenohListener
from linkwind.bus.zenoh.order import order
from linkwind.bus.zenoh.player import ZenohPlayer
from linkwind.bus.zenoh.provider import ZenohProviderLink
from linkwind.bus.zenoh.router import ZenohRouter
from linkwind.bus.zenoh.session import LARGEST, LEASE, OBSERVER, loopback_endpoint, open_session

__all__ = [
    "LARGEST",
    "LEASE",
    "OBSERVER",
    "SPIN",
    "ZenohDynamicsLink",
    "ZenohListener",
    "ZenohPlayer",
    "ZenohProviderLink",
    "ZenohRouter",
    "check_trust",
    "loopback_endpoint",
    "open_session",
    "order",
]
