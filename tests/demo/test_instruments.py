from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from bunraku.demo import instruments
from bunraku.demo.instruments import SAMPLE_RATE_HZ
from bunraku.motion.rotation import Array

STRUCK: tuple[Callable[[], Array], ...] = (
    instruments.strike_great_drum,
    instruments.strike_hand_drum,
    instruments.strike_clappers,
    instruments.strike_bell,
)


@pytest.mark.parametrize("struck", STRUCK)
def test_struck_tone_is_loud_at_once_and_ends_in_silence(struck: Callable[[], Array]) -> None:
    tone = struck()
    np.testing.assert_array_equal(tone, struck())
    assert 0.3 < np.abs(tone).max() < 2
    early = np.abs(tone[: SAMPLE_RATE_HZ // 50]).max()
    assert early > 0.5 * np.abs(tone).max()
    assert np.abs(tone[-10:]).max() < 1e-2 * np.abs(tone).max()


@pytest.mark.parametrize("play", [instruments.pluck_string, instruments.blow_flute])
@pytest.mark.parametrize("hertz", [146.83, 293.66, 440.0, 587.33])
def test_tone_has_its_pitch(play: Callable[[float, float], Array], hertz: float) -> None:
    tone = play(hertz, 1.0)
    assert len(tone) == SAMPLE_RATE_HZ
    part = tone[SAMPLE_RATE_HZ // 10 : SAMPLE_RATE_HZ // 2]
    # how far apart it is most like itself, within a third of a tone about the pitch
    spectrum = np.abs(np.fft.rfft(part, 1 << 18)) ** 2
    like = np.fft.irfft(spectrum)
    lags = np.arange(round(SAMPLE_RATE_HZ / hertz / 1.04), round(SAMPLE_RATE_HZ / hertz * 1.04) + 1)
    best = lags[np.argmax(like[lags])]
    assert abs(SAMPLE_RATE_HZ / best / hertz - 1) < 0.015


def test_string_decays_and_flute_sustains() -> None:
    for play, least, most in ((instruments.pluck_string, 0.0, 0.35), (instruments.blow_flute, 0.5, 2.0)):
        tone = play(440.0, 1.0)
        early, late = (np.sqrt(np.mean(part**2)) for part in (tone[4_800:9_600], tone[38_400:43_200]))
        assert least <= late / early <= most
        assert np.abs(tone[[0, -1]]).max() < 1e-3
