"""Arrays on their way into the page: thinned for display, and packed into JSON."""

from __future__ import annotations

import base64
from typing import Any

import numpy as np
from numpy.typing import NDArray

from linkwind.spatial import Array


def pack(array: NDArray[Any], dtype: str = "f4") -> dict[str, str]:
    """Return an array as base64 of little-endian numbers, in row-major order.

    Unlike JSON numbers this carries NaN and infinity, and costs 5.3 bytes a number.
    """
    with np.errstate(over="ignore"):  # a run that diverged: infinite on the page
        raw = np.ascontiguousarray(array, dtype=np.dtype(dtype).newbyteorder("<"))
    return {"dtype": dtype, "bdata": base64.b64encode(raw.tobytes()).decode("ascii")}


def every_nth(count: int, limit: int) -> NDArray[np.intp]:
    """Return at most ``limit`` indices of ``count`` samples, evenly spread, with the first and the last."""
    if count <= limit:
        return np.arange(count)
    return np.unique(np.round(np.linspace(0, count - 1, limit)).astype(np.intp))


def peaks(y: Array, limit: int) -> NDArray[np.intp]:
    """Return at most ``limit`` ascending indices that keep the extremes of a curve.

    The samples are cut into equal intervals, and of each the smallest and the largest stay, so that no
    peak gets lost, however narrow; the first and the last sample stay as well. NaN is kept only where a
    whole interval is NaN.
    """
    count = y.size
    if count <= limit:
        return np.arange(count)
    size = -(-count // (limit // 2 - 1))  # samples in an interval
    padded = np.concatenate([y, np.full(-count % size, np.nan)]).reshape(-1, size)
    missing = np.isnan(padded)
    start = np.arange(len(padded)) * size
    lowest = start + np.where(missing, np.inf, padded).argmin(axis=1)
    highest = start + np.where(missing, -np.inf, padded).argmax(axis=1)
    return np.unique(np.concatenate([[0], lowest, highest, [count - 1]]))


def means(t: Array, y: Array, keep: NDArray[np.intp]) -> Array:
    """Return the mean of a curve from each of some of its samples to the next, by the trapezoidal rule.

    Args:
        t: times, ascending, shape (n,).
        y: samples, shape (n,).
        keep: ascending indices of m samples, the first and the last among them.

    Returns:
        means, shape (m - 1,); NaN where samples are, or no time passes.
    """
    with np.errstate(all="ignore"):  # of a run that diverged
        areas = 0.5 * np.diff(t) * (y[1:] + y[:-1])
        return np.asarray(np.add.reduceat(areas, keep[:-1]) / np.diff(t[keep]))
