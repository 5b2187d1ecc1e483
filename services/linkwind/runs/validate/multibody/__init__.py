"""Cases of ``linkwind validate multibody``, one module a theme."""

from __future__ import annotations

from linkwind.runs.validate.multibody import closed, equations, long, orders, published, rotating

CASES = {
    **equations.CASES,
    **published.CASES,
    **rotating.CASES,
    **closed.CASES,
    **orders.CASES,
    **long.CASES,
}
