"""The section of the page with pictures of the flow."""

from __future__ import annotations

import base64
from html import escape

from linkwind.report.data import Run
from linkwind.report.flow import Flow
from linkwind.report.tables import number


def gallery(run: Run) -> str:
    """Return the pictures of every provider's flow with their captions; nothing for a run without frames."""
    return "\n".join(_figure(run, flow) for flow in run.flows)


def _figure(run: Run, flow: Flow) -> str:
    from linkwind.report.pictures import png

    data, width, height, times = png(run, flow)
    bodies = " and ".join(run.bodies) if len(run.bodies) < 3 else f"{len(run.bodies)} bodies"
    when = ", ".join(f"{t:.3f}" for t in times)
    seen = f"at t = {when} s, with the outlines of {bodies}"
    joints = " A circle marks a joint." if any(run.joint_of) else ""
    alternative = (
        f"Contours of the speed with streamlines, 0 to {number(flow.speed)} m/s, above contours of the "
        f"vorticity, ±{number(flow.vorticity)} 1/s, {seen}."
    )
    caption = (
        f"Flow of {flow.provider} {seen}. Above: speed and streamlines. Below: vorticity, red turns "
        f"counter-clockwise.{joints} One scale for all times; where it ends in a tip, values lie beyond. "
        f"The log holds {len(flow.t)} frames."
    )
    source = f"data:image/png;base64,{base64.b64encode(data).decode('ascii')}"
    return (
        '<figure class="gallery"><h2>Flow</h2><div class="wide" tabindex="0">'
        f'<img src="{source}" width="{width}" height="{height}" alt="{escape(alternative)}"></div>'
        f"<figcaption>{escape(caption)}</figcaption></figure>"
    )
