"""Faults of a network between a capture tool and the receiver: loss, duplicates, jitter, reordering, clock drift."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, slots=True)
class Faults:
    """Faults of one connection; `reordering` is the share of frames that are late by up to `reordering_s`."""

    loss: float = 0.05
    duplicates: float = 0.05
    jitter_s: float = 0.005
    reordering: float = 0.05
    reordering_s: float = 0.1
    drift: float = 200e-6
    offset_s: float = 1234.5


@dataclass(frozen=True, slots=True)
class Arrival:
    """Arrival of frame `number` at `arrival_s`, which the sender's clock dated `sender_s`."""

    number: int
    sender_s: float
    arrival_s: float


def simulate_arrivals(count: int, fps: float, faults: Faults, seed: int) -> list[Arrival]:
    """Return the arrivals of `count` frames in order of time."""
    chance = np.random.default_rng(seed)
    arrivals = []
    for number in range(count):
        sampled_s = number / fps
        sender_s = sampled_s * (1.0 + faults.drift) + faults.offset_s
        for _ in range(1 + (chance.random() < faults.duplicates)):
            delay_s = 0.002 + chance.exponential(faults.jitter_s / 3) if faults.jitter_s else 0.002
            if chance.random() < faults.reordering:
                delay_s += chance.uniform(0.0, faults.reordering_s)
            if chance.random() >= faults.loss:
                arrivals.append(Arrival(number, sender_s, sampled_s + delay_s))
    return sorted(arrivals, key=lambda arrival: arrival.arrival_s)
