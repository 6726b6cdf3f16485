from __future__ import annotations

import numpy as np
import pytest

from bunraku.motion.choreography import SCORE, dance, stamp_times, step_times
from bunraku.motion.rotation import Array
from bunraku.music import sanbaso
from bunraku.music.instruments import SAMPLE_RATE


@pytest.fixture(scope="module")
def music() -> Array:
    return sanbaso.music()


def test_it_is_as_long_as_the_dance_and_never_too_loud(music: Array) -> None:
    assert music.shape == (round(dance(12.0).duration * SAMPLE_RATE), 2)
    assert 0.4 < np.abs(music).max() <= 0.8
    assert np.isfinite(music).all()
    np.testing.assert_array_equal(music, sanbaso.music())


def test_every_landing_is_struck_on_its_beat() -> None:
    struck = list(sanbaso.steps(SCORE))
    seconds = {note.beat * SCORE.seconds_per_beat for note in struck}
    assert set(step_times()) <= seconds
    great = [note.beat * SCORE.seconds_per_beat for note in struck if note.player == "great drum"]
    assert sorted(great) == pytest.approx(stamp_times())
    assert sum(note.player == "bell" for note in struck) == len(SCORE.hops)
    assert sum(note.player == "clappers" for note in struck) == 2 * 2, "two mie"


def test_stamps_are_heard_where_they_are_danced(music: Array) -> None:
    """Below 110 Hz there is the great drum alone: its power leaps up within a hundredth of a second of each stamp."""
    low = np.fft.rfft(music.mean(axis=1))
    low[np.fft.rfftfreq(len(music), 1 / SAMPLE_RATE) > 110] = 0
    power = np.convolve(np.fft.irfft(low, len(music)) ** 2, np.ones(480) / 480, "same")
    for time in stamp_times():
        at = round(time * SAMPLE_RATE)
        before, after = power[at - 4_800 : at - 1_200].max(), power[at + 480 : at + 3_840].max()
        assert after > 4 * before, f"the stamp at {time:.2f} s"


def test_string_and_flute_keep_to_the_scale_and_the_dance() -> None:
    pitches = {pitch % 12 for _, pitch in sanbaso.STRING} | {pitch % 12 for _, _, pitch in sanbaso.FLUTE}
    assert pitches == {0, 1, 5, 7, 8}
    ends = [beat + beats for beat, beats, _ in sanbaso.FLUTE]
    starts = [beat for beat, _, _ in sanbaso.FLUTE]
    assert all(end <= start for end, start in zip(ends, starts[1:], strict=False)), "one flute, one tone at a time"
    assert ends[-1] <= SCORE.beats
    assert [beat for beat, _ in sanbaso.STRING] == sorted(beat for beat, _ in sanbaso.STRING)
