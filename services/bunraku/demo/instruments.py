"""Instruments of the puppet theatre and of Nihon-buyō, told by their partials: a string, a flute, drums, wood, metal.

Each gives a tone's samples (n,), about -1..1 at its loudest, 48,000 a second, from its attack to its last breath.
Frequencies are in Hz, times in seconds. Nothing is recorded, and the same tone is the same samples.
"""

from __future__ import annotations

import numpy as np

from bunraku.motion.rotation import Array

SAMPLE_RATE_HZ = 48_000
MAX_PARTIAL_HZ = 14_000.0
"""Hz, of any partial."""


def pluck_string(frequency_hz: float, duration_s: float) -> Array:
    """A long-necked lute, struck with a plectrum that hits the skin too: bright, and soon gone."""
    time = _sample_times(duration_s)
    tone = np.zeros(len(time))
    for partial in range(1, 25):
        # a stiff string's partials are a little sharp
        pitch = frequency_hz * partial * np.sqrt(1 + 0.00018 * partial**2)
        if pitch > MAX_PARTIAL_HZ:
            break
        # plucked near its end; the buzz of the low neck keeps the fourth to the ninth alive
        loud = np.sin(np.pi * partial * 0.11) / partial**0.9 * (1.7 if 4 <= partial <= 9 else 1.0)
        tone += loud * np.sin(2 * np.pi * pitch * time) * np.exp(-time * (1.8 + 0.55 * partial))
    skin = np.sin(2 * np.pi * 210.0 * time) * np.exp(-time * 55) + 0.6 * _noise(len(time), 1) * np.exp(-time * 240)
    return _apply_envelope(0.75 * tone + 0.35 * skin, duration_s, 0.001)


def blow_flute(frequency_hz: float, duration_s: float) -> Array:
    """A bamboo flute: it comes from below, breathes, and begins to waver."""
    time = _sample_times(duration_s)
    waver = np.clip(time / 0.6 - 0.5, 0, 1) * 0.006 * np.sin(2 * np.pi * 5.1 * time)
    scoop = -0.03 * np.exp(-time * 18)
    phase = 2 * np.pi * frequency_hz * np.cumsum(1 + waver + scoop) / SAMPLE_RATE_HZ
    tone = sum(loud * np.sin(number * phase) for number, loud in ((1, 1.0), (2, 0.32), (3, 0.14), (4, 0.04)))
    # breath is noise about the tone's own pitch
    breath = _noise(len(time), 2) * np.sin(phase) * (0.10 + 0.25 * np.exp(-time * 12))
    swell = 0.75 + 0.25 * np.sin(np.pi * np.minimum(time / duration_s, 1))
    return _apply_envelope(0.7 * (np.asarray(tone) + breath) * swell, duration_s, 0.05, 0.12)


def strike_great_drum(duration_s: float = 0.9) -> Array:
    """A barrel drum struck in the middle of its skin, as a stamp on the stage's hollow floor is heard."""
    time = _sample_times(duration_s)
    phase = 2 * np.pi * np.cumsum(68 + 60 * np.exp(-time * 30)) / SAMPLE_RATE_HZ
    skin = np.sin(phase) * np.exp(-time * 6) + 0.3 * np.sin(1.59 * phase) * np.exp(-time * 12)
    return _apply_envelope(0.85 * skin + 0.4 * _noise(len(time), 3) * np.exp(-time * 160), duration_s, 0.001)


def strike_hand_drum(duration_s: float = 0.5) -> Array:
    """An hourglass drum on the shoulder, whose cords are pressed as it sounds: pon, its pitch rising."""
    time = _sample_times(duration_s)
    phase = 2 * np.pi * np.cumsum(255 + 45 * (1 - np.exp(-time * 14))) / SAMPLE_RATE_HZ
    skin = np.sin(phase) * np.exp(-time * 11) + 0.25 * np.sin(2.3 * phase) * np.exp(-time * 26)
    return _apply_envelope(0.8 * skin + 0.3 * _noise(len(time), 4) * np.exp(-time * 220), duration_s, 0.001)


def strike_clappers(duration_s: float = 0.25) -> Array:
    """Two blocks of oak struck together: dry, and heard through everything."""
    time = _sample_times(duration_s)
    tone = sum(
        loud * np.sin(2 * np.pi * pitch * time) * np.exp(-time * fade)
        for pitch, loud, fade in ((1180.0, 0.6, 34), (1905.0, 0.5, 46), (3320.0, 0.35, 70), (5210.0, 0.2, 110))
    )
    return _apply_envelope(np.asarray(tone) + 0.3 * _noise(len(time), 5) * np.exp(-time * 400), duration_s, 0.0005)


def strike_bell(duration_s: float = 1.4) -> Array:
    """A small hand gong, struck softly at its rim."""
    time = _sample_times(duration_s)
    tone = sum(
        loud * np.sin(2 * np.pi * pitch * time) * np.exp(-time * fade)
        for pitch, loud, fade in ((1046.0, 0.5, 3.0), (1052.5, 0.4, 3.4), (2478.0, 0.3, 6.5), (4021.0, 0.15, 11))
    )
    return _apply_envelope(np.asarray(tone), duration_s, 0.002)


def _sample_times(duration_s: float) -> Array:
    return np.arange(round(duration_s * SAMPLE_RATE_HZ)) / SAMPLE_RATE_HZ


def _noise(count: int, seed: int) -> Array:
    return np.random.default_rng(seed).uniform(-1, 1, count)


def _apply_envelope(tone: Array, duration_s: float, attack: float, release: float = 0.03) -> Array:
    """The tone with its first and last instants eased, so that neither is a click of its own."""
    time = _sample_times(duration_s)
    eased: Array = tone * np.minimum(time / attack, 1) * np.clip((duration_s - time) / release, 0, 1)
    return eased
