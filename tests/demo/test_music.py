from __future__ import annotations

import numpy as np
import pytest

from bunraku.demo.choreography import SCORE, animate_dance, footfall_times, stamp_times
from bunraku.demo.instruments import SAMPLE_RATE_HZ
from bunraku.demo.music import FLUTE_NOTES, STRING_NOTES, percussion_notes, render_music
from bunraku.motion.rotation import Array


@pytest.fixture(scope="module")
def music() -> Array:
    return render_music()


def test_music_is_as_long_as_the_motion_and_limited(music: Array) -> None:
    assert music.shape == (round(animate_dance(12.0).duration * SAMPLE_RATE_HZ), 2)
    assert 0.4 < np.abs(music).max() <= 0.8
    assert np.isfinite(music).all()
    np.testing.assert_array_equal(music, render_music())


def test_every_footfall_has_percussion_on_its_beat() -> None:
    struck = list(percussion_notes(SCORE))
    seconds = {note.beat * SCORE.seconds_per_beat for note in struck}
    assert set(footfall_times()) <= seconds
    great = [note.beat * SCORE.seconds_per_beat for note in struck if note.instrument == "great drum"]
    assert sorted(great) == pytest.approx(stamp_times())
    assert sum(note.instrument == "bell" for note in struck) == len(SCORE.hops)
    assert sum(note.instrument == "clappers" for note in struck) == 2 * 2, "two mie"


def test_stamps_sound_at_their_time(music: Array) -> None:
    """Below 110 Hz there is the great drum alone: its power leaps up within a hundredth of a second of each stamp."""
    low = np.fft.rfft(music.mean(axis=1))
    low[np.fft.rfftfreq(len(music), 1 / SAMPLE_RATE_HZ) > 110] = 0
    power = np.convolve(np.fft.irfft(low, len(music)) ** 2, np.ones(480) / 480, "same")
    for time in stamp_times():
        at = round(time * SAMPLE_RATE_HZ)
        before, after = power[at - 4_800 : at - 1_200].max(), power[at + 480 : at + 3_840].max()
        assert after > 4 * before, f"the stamp at {time:.2f} s"


def test_string_and_flute_stay_in_scale_and_length() -> None:
    pitches = {pitch % 12 for _, pitch in STRING_NOTES} | {pitch % 12 for _, _, pitch in FLUTE_NOTES}
    assert pitches == {0, 1, 5, 7, 8}
    ends = [beat + beats for beat, beats, _ in FLUTE_NOTES]
    starts = [beat for beat, _, _ in FLUTE_NOTES]
    assert all(end <= start for end, start in zip(ends, starts[1:], strict=False)), "one flute, one tone at a time"
    assert ends[-1] <= SCORE.beat_count
    assert [beat for beat, _ in STRING_NOTES] == sorted(beat for beat, _ in STRING_NOTES)
