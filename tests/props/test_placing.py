from __future__ import annotations

import math

import numpy as np
import pytest

from bunraku.props.placing import Grip, find_form, place_prop
from tests.props.samples import box


@pytest.mark.parametrize(
    ("height", "length", "guess"),
    [
        (0.6, 0.6, None),
        (4.0, 4.0, None),
        (60.0, 0.6, "centimetres"),
        (900.0, 0.9, "millimetres"),
        (1e5, 0.4, "unknown"),
    ],
)
def test_other_units_than_metres_are_recognised(height: float, length: float, guess: str | None) -> None:
    placing = place_prop(box(height / 10, height, height / 10)[0])
    assert np.ptp(placing.positions[:, 1]) == pytest.approx(length)
    assert len(placing.guessed) == (guess is not None)
    assert guess is None or guess in placing.guessed[0]


def test_length_is_that_of_the_longest_side() -> None:
    placing = place_prop(box(3.0, 60.0, 3.0)[0], length=1.5)
    assert np.ptp(placing.positions, axis=0) == pytest.approx([0.075, 1.5, 0.075])
    assert placing.guessed == []


@pytest.mark.parametrize(
    ("grip", "bottom", "expected"),
    [(None, -0.1, -0.1), (Grip.ORIGIN, 5.0, 5.0), (Grip.MIDDLE, 5.0, -0.3), (Grip.BOTTOM, 5.0, 0.0), (None, 5.0, -0.3)],
)
def test_prop_is_held_where_it_is_wanted(grip: Grip | None, bottom: float, expected: float) -> None:
    placing = place_prop(box(0.05, 0.6, 0.05, bottom)[0], grip=grip)
    assert placing.positions[:, 1].min() == pytest.approx(expected)
    assert len(placing.guessed) == (grip is None and bottom > 0.0)


def test_slender_prop_lies_on_its_front_and_others_stand() -> None:
    staff = find_form(*box(0.04, 0.6, 0.06, -0.1))
    assert [staff.pitch, staff.height] == pytest.approx([math.pi / 2, 0.03])
    crate = find_form(*box(0.3, 0.3, 0.3, -0.15))
    assert [crate.pitch, crate.height] == pytest.approx([0.0, 0.15])


@pytest.mark.parametrize(("width", "expected"), [(0.05, 0.0), (0.3, 0.16), (3.0, 0.5)])
def test_what_is_too_thick_for_a_hand_lies_in_the_palm(width: float, expected: float) -> None:
    # the corners are far from the hand: its sides count
    assert find_form(*box(width, 0.6, width, -0.3)).palm_offset == pytest.approx(expected)


def test_flat_and_single_points_have_a_form() -> None:
    flat = np.array([[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.0, 0.1]])
    assert find_form(flat, np.array([[0, 1, 2]])).height == 0.0
    point = place_prop(np.zeros((3, 3)), length=0.5)
    assert not point.positions.any()
