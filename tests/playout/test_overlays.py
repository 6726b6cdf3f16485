from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from bunraku.motion import rotation
from bunraku.playout.overlays import JOINTS, LASTS, Overlays, pack_joints, unpack_joints
from bunraku.wire.overlay import Overlay

DANCE = rotation.from_rotation_vector(np.random.default_rng(1).uniform(-1, 1, (18, 3)))
PULLED = rotation.from_rotation_vector(np.random.default_rng(2).uniform(-1, 1, (3, 3)))


def turn(a: rotation.Array, b: rotation.Array) -> float:
    return float(
        np.linalg.norm(rotation.to_rotation_vector(rotation.multiply(rotation.conjugate(a), b)), axis=-1).max()
    )


@given(st.integers(0, 1000))
def test_joints_survive_their_numbers(seed: int) -> None:
    vectors = np.random.default_rng(seed).normal(size=(3, 3))
    joints = rotation.from_rotation_vector(vectors)
    assert turn(unpack_joints(pack_joints(joints.tolist())), joints) < 2e-4


def test_nothing_lies_over_before_the_first_nor_long_after_the_last() -> None:
    overlays = Overlays()
    assert overlays.lay(DANCE, 5) is DANCE
    overlays.put(Overlay(0, 1_000, {0: pack_joints(PULLED.tolist())}))
    assert overlays.lay(DANCE, 999) is DANCE
    assert turn(overlays.lay(DANCE, 1_000 + LASTS)[list(JOINTS[0])], PULLED) < 2e-4
    assert overlays.lay(DANCE, 1_001 + LASTS) is DANCE


def test_only_the_limbs_joints_change_and_the_later_mask_decides() -> None:
    overlays = Overlays()
    overlays.put(Overlay(0, 0, {}))
    overlays.put(Overlay(1, 100, {2: pack_joints(PULLED.tolist())}))
    overlays.put(Overlay(2, 200, {}))
    joints = list(JOINTS[2])
    others = [k for k in range(18) if k not in joints]
    merged = overlays.lay(DANCE, 50)
    np.testing.assert_array_equal(merged[others], DANCE[others])
    assert abs(turn(DANCE[joints], merged[joints]) - turn(DANCE[joints], PULLED) / 2) < 1e-3
    np.testing.assert_array_equal(overlays.lay(DANCE, 150), DANCE)


def test_late_and_repeated_overlays_are_ignored() -> None:
    overlays = Overlays()
    overlays.put(Overlay(5, 500, {0: pack_joints(PULLED.tolist())}))
    overlays.put(Overlay(4, 400, {}))
    overlays.put(Overlay(5, 500, {}))
    assert turn(overlays.lay(DANCE, 500)[list(JOINTS[0])], PULLED) < 2e-4


def test_the_first_after_a_silence_begins_when_it_is_due() -> None:
    overlays = Overlays()
    overlays.put(Overlay(0, 0, {}))
    overlays.put(Overlay(1, 10 * LASTS, {0: pack_joints(PULLED.tolist())}))
    for clock in (1, LASTS, 2 * LASTS, 10 * LASTS - 1):
        np.testing.assert_array_equal(overlays.lay(DANCE, clock), DANCE)
    assert turn(overlays.lay(DANCE, 10 * LASTS)[list(JOINTS[0])], PULLED) < 2e-4


def test_limbs_of_another_performer_leave_this_one_as_it_is() -> None:
    overlays = Overlays()
    overlays.put(Overlay(0, 0, {2: pack_joints(PULLED.tolist()), 9: pack_joints(PULLED[::-1].tolist())}))
    assert turn(overlays.lay(DANCE, 1)[list(JOINTS[2])], PULLED) < 2e-4
    np.testing.assert_array_equal(overlays.lay(DANCE, 1, 1), DANCE)
    third = overlays.lay(DANCE, 1, 2)
    assert turn(third[list(JOINTS[1])], PULLED[::-1]) < 2e-4
    others = [k for k in range(18) if k not in JOINTS[1]]
    np.testing.assert_array_equal(third[others], DANCE[others])
