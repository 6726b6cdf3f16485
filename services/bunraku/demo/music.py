"""Music of Sanbasō, First Steps: original, in the manner of the theatre's, on the beat of the steps.

Percussion follows from the score: every stamp is the great drum, every other step the hand drum, every hop the bell,
and each mie has clappers, so that sound matches motion even if the choreography changes. String and flute are written
for it, in the miyako-bushi scale (D, E flat, G, A, B flat).
"""

from __future__ import annotations

from collections.abc import Iterator

from bunraku.demo.choreography import SCORE
from bunraku.demo.mixer import Note, render_notes
from bunraku.demo.score import Hop, Score
from bunraku.motion.rotation import Array

_D, _E_FLAT, _G, _A, _B_FLAT = 0, 1, 5, 7, 8
_OCTAVE = 12
_MIN_MIE_SWING_BEATS = 1.0
"""Shortest swing of a raised knee before the stamp of a mie."""

STRING_NOTES: tuple[tuple[float, int], ...] = (
    # 1 greeting: few tones, far apart
    (0.0, _D - _OCTAVE), (2.0, _A - _OCTAVE), (3.0, _B_FLAT - _OCTAVE), (3.5, _A - _OCTAVE),
    (4.5, _D), (5.5, _E_FLAT), (6.0, _D), (7.0, _A - _OCTAVE), (8.0, _D - _OCTAVE),
    # 2 gliding: it walks along with the feet
    (9.0, _D), (9.5, _E_FLAT), (10.0, _G), (11.0, _A), (11.5, _B_FLAT), (11.75, _A), (12.0, _G),
    (13.0, _A), (13.5, _G), (14.0, _E_FLAT), (14.5, _D), (15.0, _B_FLAT - _OCTAVE), (15.5, _A - _OCTAVE),
    (16.0, _D - _OCTAVE),
    # 3 to the first mie, and the fans
    (16.75, _A), (17.0, _A), (17.25, _B_FLAT), (17.5, _B_FLAT), (18.0, _D - _OCTAVE), (18.0, _D),
    (20.5, _G), (21.0, _A), (21.5, _D + _OCTAVE), (22.0, _B_FLAT), (22.5, _A), (23.0, _G), (23.5, _E_FLAT), (24.0, _D),
    # 4 under the slow turn of the fan: a low string, again and again
    (25.0, _D - _OCTAVE), (26.0, _A - _OCTAVE), (27.0, _D - _OCTAVE), (28.0, _A - _OCTAVE), (29.0, _D - _OCTAVE),
    (30.0, _A - _OCTAVE), (31.0, _B_FLAT - _OCTAVE), (31.5, _A - _OCTAVE), (32.0, _D - _OCTAVE),
    # 5 the crow, and round the stage
    (32.5, _G), (33.0, _A), (33.5, _G), (34.0, _A), (34.5, _B_FLAT), (35.0, _D + _OCTAVE),
    (36.0, _D), (36.5, _E_FLAT), (37.0, _D), (37.5, _G), (38.0, _A), (38.5, _G), (39.0, _E_FLAT), (39.5, _D),
    (40.0, _A - _OCTAVE), (40.5, _B_FLAT - _OCTAVE), (41.0, _D), (41.25, _D), (41.5, _E_FLAT), (41.75, _E_FLAT),
    # 6 the last mie, and the bow
    (42.0, _G), (42.25, _A), (42.5, _B_FLAT), (42.75, _D + _OCTAVE), (43.0, _D - _OCTAVE), (43.0, _D),
    (45.0, _A - _OCTAVE), (45.5, _B_FLAT - _OCTAVE), (46.0, _A - _OCTAVE), (46.5, _D - _OCTAVE),
)  # fmt: skip
"""Beat and pitch."""
FLUTE_NOTES: tuple[tuple[float, float, int], ...] = (
    (3.75, 1.5, _A), (5.5, 1.25, _B_FLAT), (6.75, 1.0, _A),
    (10.0, 2.0, _D + _OCTAVE), (12.0, 1.0, _B_FLAT), (13.0, 2.0, _A), (15.0, 1.0, _G),
    (19.0, 1.0, _E_FLAT + _OCTAVE), (20.0, 0.9, _D + _OCTAVE), (22.0, 2.0, _A),
    (24.5, 1.5, _D), (26.0, 1.5, _E_FLAT), (27.5, 1.5, _G), (29.0, 1.5, _A), (30.5, 1.5, _B_FLAT),
    (37.0, 1.5, _A), (38.5, 1.5, _B_FLAT), (40.0, 1.75, _D + _OCTAVE),
    (44.0, 1.5, _A), (45.5, 2.0, _D),
)  # fmt: skip
"""Beat, length in beats and pitch."""


def percussion_notes(score: Score) -> Iterator[Note]:
    """Yield the percussion of each footfall."""
    for footfall in score.list_footfalls():
        if isinstance(footfall, Hop):
            yield Note(footfall.beat, "bell")
            yield Note(footfall.beat, "hand drum", 1.2)
        elif footfall.is_stamp:
            yield Note(footfall.beat, "great drum")
            if footfall.swing_beats >= _MIN_MIE_SWING_BEATS:
                # clappers at the landing, and in the silence after it
                yield Note(footfall.beat, "clappers", 1.2)
                yield Note(footfall.beat + 0.5, "clappers", 0.8)
        else:
            yield Note(footfall.beat, "hand drum", 0.5)


def all_notes() -> list[Note]:
    """Return all notes of the music."""
    strings = [Note(beat, "string", 1.15 if beat % 1 == 0 else 0.9, 1.5, pitch) for beat, pitch in STRING_NOTES]
    flutes = [Note(beat, "flute", 1.0, beats, pitch) for beat, beats, pitch in FLUTE_NOTES]
    return [*strings, *flutes, *percussion_notes(SCORE)]


def render_music() -> Array:
    """Return the music as samples (n, 2) at 48 kHz, as long as the motion."""
    return render_notes(all_notes(), SCORE.seconds_per_beat, SCORE.duration)
