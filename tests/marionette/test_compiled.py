from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from bunraku.marionette import arms, compiled, table
from bunraku.marionette.proportions import Proportions
from tests.marionette.arms import ARMS

coordinates = st.one_of(st.floats(-1.5, 1.5), st.floats(-1e6, 1e6), st.sampled_from([0.0, -0.0, 1e-170, 1.0]))


@given(st.sampled_from(ARMS), st.lists(st.tuples(coordinates, coordinates, coordinates), max_size=20))
def test_compiled_arms_are_the_same(proportions: Proportions, places: list[tuple[float, float, float]]) -> None:
    stored, targets = table.table_of(proportions.identity), np.array(places).reshape(-1, 3)
    plain, fast = arms.solve(proportions, stored, targets), compiled.solve(proportions, stored, targets)
    np.testing.assert_allclose(fast.solved, plain.solved, rtol=0.0, atol=1e-12)
