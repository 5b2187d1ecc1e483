"""Thinning and packing of curves."""

import base64

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from linkwind.report.arrays import every_nth, means, pack, peaks


@given(st.integers(0, 400), st.integers(2, 60))
def test_every_nth_spreads_evenly_and_keeps_both_ends(count, limit):
    kept = every_nth(count, limit)
    assert len(kept) == min(count, limit)
    if count:
        assert (kept[0], kept[-1]) == (0, count - 1)
        gaps = np.diff(kept)
        assert gaps.size == 0 or gaps.max() - gaps.min() <= 1


@given(st.lists(st.floats(allow_infinity=False), max_size=400), st.integers(6, 60))
def test_peaks_keep_the_extremes(values, limit):
    y = np.array(values, dtype=float)
    kept = peaks(y, limit)
    assert len(kept) <= max(limit, 0)
    assert np.all(np.diff(kept) > 0)
    if y.size:
        assert {0, y.size - 1} <= set(kept.tolist())
    if np.isfinite(y).any():
        assert np.nanmax(y[kept]) == np.nanmax(y)
        assert np.nanmin(y[kept]) == np.nanmin(y)


@pytest.mark.parametrize("count", [1999, 2000, 2001, 3001, 120_000])
def test_peaks_stay_within_the_limit(count):
    kept = peaks(np.sin(np.arange(count)), 2000)
    assert len(kept) <= 2000
    assert len(kept) >= min(count, 1000)


def test_a_gap_of_nan_stays_a_gap():
    y = np.ones(1000)
    y[300:600] = np.nan
    kept = peaks(y, 100)
    inside = y[kept[(kept > 320) & (kept < 580)]]
    assert inside.size > 5
    assert np.isnan(inside).all()


@pytest.mark.parametrize("dtype", ["f4", "f8"])
def test_packed_numbers_are_little_endian(dtype):
    values = np.array([[1.5, np.nan], [-np.inf, 2.0]])
    packed = pack(values.astype(">f8"), dtype)
    assert packed["dtype"] == dtype
    read = np.frombuffer(base64.b64decode(packed["bdata"]), "<" + dtype)
    np.testing.assert_array_equal(read, values.ravel())


def test_a_number_too_large_for_the_page_becomes_infinite():
    read = np.frombuffer(base64.b64decode(pack(np.array([1e300]))["bdata"]), "<f4")
    assert read[0] == np.inf


def test_means_between_the_points_of_a_thinned_curve_are_those_of_all_samples():
    t = np.cumsum(np.random.default_rng(7).uniform(0.5, 1.5, 5000))
    y = np.where(np.arange(5000) % 41 == 0, 30.0, np.sin(t))  # spikes, which thinning prefers
    keep = peaks(y, 200)
    found = means(t, y, keep)
    whole = np.sum(0.5 * np.diff(t) * (y[1:] + y[:-1])) / (t[-1] - t[0])
    assert found @ np.diff(t[keep]) / (t[-1] - t[0]) == pytest.approx(whole, rel=1e-12)
    assert np.sum(np.diff(t[keep]) * (y[keep][1:] + y[keep][:-1]) / 2) / (t[-1] - t[0]) > 3 * whole


def test_a_sample_that_is_missing_spoils_the_mean_around_it_only():
    y = np.ones(9)
    y[5] = np.nan
    found = means(np.arange(9.0), y, np.arange(0, 9, 2))
    assert np.flatnonzero(np.isnan(found)).tolist() == [2]
