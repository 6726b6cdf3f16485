from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bunraku.demo.instruments import SAMPLE_RATE_HZ
from bunraku.demo.mixer import PEAK_LIMIT, Note, render_notes
from tests.audio import find_onset


@settings(max_examples=20)
@given(st.floats(0, 3.5), st.sampled_from(["great drum", "hand drum", "clappers"]))
def test_note_starts_at_its_beat_to_the_sample(beat: float, player: str) -> None:
    played = render_notes([Note(beat, player)], 0.625, 3.0)  # type: ignore[arg-type]
    start = round(beat * 0.625 * SAMPLE_RATE_HZ)
    assert not played[:start].any()
    assert played[start : start + 48].any()
    assert abs(find_onset(played.sum(axis=1)) - start / SAMPLE_RATE_HZ) < 0.01


def test_mix_has_the_given_length_and_ends_in_silence() -> None:
    played = render_notes([Note(0, "string", semitones=5), Note(1.9, "great drum")], 0.5, 1.0)
    assert played.shape == (48_000, 2)
    assert np.abs(played[-3:]).max() < 1e-3


def test_peaks_are_soft_clipped() -> None:
    played = render_notes([Note(0, "great drum", 20.0)] * 9, 0.5, 1.0)
    assert 0.9 * PEAK_LIMIT < np.abs(played).max() <= PEAK_LIMIT


def test_instruments_are_panned() -> None:
    left, right = np.sqrt(np.mean(render_notes([Note(0, "clappers")], 0.5, 1.0) ** 2, axis=0))
    assert left > 1.5 * right
    left, right = np.sqrt(np.mean(render_notes([Note(0, "bell")], 0.5, 1.0) ** 2, axis=0))
    assert right > 1.5 * left


@pytest.mark.parametrize("beat", [-0.1, 2.0])
def test_note_outside_is_rejected(beat: float) -> None:
    with pytest.raises(ValueError, match="outside the 1 s"):
        render_notes([Note(beat, "bell")], 0.5, 1.0)
