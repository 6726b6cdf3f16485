from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bunraku.music.ensemble import LOUDEST, Note, perform
from bunraku.music.instruments import SAMPLE_RATE
from tests.sounds import onset


@settings(max_examples=20)
@given(st.floats(0, 3.5), st.sampled_from(["great drum", "hand drum", "clappers"]))
def test_a_note_begins_at_its_beat_to_the_sample(beat: float, player: str) -> None:
    played = perform([Note(beat, player)], 0.625, 3.0)  # type: ignore[arg-type]
    start = round(beat * 0.625 * SAMPLE_RATE)
    assert not played[:start].any()
    assert played[start : start + 48].any()
    assert abs(onset(played.sum(axis=1)) - start / SAMPLE_RATE) < 0.01


def test_it_is_as_long_as_asked_and_ends_in_silence() -> None:
    played = perform([Note(0, "string", pitch=5), Note(1.9, "great drum")], 0.5, 1.0)
    assert played.shape == (48_000, 2)
    assert np.abs(played[-3:]).max() < 1e-3


def test_the_loudest_is_rounded_off() -> None:
    played = perform([Note(0, "great drum", 20.0)] * 9, 0.5, 1.0)
    assert 0.9 * LOUDEST < np.abs(played).max() <= LOUDEST


def test_players_sit_where_they_sit() -> None:
    left, right = np.sqrt(np.mean(perform([Note(0, "clappers")], 0.5, 1.0) ** 2, axis=0))
    assert left > 1.5 * right
    left, right = np.sqrt(np.mean(perform([Note(0, "bell")], 0.5, 1.0) ** 2, axis=0))
    assert right > 1.5 * left


@pytest.mark.parametrize("beat", [-0.1, 2.0])
def test_a_note_outside_is_refused(beat: float) -> None:
    with pytest.raises(ValueError, match="outside the 1 s"):
        perform([Note(beat, "bell")], 0.5, 1.0)
