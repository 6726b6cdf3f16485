from __future__ import annotations

import numpy as np
import pytest

from bunraku.marionette import arm, bend_table
from bunraku.marionette.constants import MAX_TIP_DISTANCE, TABLE_SIDE
from bunraku.marionette.proportions import Proportions, ProportionsError
from tests.marionette.fixtures import ARM_PROPORTIONS


@pytest.mark.parametrize("proportions", ARM_PROPORTIONS, ids=lambda p: p.identity)
def test_nodes_equal_the_minimum_of_a_fine_search(proportions: Proportions) -> None:
    built = bend_table.build_bend_table(proportions)
    assert built.shape == (TABLE_SIDE, TABLE_SIDE)
    assert built.dtype == np.float16
    r, beta = (coordinates[::7, ::7] for coordinates in bend_table.node_coordinates(proportions))
    low, high = arm.wrist_bend_limits(proportions, r)
    shares = np.linspace(0.0, 1.0, 2001)[:, None, None]
    lowest = np.argmin(bend_table.potential(proportions, r, beta, low + shares * (high - low)), axis=0) / 2000.0
    least, greatest = np.sin(0.5 * low), np.sin(0.5 * high)
    bend = 2.0 * np.arcsin(least + built[::7, ::7].astype(np.float64) * (greatest - least))
    assert float(np.degrees(np.abs(bend - low - lowest * (high - low))).max()) < 0.1


@pytest.mark.parametrize("proportions", ARM_PROPORTIONS, ids=lambda p: p.identity)
def test_lookup_at_a_node_returns_the_node(proportions: Proportions) -> None:
    built = bend_table.build_bend_table(proportions)
    solver = arm.Arm(proportions, built)
    distances, elevations = bend_table.node_coordinates(proportions)
    assert distances[0, 0] == pytest.approx(proportions.min_tip_distance, abs=1e-12)
    assert distances[-1, 0] == MAX_TIP_DISTANCE
    assert elevations[0, [0, -1]] == pytest.approx([-np.pi / 2.0, np.pi / 2.0])
    for i, j in [(0, 0), (0, 63), (5, 17), (31, 31), (32, 32), (47, 3), (62, 60)]:
        r, beta = float(distances[i, j]), float(elevations[i, j])
        least, greatest = np.sin(0.5 * np.array(solver.bend_limits(r)))
        assert (np.sin(0.5 * solver.gravity_bend(r, beta)) - least) / (greatest - least) == pytest.approx(
            float(built[i, j]), abs=1e-9
        )


def test_table_round_trips_through_8192_bytes() -> None:
    stored = bend_table.load_bend_table(ARM_PROPORTIONS[0].identity)
    data = bend_table.pack_bend_table(stored)
    assert len(data) == bend_table.TABLE_BYTES == 8192
    assert np.array_equal(bend_table.parse_bend_table(data), stored)


def test_invalid_bytes_raise_value_error() -> None:
    with pytest.raises(ValueError, match="expected 8192"):
        bend_table.parse_bend_table(b"\0" * 8191)
    with pytest.raises(ValueError, match=r"0\.\.1"):
        bend_table.parse_bend_table(np.full((64, 64), np.nan, "<f2").tobytes())


def test_load_caches_tables_and_raises_for_invalid_identities() -> None:
    first = bend_table.load_bend_table(ARM_PROPORTIONS[1].identity)
    assert bend_table.load_bend_table(ARM_PROPORTIONS[1].identity) is first
    assert not first.flags.writeable
    with pytest.raises(ProportionsError):
        bend_table.load_bend_table("1-2-3")
