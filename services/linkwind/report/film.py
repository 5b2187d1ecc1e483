"""The flow behind the animation: a small grey picture of each frame, coloured in the browser.

Grey carries the value on the scale of the quantity; lossy WebP needs 1 to 4 kB a picture where a palette or
colours with transparency need several times as much.
"""

from __future__ import annotations

import base64
import io
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from linkwind.frames import FlowFrame, Single
from linkwind.report.arrays import every_nth, pack
from linkwind.report.flow import Flow, speed
from linkwind.report.pictures import SPEED_COLOURS, VORTICITY_COLOURS

FRAMES = 96  # on the page
CELLS = 288  # along the longer side of a picture; of a larger frame every second or third cell
QUALITIES = (70, 50, 35, 20)  # of the pictures: the first with which all of them fit
ROOM = 330_000  # characters of all pictures
GREY = 255  # levels above 0

Bytes = NDArray[np.uint8]


class Quantity(NamedTuple):
    """One way to look at the flow: its unit, ends of the scale, and what it is of a frame."""

    unit: str
    low: float
    high: float
    colours: Bytes
    values: Callable[[FlowFrame], Single]


def film(flow: Flow) -> dict[str, Any]:
    """Return what the animation needs: times, places and pictures of the frames, and their colours."""
    chosen = every_nth(len(flow.t), FRAMES)
    shown = quantities(flow)
    pictures: dict[str, list[str]] = {name: [] for name in shown}
    quality = _quality(flow, list(shown.values()), len(chosen))
    extents = []
    for frame in flow.some(chosen):
        extents.append(frame.extent)
        for name, quantity in shown.items():
            pictures[name].append(_webp(quantity, frame, quality))
    return {
        "provider": flow.provider,
        "t": pack(flow.t[chosen], "f8"),
        "extent": pack(np.array(extents), "f8"),
        "quantities": {
            name: described(quantity) | {"pictures": pictures[name]} for name, quantity in shown.items()
        },
    }


def quantities(flow: Flow) -> dict[str, Quantity]:
    """Return what can be seen of a flow, by name."""
    top, fast = flow.vorticity, flow.speed
    return {
        "vorticity": Quantity("1/s", -top, top, vorticity_colours(), lambda frame: frame.vorticity),
        "speed": Quantity("m/s", 0.0, fast, speed_colours(), speed),
    }


def described(quantity: Quantity) -> dict[str, Any]:
    """Return what the page has to know of a quantity to colour its pictures."""
    return {
        "unit": quantity.unit,
        "low": quantity.low,
        "high": quantity.high,
        "colours": base64.b64encode(quantity.colours.tobytes()).decode("ascii"),
    }


def _quality(flow: Flow, quantities: list[Quantity], count: int) -> int:
    """Return the quality of the pictures, told from the last frame, which has the longest wake."""
    (last,) = flow.some(np.array([len(flow.t) - 1]))
    for quality in QUALITIES:
        if count * sum(len(_webp(quantity, last, quality)) for quantity in quantities) <= ROOM:
            break
    return quality


def _webp(quantity: Quantity, frame: FlowFrame, quality: int) -> str:
    return base64.b64encode(picture(quantity, frame, quality, effort=6)).decode("ascii")


def picture(
    quantity: Quantity, frame: FlowFrame, quality: int, *, cells: int = CELLS, effort: int = 2
) -> bytes:
    """Return a frame as a grey WebP, the highest y at the top; what is no number is 0.

    Args:
        quantity: what of the frame.
        frame: of the fluid.
        quality: of the picture, 0 to 100.
        cells: at most, along the longer side.
        effort: to make it small, 0 to 6.
    """
    from PIL import Image

    stride = -(-max(frame.shape) // cells)
    values = quantity.values(frame)[::stride, ::stride]
    share = np.nan_to_num((values - quantity.low) / (quantity.high - quantity.low))
    grey = np.round(np.clip(share, 0.0, 1.0) * GREY).astype(np.uint8)[::-1]
    data = io.BytesIO()
    Image.fromarray(grey).convert("RGB").save(data, "WEBP", quality=quality, method=effort)
    return data.getvalue()


def vorticity_colours() -> Bytes:
    """Return red, green, blue and opacity of each grey level, uint8, shape (256, 4); clear around 0."""
    colours = _sampled(VORTICITY_COLOURS)
    share = np.abs(np.linspace(-1.0, 1.0, GREY + 1))
    colours[:, 3] = np.round(230.0 * np.clip((share - 0.05) / 0.35, 0.0, 1.0))
    return colours


def speed_colours() -> Bytes:
    """Return red, green, blue and opacity of each grey level, uint8, shape (256, 4)."""
    colours = _sampled(SPEED_COLOURS)
    colours[:, 3] = 190
    return colours


def _sampled(name: str) -> Bytes:
    from matplotlib import colormaps

    sampled: Bytes = colormaps[name](np.linspace(0.0, 1.0, GREY + 1), bytes=True)
    return sampled
