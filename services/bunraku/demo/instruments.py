"""Synthesised instruments of puppet theatre and Nihon-buyō: string, flute, drums, wood, metal.

Each function returns a tone's samples (n,), about -1..1 at its peak, at 48 kHz, from attack to decay. Frequencies are
in Hz, times in seconds. Nothing is recorded, and the same tone gives the same samples.
"""

from __future__ import annotations

import numpy as np

from bunraku.motion.rotation import Array

SAMPLE_RATE_HZ = 48_000
MAX_PARTIAL_HZ = 14_000.0
"""Highest partial of a string."""


def pluck_string(frequency_hz: float, duration_s: float) -> Array:
    """Synthesise a long-necked lute, plucked with a plectrum that also hits the skin: bright and short."""
    time = _sample_times(duration_s)
    tone = np.zeros(len(time))
    for partial in range(1, 25):
        # a stiff string's partials are a little sharp
        pitch = frequency_hz * partial * np.sqrt(1 + 0.00018 * partial**2)
        if pitch > MAX_PARTIAL_HZ:
            break
        # plucked near its end; the buzz of the neck sustains the fourth to ninth partial
        amplitude = np.sin(np.pi * partial * 0.11) / partial**0.9 * (1.7 if 4 <= partial <= 9 else 1.0)
        tone += amplitude * np.sin(2 * np.pi * pitch * time) * np.exp(-time * (1.8 + 0.55 * partial))
    skin = np.sin(2 * np.pi * 210.0 * time) * np.exp(-time * 55) + 0.6 * _noise(len(time), 1) * np.exp(-time * 240)
    return _apply_envelope(0.75 * tone + 0.35 * skin, duration_s, 0.001)


def blow_flute(frequency_hz: float, duration_s: float) -> Array:
    """Synthesise a bamboo flute: pitch scoops up, then breath and a late vibrato."""
    time = _sample_times(duration_s)
    waver = np.clip(time / 0.6 - 0.5, 0, 1) * 0.006 * np.sin(2 * np.pi * 5.1 * time)
    scoop = -0.03 * np.exp(-time * 18)
    phase = 2 * np.pi * frequency_hz * np.cumsum(1 + waver + scoop) / SAMPLE_RATE_HZ
    tone = sum(amplitude * np.sin(number * phase) for number, amplitude in ((1, 1.0), (2, 0.32), (3, 0.14), (4, 0.04)))
    # breath is noise around the tone's pitch
    breath = _noise(len(time), 2) * np.sin(phase) * (0.10 + 0.25 * np.exp(-time * 12))
    swell = 0.75 + 0.25 * np.sin(np.pi * np.minimum(time / duration_s, 1))
    return _apply_envelope(0.7 * (np.asarray(tone) + breath) * swell, duration_s, 0.05, 0.12)


def strike_great_drum(duration_s: float = 0.9) -> Array:
    """Synthesise a barrel drum struck at its centre, like a stamp on a hollow stage floor."""
    time = _sample_times(duration_s)
    phase = 2 * np.pi * np.cumsum(68 + 60 * np.exp(-time * 30)) / SAMPLE_RATE_HZ
    skin = np.sin(phase) * np.exp(-time * 6) + 0.3 * np.sin(1.59 * phase) * np.exp(-time * 12)
    return _apply_envelope(0.85 * skin + 0.4 * _noise(len(time), 3) * np.exp(-time * 160), duration_s, 0.001)


def strike_hand_drum(duration_s: float = 0.5) -> Array:
    """Synthesise a shoulder drum whose cords are squeezed as it sounds: a rising pitch."""
    time = _sample_times(duration_s)
    phase = 2 * np.pi * np.cumsum(255 + 45 * (1 - np.exp(-time * 14))) / SAMPLE_RATE_HZ
    skin = np.sin(phase) * np.exp(-time * 11) + 0.25 * np.sin(2.3 * phase) * np.exp(-time * 26)
    return _apply_envelope(0.8 * skin + 0.3 * _noise(len(time), 4) * np.exp(-time * 220), duration_s, 0.001)


def strike_clappers(duration_s: float = 0.25) -> Array:
    """Synthesise two oak blocks struck together: dry and penetrating."""
    time = _sample_times(duration_s)
    tone = sum(
        amplitude * np.sin(2 * np.pi * pitch * time) * np.exp(-time * fade)
        for pitch, amplitude, fade in ((1180.0, 0.6, 34), (1905.0, 0.5, 46), (3320.0, 0.35, 70), (5210.0, 0.2, 110))
    )
    return _apply_envelope(np.asarray(tone) + 0.3 * _noise(len(time), 5) * np.exp(-time * 400), duration_s, 0.0005)


def strike_bell(duration_s: float = 1.4) -> Array:
    """Synthesise a small hand gong, struck softly at its rim."""
    time = _sample_times(duration_s)
    tone = sum(
        amplitude * np.sin(2 * np.pi * pitch * time) * np.exp(-time * fade)
        for pitch, amplitude, fade in ((1046.0, 0.5, 3.0), (1052.5, 0.4, 3.4), (2478.0, 0.3, 6.5), (4021.0, 0.15, 11))
    )
    return _apply_envelope(np.asarray(tone), duration_s, 0.002)


def _sample_times(duration_s: float) -> Array:
    return np.arange(round(duration_s * SAMPLE_RATE_HZ)) / SAMPLE_RATE_HZ


def _noise(count: int, seed: int) -> Array:
    return np.random.default_rng(seed).uniform(-1, 1, count)


def _apply_envelope(tone: Array, duration_s: float, attack: float, release: float = 0.03) -> Array:
    """Return the tone with eased start and end, so that neither clicks."""
    time = _sample_times(duration_s)
    eased: Array = tone * np.minimum(time / attack, 1) * np.clip((duration_s - time) / release, 0, 1)
    return eased
