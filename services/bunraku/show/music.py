"""The music of the demo's dance: ours, played by code on the beats of its score.

Shamisen and flute in the in scale on D (D, E flat, G, A, B flat), as theatre music of that kind has it; drums where
feet land, and clappers (tsuke) that run up to each held pose. It closes upon itself: its end still echoes in its
beginning.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from bunraku.motion.rotation import Array
from bunraku.motion.score import Hop, Score
from bunraku.show import instruments
from bunraku.show.instruments import RATE

Samples = npt.NDArray[np.float32]

LOUDEST = 0.84
"""Of full scale: decoders may overshoot a little."""
HELD = (18.15, 24.0, 43.15)
"""Beats at which a pose is struck and held (mie)."""
ROLL = 9
"""Strokes of the clappers that run up to it."""

SHAMISEN = (
    # 1 greeting
    (0.0, 50, 2.0, 0.7), (2.0, 57, 1.5, 0.4), (3.5, 58, 0.5, 0.4), (4.0, 57, 1.0, 0.6), (5.0, 55, 0.5, 0.45),
    (5.5, 57, 1.0, 0.6), (6.5, 62, 0.5, 0.5), (7.0, 50, 1.0, 0.75), (8.0, 57, 0.75, 0.7),
    # 2 gliding left and right
    (9.0, 62, 0.5, 0.7), (9.5, 63, 0.5, 0.5), (10.0, 62, 0.5, 0.65), (10.5, 58, 0.5, 0.5), (11.0, 57, 0.75, 0.7),
    (11.75, 58, 0.25, 0.4), (12.0, 55, 1.0, 0.75), (13.0, 57, 0.5, 0.65), (13.5, 55, 0.5, 0.5), (14.0, 51, 0.5, 0.65),
    (14.5, 50, 0.5, 0.5), (15.0, 55, 0.5, 0.65), (15.5, 57, 0.5, 0.5), (16.0, 50, 1.5, 0.8),
    # 3 the first held pose, crossed and fanned out
    (19.7, 38, 1.5, 0.8), (20.5, 50, 0.5, 0.5), (21.0, 51, 0.5, 0.6), (21.5, 55, 0.5, 0.6), (22.0, 57, 0.5, 0.7),
    (22.5, 58, 0.5, 0.6), (23.0, 62, 0.5, 0.8), (23.25, 62, 0.25, 0.45), (23.5, 62, 0.25, 0.55), (24.0, 50, 2.0, 0.9),
    # 4 the slow turn: few notes under the flute
    (26.0, 45, 1.5, 0.4), (28.0, 50, 1.5, 0.4), (30.0, 51, 1.0, 0.4), (31.0, 50, 0.5, 0.5), (31.5, 51, 0.5, 0.55),
    (32.0, 50, 0.5, 0.7),
    # 5 the crow's hops, and the circle
    (33.0, 62, 0.4, 0.8), (33.5, 58, 0.4, 0.5), (34.0, 62, 0.4, 0.8), (34.5, 63, 0.4, 0.5), (35.0, 67, 0.5, 0.85),
    (36.0, 50, 0.5, 0.7), (36.5, 57, 0.5, 0.5), (37.0, 62, 0.5, 0.7), (37.5, 57, 0.5, 0.5), (38.0, 51, 0.5, 0.7),
    (38.5, 58, 0.5, 0.5), (39.0, 63, 0.5, 0.7), (39.5, 58, 0.5, 0.5), (40.0, 55, 0.5, 0.7), (40.5, 57, 0.5, 0.55),
    (41.0, 62, 0.75, 0.75), (41.75, 63, 0.25, 0.45), (42.0, 62, 0.75, 0.7),
    # 6 the last held pose, and the bow
    (44.0, 38, 1.5, 0.85), (45.0, 57, 0.5, 0.4), (45.5, 55, 1.0, 0.45), (46.5, 51, 0.75, 0.4), (47.25, 50, 0.75, 0.5),
)  # fmt: skip
"""Beat, note, beats that it sounds, strength."""
FLUTE = (
    (4.0, 74, 1.4, 0.3), (5.5, 79, 0.9, 0.3), (6.5, 81, 1.2, 0.32),
    (24.75, 81, 1.1, 0.42), (26.0, 82, 0.9, 0.42), (27.0, 81, 0.9, 0.4), (28.0, 79, 1.4, 0.42), (29.5, 75, 0.4, 0.36),
    (30.0, 74, 1.7, 0.42),
    (37.0, 86, 0.8, 0.28), (38.0, 87, 0.8, 0.28), (39.0, 86, 0.9, 0.28), (40.0, 82, 0.9, 0.3), (41.0, 81, 1.2, 0.3),
    (45.5, 75, 0.8, 0.3), (46.5, 74, 1.4, 0.3),
)  # fmt: skip
BELLS = ((0.0, 86, 3.0, 0.25), (25.0, 91, 3.0, 0.2), (29.0, 86, 3.0, 0.18), (46.5, 86, 3.5, 0.25))
WALK = (36.0, 41.0)
"""From beat to beat the small drum walks with the feet."""


class Stroke(NamedTuple):
    """One note of an instrument: where it begins, seconds; the sound; how far to the left it is, 0..1."""

    at: float
    sound: Array
    left: float


def strokes(score: Score) -> Iterator[Stroke]:
    """All notes of the music to a dance of this score."""
    beat = score.seconds_per_beat
    for instrument, notes, left in (
        (instruments.shamisen, SHAMISEN, 0.6),
        (instruments.flute, FLUTE, 0.38),
        (instruments.bell, BELLS, 0.5),
    ):
        for at, note, beats, strength in notes:
            # a string rings on a little under the next
            yield Stroke(at * beat, instrument(note, (beats + 0.35) * beat, strength), left)
    for footfall in score.footfalls():
        at = footfall.beat * beat
        if isinstance(footfall, Hop):
            yield Stroke(at, instruments.small_drum(0.75), 0.3)
            yield Stroke(at, instruments.large_drum(0.5), 0.5)
        elif footfall.stamp:
            yield Stroke(at, instruments.large_drum(0.9), 0.5)
        elif WALK[0] <= footfall.beat <= WALK[1]:
            yield Stroke(at, instruments.small_drum(0.5 if footfall.beat % 1.0 == 0.0 else 0.3), 0.3)
    for held in HELD:
        yield from _run_up(held, beat)
    for at in (0.0, 0.5):
        yield Stroke(at * beat, instruments.clappers(0.5), 0.75)


def _run_up(held: float, beat: float) -> Iterator[Stroke]:
    """The clappers, quicker and louder to the pose, then two strokes on it."""
    for stroke in range(ROLL):
        share = stroke / ROLL
        yield Stroke((held - 1.1 * (1.0 - share**0.7)) * beat, instruments.clappers(0.12 + 0.3 * share), 0.75)
    yield Stroke(held * beat, instruments.clappers(0.7), 0.75)
    yield Stroke((held + 0.16) * beat, instruments.clappers(0.55), 0.75)


def music(score: Score) -> Samples:
    """The music to a dance of this score, stereo (n, 2) at `RATE`, -1..1; its end leads on to its beginning."""
    samples = round(score.duration * RATE)
    mix = np.zeros((samples, 2))
    for at, sound, left in strokes(score):
        where = (round(at * RATE) + np.arange(len(sound))) % samples
        # of even power wherever it is
        mix[where] += sound[:, None] * np.sqrt([left, 1.0 - left])
    mix += 0.22 * _echo(mix)
    # the loudest strokes are rounded off rather than all the rest turned down
    mix = np.tanh(mix / (0.55 * np.abs(mix).max()))
    played: Samples = (mix * (LOUDEST / np.abs(mix).max())).astype(np.float32)
    return played


def _echo(mix: Array) -> Array:
    """The room: noise that dies away in a second, another at each side; round the loop."""
    random, time = np.random.default_rng(7), np.arange(int(1.2 * RATE)) / RATE
    room = np.zeros_like(mix)
    room[: len(time)] = (
        random.normal(size=(len(time), 2)) * (np.exp(-time * 5.5) * np.clip(time / 0.012, 0, 1))[:, None]
    )
    spectrum = np.fft.rfft(room, axis=0)
    hertz = np.fft.rfftfreq(len(mix), 1.0 / RATE)
    spectrum /= (1.0 + (hertz / 4_500.0) ** 2)[:, None]
    echo: Array = np.fft.irfft(np.fft.rfft(mix, axis=0) * spectrum, len(mix), axis=0)
    echo *= np.sqrt(np.mean(mix**2) / np.mean(echo**2))
    return echo
