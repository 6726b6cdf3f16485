from __future__ import annotations

import numpy as np
import pytest

from bunraku.motion.choreography import SCORE, stamp_times
from bunraku.motion.score import Hop
from bunraku.show import music
from bunraku.show.instruments import RATE
from bunraku.show.music import Samples


@pytest.fixture(scope="module")
def played() -> Samples:
    return music.music(SCORE)


def test_it_is_as_long_as_the_dance_and_no_sample_is_cut(played: Samples) -> None:
    assert played.shape == (round(SCORE.duration * RATE), 2)
    assert np.abs(played).max() == pytest.approx(music.LOUDEST)
    assert np.all(np.isfinite(played))


def test_a_drum_is_heard_with_every_stamp_and_hop(played: Samples) -> None:
    deep = np.abs(np.fft.irfft(_below(np.fft.rfft(played.sum(axis=1)), 110.0)))
    landings = [*stamp_times(), *(hop.beat * SCORE.seconds_per_beat for hop in SCORE.hops)]
    assert len(landings) == len(stamp_times()) + sum(isinstance(f, Hop) for f in SCORE.footfalls())
    for at in landings:
        here = round(at * RATE)
        before, after = deep[here - RATE // 10 : here - RATE // 50], deep[here : here + RATE // 10]
        assert after.max() > 1.3 * before.max(), f"no drum at {at} s"


def test_its_end_leads_on_to_its_beginning(played: Samples) -> None:
    steps = np.abs(np.diff(played, axis=0, append=played[:1]))
    # nothing at the seam that is not elsewhere: the first clappers are struck there
    assert steps[-1].max() < 0.1
    # what sounds at the end is still heard at the beginning, before anything else could have been
    assert np.abs(played[: RATE // 2000]).max() > 1e-4


def test_every_note_is_of_the_scale() -> None:
    scale = {note % 12 for note in (62, 63, 67, 69, 70)}
    assert {note % 12 for _, note, _, _ in (*music.SHAMISEN, *music.FLUTE)} <= scale


def test_notes_lie_within_the_dance_and_in_order() -> None:
    for notes in (music.SHAMISEN, music.FLUTE, music.BELLS):
        beats = [at for at, *_ in notes]
        assert beats == sorted(beats)
        assert beats[0] >= 0.0
        assert beats[-1] < SCORE.beats


def test_the_clappers_run_up_to_each_held_pose_ever_quicker() -> None:
    for held in music.HELD:
        times = [stroke.at for stroke in music._run_up(held, SCORE.seconds_per_beat)]
        assert times[-2] == pytest.approx(held * SCORE.seconds_per_beat)
        gaps = np.diff(times[:-1])
        assert np.all(gaps > 0)


def _below(spectrum: np.ndarray, hertz: float) -> np.ndarray:
    kept = np.arange(len(spectrum)) < hertz * SCORE.duration
    return spectrum * kept
