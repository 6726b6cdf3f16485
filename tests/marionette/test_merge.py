from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bunraku.marionette.limbs import ArmRig, LegRig, Limb
from bunraku.marionette.merge import Marionette, Overlay, apply
from bunraku.marionette.ownership import Grant, Input, Outcome
from bunraku.marionette.proportions import ProportionsError
from bunraku.motion import rotation
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import Figure, standard_figure
from tests.marionette.arms import dance

FIGURE = standard_figure()
FRAME = 16_667


def granted(puppet: Marionette, limb: int, who: str, now: int) -> int:
    answer = puppet.claim(limb, who, now)
    assert isinstance(answer, Grant)
    return answer.epoch


def steps(merged: Array) -> Array:
    """How far each joint turns from frame to frame, degrees, (frames - 1, 18)."""
    turned = rotation.multiply(rotation.conjugate(merged[:-1]), merged[1:])
    angles: Array = np.degrees(np.linalg.norm(rotation.to_rotation_vector(turned), axis=-1))
    return angles


def test_without_a_hand_on_it_the_dance_is_untouched() -> None:
    poses = dance(30, seed=1)
    puppet = Marionette(FIGURE)
    for i, pose in enumerate(poses):
        overlay = puppet.overlay(pose, i * FRAME)
        assert overlay is None
        assert apply(pose, overlay).tobytes() == pose.tobytes()


@settings(max_examples=20, deadline=None)
@given(st.sets(st.sampled_from(list(Limb)), min_size=1), st.integers(0, 1000))
def test_only_the_pulled_limbs_joints_change(pulled: set[Limb], seed: int) -> None:
    poses = dance(40, seed)
    puppet = Marionette(FIGURE)
    for limb in pulled:
        puppet.input("ada", Input(limb, 1, granted(puppet, limb, "ada", 0), 1, 0, (0.4, 0.1, 0.3)), 0)
    theirs = sorted(joint for limb in pulled for joint in limb.joints)
    others = [joint for joint in range(18) if joint not in theirs]
    for i, pose in enumerate(poses):
        overlay = puppet.overlay(pose, i * FRAME)
        assert overlay is not None
        assert overlay.limbs == tuple(sorted(pulled))
        merged = apply(pose, overlay)
        assert merged[others].tobytes() == pose[others].tobytes()
        np.testing.assert_allclose(np.linalg.norm(merged, axis=1), 1.0, atol=1e-9)


def test_a_held_hand_is_where_it_is_put_and_a_leg_too() -> None:
    poses = dance(40, seed=4)
    puppet = Marionette(FIGURE)
    hand, leg = granted(puppet, 1, "ada", 0), granted(puppet, 2, "bo", 0)
    target = (-0.5, 0.2, 0.4)
    puppet.input("ada", Input(1, 1, hand, 1, 0, target), 0)
    puppet.input("bo", Input(2, 1, leg, 1, 0, (0.9, 0.0, 0.0)), 0)
    for i in range(29):
        puppet.overlay(poses[i], i * FRAME)
    merged = apply(poses[29], puppet.overlay(poses[29], 29 * FRAME)).tolist()
    rig = ArmRig(FIGURE, Limb.RIGHT_HAND)
    np.testing.assert_allclose(rig.target(rig.dance(merged)), target, atol=1e-9)
    assert abs(LegRig(FIGURE, Limb.LEFT_LEG).angle(merged) - 0.9) < 1e-9


def taken_dragged_and_let_go(seed: int, hold: int, gap: int) -> tuple[Array, Array]:
    """All limbs pulled twice for `hold` frames at up to one arm length a second, `gap` frames between: how far each
    joint turned from frame to frame, and in the dance alone, degrees.

    Not counted is an arm whose hand flies past its shoulder within a quarter of an arm: it has to whirl."""
    poses = dance(2 * (hold + gap) + 30, seed)
    random = np.random.default_rng(seed)
    puppet = Marionette(FIGURE)
    merged, epochs, sequence = [], dict.fromkeys(Limb, 0), 0
    for i, pose in enumerate(poses):
        now = i * FRAME
        if i < 2:
            puppet.see(pose, now)
            merged.append(pose)
            continue
        phase = (i - 2) % (hold + gap)
        if phase == 0:
            epochs = {limb: granted(puppet, limb, "ada", now) for limb in Limb}
            speed = random.uniform(-1.0, 1.0, 3) / np.sqrt(3.0)
        if phase < hold:
            sequence += 1
            for limb, epoch in epochs.items():
                x, y, z = speed.tolist()
                given = Input(limb, 0, epoch, sequence, now, (x, y, z))
                assert puppet.input("ada", given, now) is Outcome.TAKEN
        if phase == hold:
            puppet.leave("ada", now)
        merged.append(apply(pose, puppet.overlay(pose, now)))
    turned = steps(np.array(merged))
    for limb in (Limb.LEFT_HAND, Limb.RIGHT_HAND):
        rig = ArmRig(FIGURE, limb)
        near = np.array([np.linalg.norm(rig.target(rig.dance(pose.tolist()))) < 0.25 for pose in merged])
        turned[np.ix_(near[1:] | near[:-1], limb.joints)] = 0.0
    return turned, steps(poses)


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 10_000), st.integers(1, 120), st.integers(24, 60))
def test_nothing_pops_when_a_limb_is_taken_dragged_and_let_go(seed: int, hold: int, gap: int) -> None:
    """A hard switch turns joints by up to 180 degrees in one frame; the dance itself by up to ten."""
    turned, own = taken_dragged_and_let_go(seed, hold, gap)
    assert float(turned.max()) < 60.0
    first = np.abs(turned[1] - own[1])
    pose = dance(3, seed)[2].tolist()
    for limb in Limb:
        joints = list(limb.joints)
        rig = ArmRig(FIGURE, limb) if limb.is_hand else None
        # an arm that is all but straight bends by ten degrees where its hand comes a hundredth nearer
        straight = rig is not None and float(np.linalg.norm(rig.target(rig.dance(pose)))) > 0.93
        assert float(first[joints].max()) < (20.0 if straight else 4.0)


