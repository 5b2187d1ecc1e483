"""The section of the page with pictures of the flow."""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from html import escape
from typing import Any

from linkwind.log.vortices import SHARE
from linkwind.report.data import Run, largest
from linkwind.report.flow import Flow
from linkwind.report.tables import number
from linkwind.report.volume import Volume
from linkwind.report.wake import Wake
from linkwind.scenario.providers import BEYOND_DEG, SEPARATES_DEG

CELL_REYNOLDS = "cell_reynolds"  # a diagnostic of the flow: of a cell and the fastest of wind and bodies
INCIDENCE = "incidence_deg"  # of vortex: the largest angle of attack
UNRESOLVED = 100  # cell Reynolds number from which boundary layers are thinner than a cell
SPATIAL = 1000  # Reynolds number from which the wake of a bluff body is far from two-dimensional


def gallery(run: Run) -> str:
    """Return the pictures of every provider's flow and wakes; nothing for a run without frames."""
    flows = [_flow(run, flow) for flow in run.flows]
    volumes = [part for volume in run.volumes for part in (_vortices(run, volume), _slice(run, volume))]
    return "\n".join([*flows, *volumes, *(_wake(run, wake) for wake in run.wakes)])


def _limits(run: Run, flow: Flow) -> str:
    """Return the Reynolds number, and what a flow in two dimensions cannot show from some on."""
    reynolds = _reynolds(run, flow.provider)
    if reynolds is None:
        return ""
    spatial = (
        f" Above about {_round(SPATIAL)} a real wake is three-dimensional; in two dimensions, as here, "
        "vortices are stronger, and a bluff body has more drag."
    )
    return _said(reynolds) + spatial * (reynolds >= SPATIAL)


def _said(reynolds: float | None) -> str:
    if reynolds is None:
        return ""
    return (
        f" Reynolds number of the longest body and the fastest of wind and bodies: up to {_round(reynolds)}."
    )


def _thin_layers(run: Run, provider: str) -> str:
    """Return what a flow whose boundary layers are thinner than a cell does not know."""
    of_a_cell = _reported(run, provider, "flow", CELL_REYNOLDS)
    if of_a_cell is None or of_a_cell < UNRESOLVED:
        return ""
    return (
        f" That of a cell is {_round(of_a_cell)}: boundary layers are thinner than a cell, and where the "
        "flow leaves a smooth surface is not known; at edges it is."
    )


def _attached(run: Run, provider: str) -> str:
    """Return the largest angle of attack, and what vortex rings do not know from some on."""
    angle = _reported(run, provider, "vortex", INCIDENCE)
    if angle is None:
        return ""
    beyond = f" From some {SEPARATES_DEG:g}° on a real flow separates, which the model does not know."
    return f" Largest angle of attack: {angle:.0f}°.{beyond * (angle > BEYOND_DEG)}"


def _reynolds(run: Run, provider: str) -> float | None:
    """Return the largest Reynolds number that a model "flow" reports, None for another one."""
    of_a_cell = _reported(run, provider, "flow", CELL_REYNOLDS)
    return None if of_a_cell is None else of_a_cell * float(_settings(run, provider)["flow"]["cells"])


def _reported(run: Run, provider: str, model: str, name: str) -> float | None:
    """Return the largest of one of a provider's own numbers; None if it is of another model, or has none."""
    numbers = next((each for each in run.diagnostics if each.provider == provider), None)
    if _settings(run, provider)["model"] != model or numbers is None or name not in numbers.names:
        return None
    return largest(numbers.values[:, numbers.names.index(name)])


def _settings(run: Run, provider: str) -> Mapping[str, Any]:
    return next(each for each in run.scenario["providers"] if each["name"] == provider)


def _listed(names: Sequence[str]) -> str:
    *others, last = names
    return f"{', '.join(others)} and {last}" if others else last


def _round(value: float) -> str:
    return f"{float(f'{value:.2g}'):,.0f}"


def _flow(run: Run, flow: Flow) -> str:
    from linkwind.report.pictures import png

    data, width, height, times = png(run, flow)
    bodies = " and ".join(run.bodies) if len(run.bodies) < 3 else f"{len(run.bodies)} bodies"
    when = ", ".join(f"{t:.4g}" for t in times)
    seen = f"at t = {when} s, with the outlines of {bodies}"
    joints = " A circle marks a joint." if any(run.joint_of) else ""
    alternative = (
        f"Contours of the speed with streamlines, 0 to {number(flow.speed)} m/s, above contours of the "
        f"vorticity, ±{number(flow.vorticity)} 1/s, {seen}."
    )
    caption = (
        f"Flow of {flow.provider} {seen}. Above: speed and streamlines. Below: vorticity, red turns "
        f"counter-clockwise.{joints} One scale for all times; where it ends in a tip, values lie beyond. "
        f"The log holds {len(flow.t)} frames.{_limits(run, flow)}"
    )
    return _figure("Flow", data, width, height, alternative, caption)


