from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from bunraku.codec.step_search import MAX_STEP, MIN_STEP, StepSearch
from bunraku.motion.rotation import Array


@dataclass
class FakeBlock:
    step: int
    errors_mm: Array
    data: bytes


class FakeEncoder:
    """Encoder whose error grows by an octave in 16 steps and is 1 mm at `step_of_1_mm`."""

    def __init__(self, step_of_1_mm: int = 100) -> None:
        self.steps: list[int] = []
        self._step_of_1_mm = step_of_1_mm

    def __call__(self, step: int) -> FakeBlock:
        self.steps.append(step)
        error = 2.0 ** ((step - self._step_of_1_mm) / 16)
        return FakeBlock(step, np.array([[0.1 * error, error]]), bytes(1000 - 3 * step))


@pytest.mark.parametrize("initial_step", [MIN_STEP, 60, 97, 100, 103, 180, MAX_STEP])
def test_cheapest_block_is_near_the_coarsest_valid_step(initial_step: int) -> None:
    encoder = FakeEncoder()
    found = StepSearch(encoder, 1.0).find_cheapest(initial_step)
    assert found is not None
    assert 95 <= found.step < 100


def test_search_from_the_right_step_needs_few_encodings() -> None:
    encoder = FakeEncoder()
    StepSearch(encoder, 1.0).find_cheapest(98)
    assert len(encoder.steps) <= 4
    assert len(set(encoder.steps)) == len(encoder.steps)


@pytest.mark.parametrize(("bytes_of_93", "cheapest"), [(80, 93), (120, 90)])
def test_coarser_step_between_valid_and_invalid_is_taken_if_it_has_fewer_bytes(bytes_of_93: int, cheapest: int) -> None:
    def encode(step: int) -> FakeBlock:
        return FakeBlock(step, np.array([[1.0 if step <= 93 else 9.0]]), bytes(bytes_of_93 if step == 93 else 100))

    found = StepSearch(encode, 2.0).find_cheapest(90)
    assert found is not None
    assert found.step == cheapest


@pytest.mark.parametrize("step_of_1_mm", [-1000, 1000])
def test_search_ends_at_the_limits_of_the_step(step_of_1_mm: int) -> None:
    for initial_step in (MIN_STEP, 128, MAX_STEP):
        encoder = FakeEncoder(step_of_1_mm)
        cheapest = StepSearch(encoder, 1.0).find_cheapest(initial_step)
        valid = StepSearch(encoder, 1.0).find_valid(initial_step)
        if step_of_1_mm < 0:
            assert cheapest is None
            assert valid is None
        else:
            assert cheapest is not None
            assert cheapest.step == MAX_STEP
            assert valid is not None
        assert all(MIN_STEP <= step <= MAX_STEP for step in encoder.steps)


@pytest.mark.parametrize("initial_step", [MIN_STEP, 60, 95, 100, 103, 180, MAX_STEP])
def test_valid_block_is_within_the_bound(initial_step: int) -> None:
    encoder = FakeEncoder()
    found = StepSearch(encoder, 1.0).find_valid(initial_step)
    assert found is not None
    assert found.errors_mm.max() <= 1
    if abs(initial_step - 100) < 48:
        assert len(encoder.steps) <= 3
