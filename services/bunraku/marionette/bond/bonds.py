"""Bonds of one stage: each frame they move the bonded hands."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import inf

from bunraku.marionette.bond.bond import Bond, BondedHand, is_in_reach, recency_share
from bunraku.marionette.bond.bonded_arm import BondedArm, settle
from bunraku.marionette.constants import MIN_SHARE
from bunraku.marionette.ownership import LIMBS_PER_PERFORMER, LimbPair, Ownership
from bunraku.marionette.solver.vector import Vector
from bunraku.motion.rotation import Array

ArmFactory = Callable[[int, Vector], BondedArm]
"""Function that returns the arm of a hand by its limb number, for the position of its performer's root (metres)."""


class Bonds:
    """State of the bonds that `Ownership` lists."""

    def __init__(self, ownership: Ownership) -> None:
        self._ownership = ownership
        self._states: dict[LimbPair, Bond] = {}

    def state(self, pair: LimbPair) -> Bond | None:
        """Return the state of a bond, None before its first frame."""
        return self._states.get(pair)

    def reset(self) -> None:
        """Forget the state: each bond begins anew from the places of its hands."""
        self._states.clear()

    def compute_places(self, arm_of: ArmFactory, roots: Sequence[Array], now: int) -> dict[int, Vector]:
        """Return the places of the bonded hands at clock time `now` (µs) by limb; end the bonds that are stretched.

        `roots` (3,) are the positions of each performer's root on the stage, metres.
        """
        pairs = self._ownership.bonds
        self._states = {pair: state for pair, state in self._states.items() if pair in pairs}
        places: dict[int, Vector] = {}
        for pair in pairs:
            if pair[1] < LIMBS_PER_PERFORMER * len(roots):
                first, second = (arm_of(limb, _root_of(limb, roots)) for limb in pair)
                places |= self._move(pair, first, second, now)
        return places

    def _move(self, pair: LimbPair, first: BondedArm, second: BondedArm, now: int) -> dict[int, Vector]:
        hands = (
            BondedHand(first.shoulder, self._goal(pair[0], now)),
            BondedHand(second.shoulder, self._goal(pair[1], now)),
        )
        share = self._share(pair, now)
        state = self._states.get(pair)
        is_kept = is_in_reach(first.shoulder, second.shoulder)
        if is_kept and state is None:
            state = self._states[pair] = Bond(hands, (first.motion, second.motion), share)
        elif is_kept and state is not None:
            is_kept = state.step(hands, share, first.seconds)
        if not is_kept or state is None:
            self._ownership.end_bond(pair, "apart")
            return {}
        positions = state.positions
        if state.is_joined:
            settled = settle(first, second, positions[0])
            state.stay_at(settled)
            positions = (settled, settled)
        places = {
            limb: arm.shoulder.to_place(position)
            for limb, arm, position in zip(pair, (first, second), positions, strict=True)
        }
        for limb, weight in zip(pair, (state.share, 1.0 - state.share), strict=True):
            target = self._ownership.target(limb)
            if weight < MIN_SHARE and target is not None and self._ownership.holders()[limb] is not None:
                target.follow(places[limb])
        return places

    def _goal(self, limb: int, now: int) -> Vector | None:
        target = self._ownership.target(limb)
        return target.value_at(now) if target is not None and self._ownership.holders()[limb] is not None else None

    def _share(self, pair: LimbPair, now: int) -> float:
        """Return the weight of the first hand's goal: all of it if the second hand is led."""
        holders = self._ownership.holders()
        if None in (holders[pair[0]], holders[pair[1]]):
            return float(holders[pair[0]] is not None)
        return recency_share(self._age_s(pair[0], now), self._age_s(pair[1], now))

    def _age_s(self, limb: int, now: int) -> float:
        target = self._ownership.target(limb)
        age_us = target.input_age_us(now) if target is not None else None
        return inf if age_us is None else age_us * 1e-6


def _root_of(limb: int, roots: Sequence[Array]) -> Vector:
    x, y, z = roots[limb // LIMBS_PER_PERFORMER].tolist()
    return (x, y, z)
