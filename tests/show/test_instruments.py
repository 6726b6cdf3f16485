from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from bunraku.motion.rotation import Array
from bunraku.show import instruments
from bunraku.show.instruments import RATE

PITCHED = (instruments.shamisen, instruments.flute, instruments.bell)
STRUCK = (instruments.large_drum, instruments.small_drum, instruments.clappers)


def strongest(sound: Array) -> float:
    """Hertz of the strongest partial."""
    spectrum = np.abs(np.fft.rfft(sound * np.hanning(len(sound))))
    return float(np.argmax(spectrum) * RATE / len(sound))


@pytest.mark.parametrize("instrument", PITCHED)
@pytest.mark.parametrize("note", [57, 62, 69])
def test_a_note_has_its_pitch_and_its_length(instrument: Callable[..., Array], note: int) -> None:
    sound = instrument(note, 1.0, 0.5)
    assert len(sound) == RATE
    assert np.abs(sound).max() == pytest.approx(0.5, rel=1e-6)
    pitch = instruments.frequency(note)
    # the strongest partial is one of its own, wherever that lies
    partial = strongest(sound[RATE // 8 :]) / pitch
    assert abs(partial - round(partial)) < 0.02


def test_the_a_of_an_orchestra() -> None:
    assert instruments.frequency(69) == 440.0
    assert instruments.frequency(81) == pytest.approx(880.0)


@pytest.mark.parametrize("instrument", STRUCK)
def test_what_is_struck_is_loudest_at_once_and_dies_away(instrument: Callable[..., Array]) -> None:
    sound = np.abs(instrument(0.8))
    assert sound.max() == pytest.approx(0.8, rel=1e-6)
    assert np.argmax(sound) < RATE // 20
    assert sound[-len(sound) // 10 :].max() < 0.05


def test_the_large_drum_is_the_deepest() -> None:
    assert strongest(instruments.large_drum()) < 100 < strongest(instruments.small_drum()) < 700
    assert strongest(instruments.clappers()) > 1_000


@pytest.mark.parametrize("instrument", PITCHED)
def test_the_same_note_is_the_same_every_time_and_ends_in_silence(instrument: Callable[..., Array]) -> None:
    sound = instrument(62, 0.5)
    np.testing.assert_array_equal(sound, instrument(62, 0.5))
    assert abs(float(sound[-1])) < 1e-3