def _vortices(run: Run, volume: Volume) -> str:
    from linkwind.report.volumefilm import AXES
    from linkwind.report.volumepicture import vortices_png

    drawn = vortices_png(run, volume)
    if drawn is None:
        return ""
    data, width, height, times = drawn
    when, axis = ", ".join(f"{t:.4g}" for t in times), AXES[volume.scale.axis]
    about = f"vorticity about {axis}, ±{number(volume.scale.top)} 1/s"
    bodies = _listed(run.bodies) if len(run.bodies) < 4 else f"{len(run.bodies)} bodies"
    alternative = f"Surfaces of the vortices around {bodies} at t = {when} s, coloured by {about}."
    caption = (
        f"Vortices in the fluid of {volume.provider} at t = {when} s, with {bodies} dark, in perspective "
        f"from one side, on one scale. On the surfaces Q = {number(volume.scale.level)} 1/s²: inside, the "
        f"fluid turns by so much more than it strains; this level holds {SHARE:.0%} of all rotation of the "
        f"run. The colour is the vorticity about {axis}, the axis that most of it is about: red and blue "
        f"turn opposite ways. The log holds {len(volume.t)} frames.{_said(_reynolds(run, volume.provider))}"
        f"{_thin_layers(run, volume.provider)}"
    )
    return _figure("Vortices", data, width, height, alternative, caption)


def _slice(run: Run, volume: Volume) -> str:
    from linkwind.report.volumepicture import slice_png

    drawn = slice_png(run, volume)
    if drawn is None:
        return ""
    (data, width, height, times), axis = drawn
    when, scale = ", ".join(f"{t:.4g}" for t in times), f"0 to {number(volume.speed)} m/s"
    seen = f"in a plane of constant {axis} through the middle of the mechanism at t = {when} s"
    alternative = f"Contours of the speed, {scale}, {seen}."
    caption = (
        f"Speed of the fluid of {volume.provider} {seen}; dark: the bodies where they are cut. One scale for "
        "all times; where it ends in a tip, values lie beyond."
    )
    return _figure("Speed", data, width, height, alternative, caption)


def _wake(run: Run, wake: Wake) -> str:
    from linkwind.report.wakepicture import wake_png

    drawn = wake_png(run, wake)
    if drawn is None:
        return ""
    data, width, height, times = drawn
    when, provider = ", ".join(f"{t:.4g}" for t in times), wake.provider
    settings = _settings(run, provider)
    kept = ""
    if settings["model"] == "vortex":
        rows, step = settings["vortex"]["wake"], float(run.scenario["coupling"]["step"])
        kept = f"A wake holds the last {rows} rows, {number(rows * step)} s. "
    wings = _listed(settings["bodies"]) if len(settings["bodies"]) < 4 else f"{len(settings['bodies'])} wings"
    scale = f"±{number(wake.circulation)} m²/s"
    kept += f"The log holds {len(wake.t)} frames.{_attached(run, provider)}"
    alternative = (
        f"Surfaces of vortex rings behind {wings} at t = {when} s, coloured by circulation, {scale}."
    )
    caption = (
        f"Wakes that {wings} shed, at t = {when} s, in perspective from one side, on one scale. Each cell is "
        "a vortex ring that goes with the fluid; its colour is its circulation, which it keeps: red and blue "
        "turn opposite ways, and where it changes from cell to cell there is vorticity. Dark cells are the "
        f"rings on the wings. {kept}"
    )
    return _figure("Wakes", data, width, height, alternative, caption)


def _figure(title: str, data: bytes, width: int, height: int, alternative: str, caption: str) -> str:
    source = f"data:image/png;base64,{base64.b64encode(data).decode('ascii')}"
    return (
        f'<figure class="gallery"><h2>{title}</h2><div class="wide" tabindex="0">'
        f'<img src="{source}" width="{width}" height="{height}" alt="{escape(alternative)}"></div>'
        f"<figcaption>{escape(caption)}</figcaption></figure>"
    )
