"""Bonds of two hands, frame by frame (`bonds.json`).

The shoulders move by a formula: position and rotation vector are base + swing * sin(2 pi hertz t + phase), component by
component, with t in seconds.
"""

from __future__ import annotations

from math import inf
from typing import Any

import numpy as np

from bunraku.marionette.bond.bond import Bond, BondedHand, HandMotion, is_in_reach, recency_share
from bunraku.marionette.bond.carrier import Shoulder
from bunraku.marionette.solver.vector import Vector
from bunraku.motion import rotation
from bunraku.motion.rotation import Array

FRAME_COUNT = 180
FRAME_S = 1.0 / 60.0
FRAME_STRIDE = 3


def shoulder_at(path: dict[str, Any], frame: int) -> Shoulder:
    """Return a shoulder of a case at a frame."""
    numbers = {key: np.array(path[key]) for key in ("base", "swing", "hertz", "phase")}
    waves = np.sin(2.0 * np.pi * numbers["hertz"] * frame * FRAME_S + numbers["phase"])
    position, turn = numbers["base"] + numbers["swing"] * waves
    w, x, y, z = rotation.from_rotation_vector(turn).tolist()
    return Shoulder(_vector(position), (w, x, y, z), path["arm_length_m"], path["min_tip_distance"])


def make_case(seed: int, leads: tuple[bool, bool], distance: float, drift: float) -> dict[str, Any]:
    """Return a random case: whether each hand has goals, and how far the shoulders are and swing apart, metres."""
    random = np.random.default_rng(seed)
    shoulders = []
    for side in (0, 1):
        base = np.zeros((2, 3))
        base[0] = (side * distance, 1.4, 0.0)
        base[1, 1] = (0.3, 3.0)[side]
        swing = random.uniform(0.0, 0.12, (2, 3))
        swing[0, 0] += drift * side
        shoulders.append(
            {
                "base": base.tolist(),
                "swing": np.round(swing, 4).tolist(),
                "hertz": np.round(random.uniform(0.1, 0.7, (2, 3)), 4).tolist(),
                "phase": np.round(random.uniform(0.0, 6.2, (2, 3)), 4).tolist(),
                "arm_length_m": (0.65, 0.58)[side],
                "min_tip_distance": (0.12, 0.16)[side],
            }
        )
    hands = [
        {"place": _random_place(random), "velocity": [round(float(v), 4) for v in random.uniform(-1.0, 1.0, 3)]}
        for _ in "ab"
    ]
    asked: list[list[Any]] = [[0, side, _random_place(random)] for side in (0, 1) if leads[side]]
    for frame in sorted(random.integers(1, FRAME_COUNT, 14).tolist()):
        side = int(random.integers(2)) if all(leads) else int(leads[1])
        asked.append([frame, side, _random_place(random)])
    return {
        "shoulders": shoulders,
        "hands": hands,
        "asked": asked,
        "every": FRAME_STRIDE,
        "frames": _play(shoulders, hands, asked),
    }


def _play(shoulders: list[dict[str, Any]], hands: list[dict[str, Any]], asked: list[list[Any]]) -> list[Any]:
    """Return share and both positions of every third frame; the list ends where the bond does."""
    goals: list[Vector | None] = [None, None]
    ages_s = [inf, inf]
    bond: Bond | None = None
    frames: list[Any] = []
    for frame in range(FRAME_COUNT):
        ages_s = [age + FRAME_S for age in ages_s]
        for begin, side, place in asked:
            if begin == frame:
                goals[side], ages_s[side] = _vector(place), 0.0
        first, second = (shoulder_at(path, frame) for path in shoulders)
        pair = (BondedHand(first, goals[0]), BondedHand(second, goals[1]))
        share = recency_share(*ages_s)
        if not is_in_reach(first, second):
            break
        if bond is None:
            motions = [HandMotion(_vector(hand["place"]), _vector(hand["velocity"])) for hand in hands]
            bond = Bond(pair, (motions[0], motions[1]), share)
        elif not bond.step(pair, share, FRAME_S):
            break
        if frame % FRAME_STRIDE == 0:
            frames.append([bond.share, *map(list, bond.positions)])
    return frames


def _random_place(random: np.random.Generator) -> list[float]:
    direction = random.normal(size=3)
    place = direction / np.linalg.norm(direction) * random.uniform(0.2, 0.95)
    return [round(float(part), 4) for part in place]


def _vector(numbers: Array | list[float]) -> Vector:
    x, y, z = (float(number) for number in numbers)
    return (x, y, z)


def _age(seconds: float | None) -> float:
    return inf if seconds is None else seconds


def make_vectors() -> dict[str, Any]:
    """Return the content of the file."""
    ages: list[tuple[float | None, float | None]] = [
        (0.0, 0.0),
        (0.0, 0.25),
        (1.0, 0.1),
        (30.0, 0.0),
        (None, 2.0),
        (0.3, None),
        (None, None),
    ]
    return {
        "seconds": FRAME_S,
        "shares": [[first, second, recency_share(_age(first), _age(second))] for first, second in ages],
        "cases": [
            make_case(1, (True, True), 0.4, 0.0),
            make_case(2, (True, True), 0.75, 0.0),
            make_case(3, (True, False), 0.7, 0.0),
            make_case(4, (False, True), 0.95, 0.1),
            make_case(5, (True, True), 0.8, 0.55),
        ],
    }