@settings(max_examples=10, deadline=None)
@given(st.integers(0, 10_000), st.integers(1, 60), st.integers(1, 23))
def test_nor_when_it_is_taken_again_before_it_is_back(seed: int, hold: int, gap: int) -> None:
    turned, _ = taken_dragged_and_let_go(seed, hold, gap)
    assert float(turned.max()) < 60.0


def test_a_jump_of_the_target_does_not_throw_the_limb() -> None:
    poses = dance(200, seed=11)
    random = np.random.default_rng(11)
    puppet = Marionette(FIGURE)
    epochs = {limb: granted(puppet, limb, "ada", 0) for limb in Limb}
    merged = []
    for i, pose in enumerate(poses):
        for limb, epoch in epochs.items():
            if i % 15 == 0:
                x, y, z = random.uniform(-1.5, 1.5, 3).tolist()
                puppet.input("ada", Input(limb, 1, epoch, i + 1, i * FRAME, (x, y, z)), i * FRAME)
        puppet.alive("ada", list(Limb), i * FRAME)
        merged.append(apply(pose, puppet.overlay(pose, i * FRAME)))
    assert float(steps(np.array(merged)).max()) < 60.0


def test_a_silent_puppeteer_holds_still_then_loses_the_limb_which_goes_back_to_the_dance() -> None:
    pose = dance(1, seed=3)[0]
    puppet = Marionette(FIGURE)
    epoch = granted(puppet, 0, "ada", 0)
    puppet.input("ada", Input(0, 0, epoch, 1, 0, (0.5, 0.5, 0.5)), 0)
    shown: list[Overlay | None] = []
    lost = []
    for i in range(70):
        lost += puppet.expire(i * FRAME)
        shown.append(puppet.overlay(pose, i * FRAME))
    assert lost == [(Limb.LEFT_HAND, "ada")]
    assert puppet.holders() == (None, None, None, None)
    rig = ArmRig(FIGURE, Limb.LEFT_HAND)
    places = [rig.target(rig.dance(apply(pose, overlay).tolist())) for overlay in shown]
    np.testing.assert_allclose(places[29], places[18], atol=1e-3)
    assert shown[-1] is None
    back = [i for i, overlay in enumerate(shown) if overlay is None]
    assert 500_000 + 350_000 - FRAME <= back[0] * FRAME <= 500_000 + 400_000
    assert puppet.input("ada", Input(0, 1, epoch, 2, 0, (0.0, 0.0, 0.0)), 60 * FRAME) is Outcome.OWNER


def test_the_same_inputs_give_the_same_dance_again() -> None:
    poses = dance(60, seed=2)

    def run() -> bytes:
        puppet = Marionette(FIGURE)
        epoch = granted(puppet, 0, "ada", 0)
        out = []
        for i, pose in enumerate(poses):
            puppet.input("ada", Input(0, i % 2, epoch, i + 1, i * FRAME, (0.3, 0.01 * i, 0.2)), i * FRAME)
            out.append(apply(pose, puppet.overlay(pose, i * FRAME)))
        return np.array(out).tobytes()

    assert run() == run()


def test_another_dancer_stays_in_the_hands_the_limbs_are_in() -> None:
    pose = dance(1, seed=6)[0]
    puppet = Marionette(FIGURE)
    epoch = granted(puppet, 0, "ada", 0)
    puppet.input("ada", Input(0, 1, epoch, 1, 0, (0.4, 0.2, 0.3)), 0)
    puppet.overlay(pose, 0)
    longer = Figure(FIGURE.offsets * 1.1, FIGURE.tips * 1.4)
    puppet.set_figure(longer)
    assert puppet.holders() == ("ada", None, None, None)
    for i in range(1, 40):
        puppet.alive("ada", [0], i * FRAME)
        merged = apply(pose, puppet.overlay(pose, i * FRAME))
    rig = ArmRig(longer, Limb.LEFT_HAND)
    np.testing.assert_allclose(rig.target(rig.dance(merged.tolist())), (0.4, 0.2, 0.3), atol=1e-9)
    with pytest.raises(ProportionsError):
        puppet.set_figure(Figure(FIGURE.offsets, FIGURE.tips * 0.0))
    assert puppet.overlay(pose, 40 * FRAME) is not None


def test_a_puppet_is_lively_while_a_limb_goes_over_or_fast() -> None:
    pose = dance(1, seed=3)[0]
    puppet = Marionette(FIGURE)
    assert not puppet.lively
    epoch = granted(puppet, 0, "ada", 0)
    seen: list[bool] = []
    for i in range(60):
        if i in (1, 40):
            target = (0.4, 0.2 if i == 1 else -0.4, 0.4)
            puppet.input("ada", Input(0, 1, epoch, i, i * FRAME, target), i * FRAME)
        puppet.alive("ada", [0], i * FRAME)
        puppet.overlay(pose, i * FRAME)
        seen.append(puppet.lively)
    assert seen[2]
    assert not any(seen[25:40])
    assert any(seen[40:50])
    assert not seen[59]
