from __future__ import annotations

from collections.abc import Iterator
from types import FunctionType

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bunraku.marionette import arm_batch, bend_table, follower, jit
from bunraku.marionette.controlled_limb import ControlledHand
from bunraku.marionette.limb_rig import Limb
from bunraku.marionette.proportions import Proportions
from bunraku.motion import rotation
from bunraku.motion.skeleton import standard_figure
from bunraku.runtime.compile_cache import compile_cache_folder
from tests.marionette.fixtures import ARM_PROPORTIONS

coordinates = st.one_of(st.floats(-1.5, 1.5), st.floats(-1e6, 1e6), st.sampled_from([0.0, -0.0, 1e-170, 1.0]))


@given(st.sampled_from(ARM_PROPORTIONS), st.lists(st.tuples(coordinates, coordinates, coordinates), max_size=20))
def test_compiled_arms_are_the_same(proportions: Proportions, places: list[tuple[float, float, float]]) -> None:
    stored, targets = bend_table.load_bend_table(proportions.identity), np.array(places).reshape(-1, 3)
    plain, fast = arm_batch.solve_arms(proportions, stored, targets), jit.solve_arms(proportions, stored, targets)
    np.testing.assert_allclose(fast.rows, plain.rows, rtol=0.0, atol=1e-12)


@pytest.fixture
def loaded() -> Iterator[None]:
    jit.enable(compile_cache_folder("marionette"))
    yield
    jit.disable()


def solve_sequence(limb: Limb, seed: int) -> list[object]:
    """A hand pulled through wherever it is asked to, in a body that turns, then let go."""
    random = np.random.default_rng(seed)
    hand = ControlledHand(standard_figure(), limb)
    pose = rotation.from_rotation_vector(random.uniform(-0.5, 0.5, (18, 3)))
    shown: list[object] = []
    for frame in range(240):
        if frame % 12 == 0:
            x, y, z = random.uniform(-1.2, 1.2, 3).tolist()
        pose[0] = rotation.from_rotation_vector(np.array([0.02, 0.05, 0.01]) * frame)
        hand.observe_pose(pose.tolist(), 1 / 60)
        held = frame < 200
        shown.append(
            hand.solve_joints(pose.tolist(), (x, y, z) if held else None, min(frame / 9, 1.0) if held else 0.1, 1 / 60)
        )
        shown.append(hand.position)
    return shown


PYTHON_RESULTS = {
    (limb, seed): solve_sequence(limb, seed) for limb in (Limb.LEFT_HAND, Limb.RIGHT_HAND) for seed in range(3)
}


@pytest.mark.usefixtures("loaded")
@pytest.mark.parametrize(("limb", "seed"), PYTHON_RESULTS)
def test_compiled_limbs_are_the_same_to_the_last_bit(limb: Limb, seed: int) -> None:
    assert solve_sequence(limb, seed) == PYTHON_RESULTS[limb, seed]


@pytest.mark.usefixtures("loaded")
def test_what_it_was_not_compiled_for_is_refused_and_does_not_wait_for_the_compiler() -> None:
    with pytest.raises(TypeError, match="No matching definition"):
        vars(follower)["advance"]("here", *[(0.0, 0.0, 0.0)] * 5, 0.02, 1.0, 0.0, 1.0)


def test_plain_functions_are_back_once_unloaded() -> None:
    assert all(isinstance(vars(module)[name], FunctionType) for module, name in jit.COMPILED_FUNCTIONS)
