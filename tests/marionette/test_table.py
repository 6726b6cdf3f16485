from __future__ import annotations

import numpy as np
import pytest

from bunraku.marionette import arm, table
from bunraku.marionette.proportions import OUTER_RADIUS, Proportions, ProportionsError
from tests.marionette.arms import ARMS


@pytest.mark.parametrize("proportions", ARMS, ids=lambda p: p.identity)
def test_nodes_are_the_lowest_of_a_fine_search(proportions: Proportions) -> None:
    built = table.build_table(proportions)
    assert built.shape == (arm.SIDE, arm.SIDE)
    assert built.dtype == np.float16
    u = np.arange(0, arm.SIDE, 7) / (arm.SIDE - 1)
    v = np.arange(0, arm.SIDE, 7) / (arm.SIDE - 1)
    r = np.minimum(1.0 - (1.0 - proportions.inner_radius) * (1.0 - u[:, None]) ** 2, OUTER_RADIUS) + 0.0 * v
    beta = (v - 0.5) * np.pi + 0.0 * r
    low, high = arm.bend_limits(proportions, r)
    shares = np.linspace(0.0, 1.0, 2001)[:, None, None]
    lowest = np.argmin(table.potential(proportions, r, beta, low + shares * (high - low)), axis=0) / 2000.0
    off = np.abs(built[::7, ::7].astype(np.float64) - lowest) * (high - low)
    assert float(np.degrees(off).max()) < 0.1


def test_bytes_round_trip_and_fit_the_papers_size() -> None:
    stored = table.table_of(ARMS[0].identity)
    data = table.to_bytes(stored)
    assert len(data) == table.TABLE_BYTES == 8192
    assert np.array_equal(table.from_bytes(data), stored)


def test_bad_bytes_are_refused() -> None:
    with pytest.raises(ValueError, match="8192 bytes"):
        table.from_bytes(b"\0" * 8191)
    with pytest.raises(ValueError, match=r"0\.\.1"):
        table.from_bytes(np.full((64, 64), np.nan, "<f2").tobytes())


def test_table_of_builds_once_and_refuses_what_no_arm_has() -> None:
    first = table.table_of(ARMS[1].identity)
    assert table.table_of(ARMS[1].identity) is first
    assert not first.flags.writeable
    with pytest.raises(ProportionsError):
        table.table_of("1-2-3")
