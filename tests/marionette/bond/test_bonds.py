from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bunraku.marionette.marionettes import StagedPose
from bunraku.marionette.ownership import LimbGrant, LimbInput, LimbPair
from tests.marionette.bond.bonded_stage import FRAME_INTERVAL_US, BondedStage, random_dance

FRAMES = 150


def duo(seed: int, distance: float = 0.6) -> list[list[StagedPose]]:
    random = np.random.default_rng(seed)
    return [
        random_dance(FRAMES, random, (0.0, 0.9, 0.0), 0.0),
        random_dance(FRAMES, random, (0.0, 0.9, distance), 3.14),
    ]


class Puppeteers:
    """Puppeteers of a bonded stage by limb, and their inputs."""

    def __init__(self, stage: BondedStage) -> None:
        self.ownership = stage.ownership
        self.epochs: dict[int, int] = {}
        self.names: dict[int, str] = {}
        self.sequence = 0

    def claim(self, limb: int, name: str, now: int) -> None:
        grant = self.ownership.claim(limb, name, now)
        assert isinstance(grant, LimbGrant)
        self.epochs[limb], self.names[limb] = grant.epoch, name

    def target(self, limb: int, values: tuple[float, float, float], now: int) -> None:
        self.sequence += 1
        sample = LimbInput(limb, 1, self.epochs[limb], self.sequence, now, values)
        self.ownership.apply_input(self.names[limb], sample, now)

    def keep_alive(self, now: int) -> None:
        for limb, name in self.names.items():
            self.ownership.keep_alive(name, [limb], now)


@settings(max_examples=12, deadline=None)
@given(st.integers(0, 10_000), st.sampled_from([(0, 1), (0, 5), (1, 4)]))
def test_hands_stay_together_whoever_moves_them(seed: int, pair: LimbPair) -> None:
    random = np.random.default_rng(seed)
    stage = BondedStage(duo(seed)[: 1 if pair[1] < 4 else 2], pair)
    people = Puppeteers(stage)
    people.claim(pair[0], "ada", 0)
    assert stage.ownership.bond(*pair, "ada", 0) is None
    for frame in range(FRAMES):
        now = (frame + 1) * FRAME_INTERVAL_US
        if frame == 60:
            people.claim(pair[1], "bo", now)
        people.keep_alive(now)
        if random.random() < 0.2:
            limb = pair[int(random.integers(2))] if frame > 60 else pair[0]
            side = 1.0 if limb % 4 == 0 else -1.0
            x, y, z = random.uniform((0.0, -0.5, 0.3), (0.4, 0.3, 0.7)).tolist()
            people.target(limb, (side * x, y, z), now)
        stage.show(frame, now)
    state = stage.marionettes.bonds.state(pair)
    assert state is not None
    assert state.is_joined
    assert max(stage.gaps_mm()[50:]) < 5.0


def test_bond_ends_when_the_dancers_part_and_the_led_hand_returns() -> None:
    dances = duo(3)
    parting = [(root + np.array([0.0, 0.0, 0.02 * frame]), turns) for frame, (root, turns) in enumerate(dances[1])]
    stage = BondedStage([dances[0], parting], (0, 5))
    people = Puppeteers(stage)
    people.claim(0, "ada", 0)
    assert stage.ownership.bond(0, 5, "ada", 0) is None
    ended: list[tuple[LimbPair, str]] = []
    for frame in range(FRAMES):
        now = (frame + 1) * FRAME_INTERVAL_US
        people.keep_alive(now)
        stage.show(frame, now)
        ended += [(bond.limbs, reason) for bond, reason in stage.ownership.take_ended_bonds()]
    assert ended == [((0, 5), "apart")]
    assert stage.ownership.bonds == ()
    assert stage.ownership.holders()[0] == "ada"
    assert stage.ownership.target(5) is None
    assert set(stage.overlays[-1]) == {0}


def test_hands_of_dancers_out_of_reach_are_not_bonded() -> None:
    stage = BondedStage(duo(4, distance=2.5), (0, 5))
    people = Puppeteers(stage)
    people.claim(0, "ada", 0)
    assert stage.ownership.bond(0, 5, "ada", 0) is None
    stage.show(0, FRAME_INTERVAL_US)
    assert [(bond.limbs, reason) for bond, reason in stage.ownership.take_ended_bonds()] == [((0, 5), "apart")]


def test_release_ends_the_bond_and_moves_no_hand_at_once() -> None:
    stage = BondedStage(duo(5), (0, 5))
    people = Puppeteers(stage)
    people.claim(0, "ada", 0)
    assert stage.ownership.bond(0, 5, "ada", 0) is None
    for frame in range(FRAMES):
        now = (frame + 1) * FRAME_INTERVAL_US
        people.keep_alive(now)
        if frame == 70:
            stage.ownership.release(0, "ada", people.epochs.pop(0), now)
            people.names.clear()
        stage.show(frame, now)
    assert [(bond.limbs, reason) for bond, reason in stage.ownership.take_ended_bonds()] == [((0, 5), "released")]
    assert stage.ownership.is_at_rest
    for side in (0, 1):
        assert max(stage.accelerations(side)[66:90]) < 82.0


def test_silent_holder_follows_and_takes_over_from_the_place_of_the_pair() -> None:
    stage = BondedStage(duo(6), (0, 5))
    people = Puppeteers(stage)
    people.claim(0, "ada", 0)
    assert stage.ownership.bond(0, 5, "ada", 0) is None
    people.claim(5, "bo", 0)
    people.target(5, (-0.3, 0.0, 0.5), 0)
    for frame in range(FRAMES):
        now = (frame + 1) * FRAME_INTERVAL_US
        people.keep_alive(now)
        if frame >= 20:
            people.target(0, (0.2, 0.0, 0.5), now)
        stage.show(frame, now)
    target = stage.ownership.target(5)
    assert target is not None
    goal = target.value_at(FRAMES * FRAME_INTERVAL_US)
    first = stage.ownership.target(0)
    assert goal is not None
    assert first is not None
    # the goal of the silent holder has followed: it no longer pulls the pair back
    state = stage.marionettes.bonds.state((0, 5))
    assert state is not None
    assert state.share > 0.9
    assert max(stage.gaps_mm()[60:]) < 5.0
    assert goal != pytest.approx((-0.3, 0.0, 0.5), abs=1e-3)


def test_change_of_figures_keeps_the_bond() -> None:
    stage = BondedStage(duo(7), (0, 5))
    people = Puppeteers(stage)
    people.claim(0, "ada", 0)
    assert stage.ownership.bond(0, 5, "ada", 0) is None
    for frame in range(FRAMES):
        now = (frame + 1) * FRAME_INTERVAL_US
        people.keep_alive(now)
        if frame == 60:
            stage.marionettes.set_figures([stage.figure] * 2)
        stage.show(frame, now)
    assert stage.ownership.bonds == ((0, 5),)
    assert max(stage.gaps_mm()[110:]) < 5.0


def test_equal_commands_give_equal_overlays_to_the_last_bit() -> None:
    overlays = []
    for _ in range(2):
        stage = BondedStage(duo(8), (1, 4))
        people = Puppeteers(stage)
        people.claim(1, "ada", 0)
        assert stage.ownership.bond(1, 4, "ada", 0) is None
        for frame in range(60):
            now = (frame + 1) * FRAME_INTERVAL_US
            people.target(1, (-0.2 - 0.002 * frame, 0.1, 0.5), now)
            stage.show(frame, now)
        overlays.append(stage.overlays)
    assert overlays[0] == overlays[1]
