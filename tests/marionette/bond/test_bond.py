from __future__ import annotations

from itertools import pairwise
from math import inf

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bunraku.marionette.bond.bond import Bond, BondedHand, HandMotion, HandPair, is_in_reach, recency_share
from bunraku.marionette.bond.carrier import Shoulder
from bunraku.marionette.constants import BOND_BORDER_MARGIN, HAND_ACCELERATION, MAX_REACH, RECENCY_HALF_LIFE_S
from bunraku.marionette.solver import vector
from bunraku.marionette.solver.vector import ZERO, Vector

FRAME_S = 1.0 / 60.0
ARM_M = 0.65
ages = st.floats(0.0, 100.0)


def shoulder(x: float, turn: float = 0.0) -> Shoulder:
    return Shoulder((x, 1.4, 0.0), vector.from_axis_angle((0.0, 1.0, 0.0), turn), ARM_M, 0.12)


def pair(apart: float, first: Vector | None, second: Vector | None) -> HandPair:
    return BondedHand(shoulder(0.0), first), BondedHand(shoulder(apart, 3.14), second)


def still(place: Vector) -> HandMotion:
    return HandMotion(place, ZERO)


def random_place(random: np.random.Generator) -> Vector:
    x, y, z = random.normal(size=3).tolist()
    return vector.scale(vector.unit((x, y, z), (1.0, 0.0, 0.0)), float(random.uniform(0.2, 1.0)))


@given(ages, ages)
def test_shares_of_both_goals_add_up_to_one(first: float, second: float) -> None:
    assert recency_share(first, second) + recency_share(second, first) == pytest.approx(1.0)
    assert recency_share(first, first + RECENCY_HALF_LIFE_S) == pytest.approx(2.0 / 3.0)


def test_goal_that_was_never_set_has_no_share() -> None:
    assert [recency_share(*pair) for pair in ((inf, 3.0), (3.0, inf), (inf, inf))] == [0.0, 1.0, 0.5]


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 100_000), st.floats(0.2, 1.1), st.sampled_from([(True, True), (True, False), (False, True)]))
def test_hands_meet_within_700_ms_and_stay_at_a_bounded_acceleration(
    seed: int, apart: float, leads: tuple[bool, bool]
) -> None:
    random = np.random.default_rng(seed)
    goals: list[Vector | None] = [random_place(random) if leads[side] else None for side in (0, 1)]
    hands = pair(apart, goals[0], goals[1])
    share = 0.5 if all(leads) else float(leads[0])
    bond = Bond(hands, (still((0.5, -0.4, 0.2)), still((-0.3, -0.5, 0.3))), share)
    shown = [bond.positions]
    for frame in range(150):
        for side in (0, 1):
            if leads[side] and random.random() < 0.1:
                goals[side] = random_place(random)
        hands = pair(apart, goals[0], goals[1])
        assert bond.step(hands, share, FRAME_S)
        shown.append(bond.positions)
        if frame > 42:
            assert bond.is_joined
            assert bond.positions[0] == bond.positions[1]
            for hand in hands:
                distance = vector.length(vector.subtract(bond.positions[0], hand.shoulder.position))
                assert distance <= MAX_REACH * ARM_M + 1e-8
    for side in (0, 1):
        steps = [vector.subtract(b[side], a[side]) for a, b in pairwise(shown)]
        changes = [vector.length(vector.subtract(b, a)) / FRAME_S**2 / ARM_M for a, b in pairwise(steps)]
        assert max(changes) <= HAND_ACCELERATION + 1.0


def test_pair_stops_at_the_mean_of_both_goals() -> None:
    hands = pair(0.8, (0.6, 0.0, 0.4), (0.6, 0.3, -0.4))
    bond = Bond(hands, (still((0.5, 0.0, 0.2)), still((0.5, 0.0, 0.2))), 0.5)
    for _ in range(120):
        bond.step(hands, 0.5, FRAME_S)
    goals = [hand.shoulder.to_world(hand.goal) for hand in hands if hand.goal]
    mean = vector.scale(vector.add(goals[0], goals[1]), 0.5)
    assert vector.length(vector.subtract(bond.positions[0], mean)) < 1e-9


def test_newer_goal_wins_without_a_jump_of_the_weight() -> None:
    hands = pair(0.8, (0.6, 0.0, 0.4), (0.6, 0.3, -0.4))
    bond = Bond(hands, (still((0.5, 0.0, 0.2)), still((0.5, 0.0, 0.2))), 0.0)
    shares = [bond.share]
    for _ in range(60):
        bond.step(hands, 1.0, FRAME_S)
        shares.append(bond.share)
    assert max(b - a for a, b in pairwise(shares)) < 0.25
    assert shares[-1] > 0.999


def test_goal_out_of_reach_is_approached_along_the_border() -> None:
    hands = pair(0.9, (0.7, 2.0, 0.0), None)
    bond = Bond(hands, (still((0.7, 0.0, 0.0)), still((0.7, 0.0, 0.0))), 1.0)
    for _ in range(90):
        bond.step(hands, 1.0, FRAME_S)
    distances = [vector.length(vector.subtract(bond.positions[0], hand.shoulder.position)) for hand in hands]
    # the highest point that both arms reach is on both borders
    assert distances == pytest.approx([(MAX_REACH - BOND_BORDER_MARGIN) * ARM_M] * 2, abs=1e-6)


def test_shoulders_beyond_two_arms_end_the_bond() -> None:
    hands = pair(1.1, (0.7, 0.0, 0.0), None)
    bond = Bond(hands, (still((0.7, 0.0, 0.0)), still((0.7, 0.0, 0.0))), 1.0)
    assert is_in_reach(hands[0].shoulder, hands[1].shoulder)
    assert bond.step(hands, 1.0, FRAME_S)
    before = bond.positions
    apart = pair(1.31, (0.7, 0.0, 0.0), None)
    assert not is_in_reach(apart[0].shoulder, apart[1].shoulder)
    assert not bond.step(apart, 1.0, FRAME_S)
    assert bond.positions == before


def test_step_of_zero_duration_moves_nothing() -> None:
    hands = pair(0.8, (0.6, 0.0, 0.4), None)
    bond = Bond(hands, (still((0.5, 0.0, 0.2)), still((0.5, 0.0, 0.2))), 1.0)
    before = bond.positions
    assert bond.step(hands, 1.0, 0.0)
    assert bond.positions == before


def test_bond_without_any_goal_is_refused() -> None:
    hands = pair(0.8, None, None)
    bond = Bond(hands, (still((0.5, 0.0, 0.2)), still((0.5, 0.0, 0.2))), 1.0)
    with pytest.raises(ValueError, match="at least one hand"):
        bond.step(hands, 1.0, FRAME_S)


def test_pair_held_back_by_a_limit_keeps_its_velocity_along_it() -> None:
    hands = pair(0.8, (0.7, 0.3, 0.3), None)
    bond = Bond(hands, (still((0.6, 0.0, 0.0)),) * 2, 1.0)
    for _ in range(60):
        bond.step(hands, 1.0, FRAME_S)
    here = bond.positions[0]
    aside = vector.add(here, (0.0, 0.0, -0.01))
    limited = []
    for position in (here, aside):
        bond.stay_at(position)
        limited.append(bond.is_limited)
    assert limited == [False, True]
    assert bond.positions == (aside, aside)
