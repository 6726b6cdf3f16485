from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bunraku.output.dmx import KEEP_ALIVE_INTERVAL_US, REPEATED_PACKETS, Universe, light_levels, parse_layout

ORANGE = np.array([0.0, 3.0, 1.0, 1.0, 0.5, 0.0, 2.0])


@pytest.mark.parametrize(
    ("layout", "levels"),
    [("drgb", [128, 255, 128, 0]), ("rgb", [128, 64, 0]), ("bgrd", [0, 128, 255, 128]), ("d", [128])],
)
def test_layout_orders_the_slots(layout: str, levels: list[int]) -> None:
    assert list(light_levels(ORANGE, 4.0, layout)) == levels


@given(st.lists(st.floats(0.0, 1e6), min_size=7, max_size=7), st.floats(0.0, 1e6))
def test_levels_are_limited(values: list[float], full: float) -> None:
    assert len(light_levels(np.array(values), full, "drgb")) == 4


def test_dark_stage_has_no_division_by_its_intensity() -> None:
    assert light_levels(ORANGE * 0.0, 0.0, "rgb") == bytes(3)


@pytest.mark.parametrize("layout", ["", "rr", "rgbw", "RGB", "r g b"])
def test_invalid_layout_is_rejected(layout: str) -> None:
    with pytest.raises(ValueError, match="letters d"):
        parse_layout(layout)


def test_lights_follow_each_other_from_the_address() -> None:
    universe = Universe(11, "rgb")
    universe.set_lights([ORANGE, ORANGE], 2.0)
    assert universe.levels == bytes(10) + bytes([255, 128, 0]) * 2 + bytes(512 - 16)
    assert len(universe.levels) == 512
    universe.set_lights([None, ORANGE * 0.0], 2.0)
    assert universe.levels[10:16] == bytes([255, 128, 0, 0, 0, 0]), "a light without values keeps its levels"
    universe.set_lights([], 2.0)
    assert universe.levels == bytes(512)


def test_lights_beyond_the_last_slot_are_left_out() -> None:
    universe = Universe(506, "drgb")
    assert universe.capacity == 1
    universe.set_lights([ORANGE] * 3, 2.0)
    assert universe.levels == bytes(505) + bytes([255, 255, 128, 0]) + bytes(3)


def test_unchanged_levels_are_repeated_and_then_kept_alive() -> None:
    universe = Universe(1, "rgb")
    universe.set_lights([ORANGE], 2.0)
    sent = [now for now in range(0, 4_000_000, 25_000) if universe.take_due(now) is not None]
    first = [25_000 * nth for nth in range(1 + REPEATED_PACKETS)]
    assert sent[: len(first)] == first
    intervals = np.diff(sent[len(first) - 1 :])
    assert len(intervals) == 4
    assert set(intervals) == {KEEP_ALIVE_INTERVAL_US}
    universe.set_lights([ORANGE * 0.5], 2.0)
    assert universe.take_due(4_000_001) == universe.levels, "a change is sent at once"


def test_clock_that_is_set_back_does_not_stop_the_packets() -> None:
    universe = Universe(1, "rgb")
    for now in range(10):
        universe.take_due(10**12 + now)
    assert universe.take_due(0) is not None
    assert universe.take_due(1) is None
