from __future__ import annotations

import numpy as np
import pytest

from bunraku.marionette import arm, table
from bunraku.marionette.links import SIDE
from bunraku.marionette.proportions import OUTER_RADIUS, Proportions, ProportionsError
from tests.marionette.arms import ARMS


@pytest.mark.parametrize("proportions", ARMS, ids=lambda p: p.identity)
def test_nodes_are_the_lowest_of_a_fine_search(proportions: Proportions) -> None:
    built = table.build_table(proportions)
    assert built.shape == (SIDE, SIDE)
    assert built.dtype == np.float16
    r, beta = (places[::7, ::7] for places in table.nodes(proportions))
    low, high = arm.bend_limits(proportions, r)
    shares = np.linspace(0.0, 1.0, 2001)[:, None, None]
    lowest = np.argmin(table.potential(proportions, r, beta, low + shares * (high - low)), axis=0) / 2000.0
    least, greatest = np.sin(0.5 * low), np.sin(0.5 * high)
    bend = 2.0 * np.arcsin(least + built[::7, ::7].astype(np.float64) * (greatest - least))
    assert float(np.degrees(np.abs(bend - low - lowest * (high - low))).max()) < 0.1


@pytest.mark.parametrize("proportions", ARMS, ids=lambda p: p.identity)
def test_a_lookup_at_a_node_is_the_node(proportions: Proportions) -> None:
    built = table.build_table(proportions)
    one = arm.Arm(proportions, built)
    distances, elevations = table.nodes(proportions)
    assert distances[0, 0] == pytest.approx(proportions.inner_radius, abs=1e-12)
    assert distances[-1, 0] == OUTER_RADIUS
    assert elevations[0, [0, -1]] == pytest.approx([-np.pi / 2.0, np.pi / 2.0])
    for i, j in [(0, 0), (0, 63), (5, 17), (31, 31), (32, 32), (47, 3), (62, 60)]:
        r, beta = float(distances[i, j]), float(elevations[i, j])
        least, greatest = np.sin(0.5 * np.array(one.limits(r)))
        assert (np.sin(0.5 * one.bend(r, beta)) - least) / (greatest - least) == pytest.approx(
            float(built[i, j]), abs=1e-9
        )


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
