"""Which joints carry bodies, and which close loops.

Joints count in the order of the file. The first one that names a body as its child carries it, unless the
body would come to carry itself; all others, and those that only keep a distance, close loops.
"""

from __future__ import annotations

from collections.abc import Iterable


def carries(joints: Iterable[tuple[str, str, str]]) -> list[bool]:
    """Return for each joint, given as type, parent and child, whether it carries its child."""
    parents: dict[str, str] = {}
    found = []
    for kind, parent, child in joints:
        free = kind != "distance" and child not in parents and child not in _way_up(parent, parents)
        if free:
            parents[child] = parent
        found.append(free)
    return found


def _way_up(body: str, parents: dict[str, str]) -> list[str]:
    """Return the bodies from ``body`` to its root."""
    way = [body]
    while way[-1] in parents:
        way.append(parents[way[-1]])
    return way
