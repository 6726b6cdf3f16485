"""The instruments of the demo's music, as sounds made of partials and noise.

Each gives one note (n,), mono, at `RATE` samples a second, its loudest sample `strength`. Nothing is recorded, and what
is random is the same every time. Partials of struck bars: Fletcher and Rossing, The Physics of Musical
Instruments (1998), chapters 2 and 18.
"""

from __future__ import annotations

import numpy as np

from bunraku.motion.rotation import Array

RATE = 48_000
"""Samples a second."""


def frequency(note: float) -> float:
    """Hertz of a note by its MIDI number; 69 is the A of 440."""
    return 440.0 * float(2.0 ** ((note - 69.0) / 12.0))


def shamisen(note: float, seconds: float, strength: float = 1.0) -> Array:
    """A string struck by the plectrum near its end, on a skin: bright at once, then dark; low strings buzz (sawari)."""
    time, pitch = _time(seconds), frequency(note)
    partials = np.arange(1, int(min(24, 9_000 / pitch)) + 1)
    # struck an eighth of the string's length from its end
    heights = np.sin(np.pi * partials / 8.0) / partials**0.8
    decays = 3.2 + 1.1 * partials * (pitch / 300.0) ** 0.5
    # as the string swings widely at first, it is a little sharp then
    phase = 2.0 * np.pi * pitch * (time + 0.0016 * strength * (1.0 - np.exp(-time / 0.05)))
    string = _partials(phase, partials * np.sqrt(1.0 + 2e-4 * partials**2), heights, decays, time)
    buzz = 0.12 * string * np.sin(phase * 0.5) * np.exp(-time * 5.0) if note < 60 else 0.0
    skin = 0.5 * _noise(len(time), 1) * np.exp(-time * 170.0) + 0.35 * np.sin(2 * np.pi * 190 * time) * np.exp(
        -time * 60
    )
    return _note(string + buzz + skin, strength, seconds)


def flute(note: float, seconds: float, strength: float = 1.0) -> Array:
    """A bamboo flute: it comes up to its note from below, trembles the more the longer it sounds, and one hears the
    breath."""
    time, pitch = _time(seconds), frequency(note)
    tremble = 0.006 * np.clip(time / 0.8, 0.0, 1.0) * np.sin(2.0 * np.pi * 5.1 * time)
    bend = 1.0 - 0.03 * np.exp(-time / 0.05) + tremble
    phase = 2.0 * np.pi * np.cumsum(pitch * bend) / RATE
    tone = np.sin(phase) + 0.32 * np.sin(2.0 * phase) + 0.14 * np.sin(3.0 * phase) + 0.04 * np.sin(4.0 * phase)
    breath = 0.12 * _band(_noise(len(time), 2), pitch, 2_200.0)
    swell = np.clip(time / 0.09, 0.0, 1.0) ** 1.5 * (1.0 + 8.0 * tremble) * np.clip((seconds - time) / 0.12, 0.0, 1.0)
    return _note((tone + breath) * swell * 0.5, strength, seconds)


def large_drum(strength: float = 1.0) -> Array:
    """A barrel drum (o-daiko): a deep membrane, its tone falling as it dies away, and the thud of the stick."""
    seconds = 2.4
    time = _time(seconds)
    phase = 2.0 * np.pi * (58.0 * time + 0.9 * (1.0 - np.exp(-time / 0.035)))
    ratios, heights, decays = np.array([1.0, 1.59, 2.14, 2.65]), np.array([1.0, 0.45, 0.24, 0.12]), [3.2, 6.5, 10, 15]
    skin = _partials(phase, ratios, heights, np.array(decays), time)
    stick = 0.5 * _band(_noise(len(time), 3), 30.0, 900.0) * np.exp(-time * 75.0)
    return _note(skin + stick, strength, seconds)


def small_drum(strength: float = 1.0) -> Array:
    """A tightly laced drum (shime-daiko): short, high and dry."""
    seconds = 0.5
    time = _time(seconds)
    phase = 2.0 * np.pi * (385.0 * time + 0.25 * (1.0 - np.exp(-time / 0.01)))
    ratios, heights = np.array([1.0, 1.59, 2.3, 2.92]), np.array([1.0, 0.6, 0.35, 0.2])
    skin = _partials(phase, ratios, heights, np.array([17.0, 26.0, 38.0, 50.0]), time)
    stick = 0.5 * _band(_noise(len(time), 4), 1_500.0, 7_000.0) * np.exp(-time * 120.0)
    return _note(skin + stick, strength, seconds)


def clappers(strength: float = 1.0) -> Array:
    """Two blocks of oak struck together (ki), or on a board (tsuke): bars, free at both ends."""
    seconds = 0.45
    time = _time(seconds)
    ratios, heights = np.array([1.0, 2.756, 5.404, 1.41]), np.array([1.0, 0.55, 0.2, 0.4])
    wood = _partials(2.0 * np.pi * 1_320.0 * time, ratios, heights, np.array([34.0, 55.0, 90.0, 48.0]), time)
    click = 0.9 * _band(_noise(len(time), 5), 2_000.0, 11_000.0) * np.exp(-time * 420.0)
    return _note(wood + click, strength, seconds)


def bell(note: float, seconds: float, strength: float = 1.0) -> Array:
    """A small bowl of bronze (rin): few partials, none of them a multiple, and slow beats between near ones."""
    time = _time(seconds)
    ratios = np.array([1.0, 1.003, 2.71, 2.716, 5.15])
    heights, decays = np.array([0.6, 0.4, 0.3, 0.2, 0.1]), np.array([0.9, 0.9, 1.9, 1.9, 4.0])
    bowl = _partials(2.0 * np.pi * frequency(note) * time, ratios, heights, decays, time)
    return _note(bowl * np.clip(time / 0.004, 0.0, 1.0), strength, seconds)


def _time(seconds: float) -> Array:
    time: Array = np.arange(round(seconds * RATE)) / RATE
    return time


def _partials(phase: Array, ratios: Array, heights: Array, decays: Array, time: Array) -> Array:
    """Partials (k,) that die away by `decays` nepers a second."""
    sound = np.zeros_like(time)
    for ratio, height, decay in zip(ratios, heights, decays, strict=True):
        sound += height * np.sin(ratio * phase) * np.exp(-decay * time)
    return sound


def _noise(samples: int, seed: int) -> Array:
    return np.random.default_rng(seed).uniform(-1.0, 1.0, samples)


def _band(sound: Array, low: float, high: float) -> Array:
    """What lies between two frequencies, with soft edges."""
    hertz = np.fft.rfftfreq(len(sound), 1.0 / RATE)
    kept = 1.0 / (1.0 + (low / np.maximum(hertz, 1.0)) ** 4) / (1.0 + (hertz / high) ** 4)
    band: Array = np.fft.irfft(np.fft.rfft(sound) * kept, len(sound))
    return band


def _note(sound: Array, strength: float, seconds: float) -> Array:
    """Brought to its strength, its last hundredth faded out."""
    peak = float(np.abs(sound).max())
    fade = np.clip((seconds - _time(seconds)) / (0.01 * seconds), 0.0, 1.0)
    faded: Array = sound * fade * (strength / peak if peak > 0.0 else 0.0)
    return faded
