"""Tones put where their beats are, in a room: notes to stereo samples."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from bunraku.motion.rotation import Array
from bunraku.music import instruments
from bunraku.music.instruments import SAMPLE_RATE

Player = Literal["string", "flute", "great drum", "hand drum", "clappers", "bell"]

LOUDEST = 0.8
"""Of any sample: what is encoded may come out a little louder."""
_SEATS: dict[Player, tuple[float, float]] = {
    "string": (0.30, -0.35),
    "flute": (0.20, 0.4),
    "great drum": (0.85, 0.0),
    "hand drum": (0.45, 0.25),
    "clappers": (0.40, -0.6),
    "bell": (0.16, 0.6),
}
"""How loud a player is, and where: -1 is left, 1 right."""
_ECHOES = ((0.023, 0.16, -0.8), (0.037, 0.13, 0.8), (0.059, 0.09, -0.5), (0.083, 0.07, 0.6))
"""What a wooden hall sends back: seconds, share and side."""


@dataclass(frozen=True, slots=True)
class Note:
    """Who plays at which beat, how loudly (1: as ever), for how many beats, and which pitch where it has one: semitones
    above the D below the middle of the keyboard's treble (293.66 Hz)."""

    beat: float
    player: Player
    loud: float = 1.0
    beats: float = 1.0
    pitch: int = 0

    @property
    def hertz(self) -> float:
        """Frequency of its pitch."""
        return float(293.66 * 2 ** (self.pitch / 12))


def perform(notes: Iterable[Note], seconds_per_beat: float, seconds: float) -> Array:
    """The notes as samples (n, 2) of `seconds`, each attack at its beat to the sample; what would sound on past the end
    is faded. Raises ValueError for a note that begins outside."""
    count = round(seconds * SAMPLE_RATE)
    sides = np.zeros((count, 2))
    tones: dict[tuple[Player, int, float], Array] = {}
    for note in notes:
        start = round(note.beat * seconds_per_beat * SAMPLE_RATE)
        if not 0 <= start < count:
            raise ValueError(f"the {note.player} at beat {note.beat} is outside the {seconds:g} s of the music")
        loud, side = _SEATS[note.player]
        key = note.player, note.pitch, note.beats
        if key not in tones:
            tones[key] = _tone(note, seconds_per_beat)
        tone = tones[key][: count - start] * (loud * note.loud)
        # of equal power wherever it comes from
        angle = (side + 1) * np.pi / 4
        sides[start : start + len(tone)] += tone[:, None] * [np.cos(angle), np.sin(angle)]
    mixed = sides.copy()
    for delay, share, side in _ECHOES:
        later, angle = round(delay * SAMPLE_RATE), (side + 1) * np.pi / 4
        mixed[later:] += share * sides.mean(axis=1)[: count - later, None] * [np.cos(angle), np.sin(angle)]
    fade = round(min(0.25, seconds / 2) * SAMPLE_RATE)
    mixed[-fade:] *= np.linspace(1, 0, fade)[:, None]
    # the loudest places are rounded off, not the whole turned down for them
    rounded: Array = LOUDEST * np.tanh(mixed / LOUDEST)
    return rounded


def _tone(note: Note, seconds_per_beat: float) -> Array:
    if note.player == "flute":
        return instruments.flute(note.hertz, note.beats * seconds_per_beat)
    if note.player == "string":
        return instruments.string(note.hertz, max(note.beats * seconds_per_beat, 0.35))
    struck: dict[Player, Callable[[], Array]] = {
        "great drum": instruments.great_drum,
        "hand drum": instruments.hand_drum,
        "clappers": instruments.clappers,
        "bell": instruments.bell,
    }
    return struck[note.player]()
