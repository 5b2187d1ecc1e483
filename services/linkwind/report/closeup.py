"""The part of a frame of the flow around the mechanism: the window of the fluid reaches much further."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from linkwind.frames import FlowFrame
from linkwind.report.data import Run
from linkwind.scenario.shapes import shape_of
from linkwind.spatial import Array

AROUND = 2.5  # lengths of the longest body to show on every side of the mechanism
FEWEST = 16  # cells along a side of a picture


def closeups(run: Run, frames: list[FlowFrame]) -> list[FlowFrame]:
    """Return the frames cut to what is around the mechanism, all of one size where they reach that far."""
    shapes = [shape_of(body.get("shape")) for body in run.scenario["bodies"]]
    lengths = [shape.reference_length for shape in shapes if shape is not None]
    centres = [_positions(run, frame) for frame in frames]
    if not lengths or any(centre is None for centre in centres):
        return frames
    boxes = [(positions.min(axis=0), positions.max(axis=0)) for positions in centres if positions is not None]
    reach = max(0.5 * float((high - low).max()) for low, high in boxes) + 0.5 * max(lengths)
    half = reach + AROUND * max(lengths)
    return [_cut(frame, 0.5 * (low + high), half) for frame, (low, high) in zip(frames, boxes, strict=True)]


def _positions(run: Run, frame: FlowFrame) -> Array | None:
    """Return the centres of mass at the time of a frame, shape (n, 2), or None where the log lacks them."""
    path = run.trajectory
    found = int(np.searchsorted(path.step, frame.step))
    if found == len(path.step) or path.step[found] != frame.step:
        return None
    return np.asarray(path.position[found, :, :2])


def _cut(frame: FlowFrame, centre: Array, half: float) -> FlowFrame:
    """Return the cells within ``half`` [m] of a point, x and y apart."""
    ranges = []
    for middle, first, count in zip(centre, frame.origin, reversed(frame.shape), strict=True):
        low = max(0, int(np.ceil((middle - half - first) / frame.cell)))
        high = min(count, int(np.floor((middle + half - first) / frame.cell)) + 1)
        ranges.append((low, high) if high - low >= FEWEST else (0, count))
    (left, right), (bottom, top) = ranges
    here = (slice(bottom, top), slice(left, right))
    x, y = frame.origin
    return replace(
        frame,
        origin=(x + left * frame.cell, y + bottom * frame.cell),
        velocity=frame.velocity[here],
        pressure=frame.pressure[here],
        vorticity=frame.vorticity[here],
    )
