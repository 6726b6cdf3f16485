"""Mixer: notes to stereo samples, at their beats, in a room."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from bunraku.demo import instruments
from bunraku.demo.instruments import SAMPLE_RATE_HZ
from bunraku.motion.rotation import Array

Instrument = Literal["string", "flute", "great drum", "hand drum", "clappers", "bell"]

PEAK_LIMIT = 0.8
"""Largest sample: encoding may increase it slightly."""
_GAIN_AND_PAN: dict[Instrument, tuple[float, float]] = {
    "string": (0.30, -0.35),
    "flute": (0.20, 0.4),
    "great drum": (0.85, 0.0),
    "hand drum": (0.45, 0.25),
    "clappers": (0.40, -0.6),
    "bell": (0.16, 0.6),
}
"""Gain and pan of each instrument: -1 is left, 1 right."""
_EARLY_REFLECTIONS = ((0.023, 0.16, -0.8), (0.037, 0.13, 0.8), (0.059, 0.09, -0.5), (0.083, 0.07, 0.6))
"""Reflections of a wooden hall: delay in seconds, share and pan."""


@dataclass(frozen=True, slots=True)
class Note:
    """One note: instrument, beat, gain (1: normal), length in beats, and pitch.

    `semitones` count from the D above middle C (293.66 Hz).
    """

    beat: float
    instrument: Instrument
    gain: float = 1.0
    length_beats: float = 1.0
    semitones: int = 0

    @property
    def frequency_hz(self) -> float:
        """Frequency of the pitch."""
        return float(293.66 * 2 ** (self.semitones / 12))


def render_notes(notes: Iterable[Note], seconds_per_beat: float, duration_s: float) -> Array:
    """Return the notes as samples (n, 2) of `duration_s` seconds, each attack on its beat to the sample.

    Tones that would last beyond the end are faded out. Raises ValueError for a note that starts outside.
    """
    count = round(duration_s * SAMPLE_RATE_HZ)
    sides = np.zeros((count, 2))
    tones: dict[tuple[Instrument, int, float], Array] = {}
    for note in notes:
        start = round(note.beat * seconds_per_beat * SAMPLE_RATE_HZ)
        if not 0 <= start < count:
            raise ValueError(f"the {note.instrument} at beat {note.beat} is outside the {duration_s:g} s of the music")
        gain, pan = _GAIN_AND_PAN[note.instrument]
        key = note.instrument, note.semitones, note.length_beats
        if key not in tones:
            tones[key] = _synthesise_note(note, seconds_per_beat)
        tone = tones[key][: count - start] * (gain * note.gain)
        # equal-power panning
        angle = (pan + 1) * np.pi / 4
        sides[start : start + len(tone)] += tone[:, None] * [np.cos(angle), np.sin(angle)]
    mixed = sides.copy()
    for delay, share, side in _EARLY_REFLECTIONS:
        later, angle = round(delay * SAMPLE_RATE_HZ), (side + 1) * np.pi / 4
        mixed[later:] += share * sides.mean(axis=1)[: count - later, None] * [np.cos(angle), np.sin(angle)]
    fade = round(min(0.25, duration_s / 2) * SAMPLE_RATE_HZ)
    mixed[-fade:] *= np.linspace(1, 0, fade)[:, None]
    # soft clipping of peaks instead of a lower overall gain
    rounded: Array = PEAK_LIMIT * np.tanh(mixed / PEAK_LIMIT)
    return rounded


def _synthesise_note(note: Note, seconds_per_beat: float) -> Array:
    if note.instrument == "flute":
        return instruments.blow_flute(note.frequency_hz, note.length_beats * seconds_per_beat)
    if note.instrument == "string":
        return instruments.pluck_string(note.frequency_hz, max(note.length_beats * seconds_per_beat, 0.35))
    struck: dict[Instrument, Callable[[], Array]] = {
        "great drum": instruments.strike_great_drum,
        "hand drum": instruments.strike_hand_drum,
        "clappers": instruments.strike_clappers,
        "bell": instruments.strike_bell,
    }
    return struck[note.instrument]()
