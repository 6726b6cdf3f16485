"""How exact an arm is: tips on their targets, angles against the true minimum, joints within their limits."""

from __future__ import annotations

from math import pi
from typing import NamedTuple

import numpy as np

from bunraku.marionette import arm_batch
from bunraku.marionette.arm import BendTable, close_chain, wrist_bend_limits
from bunraku.marionette.constants import MAX_ELBOW_BEND_RAD, MAX_TIP_DISTANCE, MAX_WRIST_BEND_RAD
from bunraku.marionette.paper import build_paper_table, joint_positions, tip_error
from bunraku.marionette.proportions import Proportions
from bunraku.motion.rotation import Array

_SCAN_SAMPLES = 257
_GOLDEN_RATIO = (5.0**0.5 - 1.0) / 2.0


class Accuracy(NamedTuple):
    """Of one body. Lengths are parts of the arm's; the angle error of a target is the largest of its three angles'."""

    tip_error_max: float
    limits_broken_by: float
    """Radians beyond a limit of elbow or wrist, at most."""
    angle_error_mean_deg: float
    angle_error_p99_deg: float
    angle_error_max_deg: float
    paper_tip_mean: float
    paper_tip_max: float


def random_reachable_targets(proportions: Proportions, count: int, random: np.random.Generator) -> Array:
    """Hand tips (count, 3), even in distance, elevation and azimuth: more of them near the shoulder and its axis, where
    angles change fastest, than evenly in space."""
    r = random.uniform(proportions.min_tip_distance, MAX_TIP_DISTANCE, count)
    beta, azimuth = random.uniform(-0.5 * pi, 0.5 * pi, count), random.uniform(-pi, pi, count)
    level = r * np.cos(beta)
    return np.stack([level * np.sin(azimuth), r * np.sin(beta), level * np.cos(azimuth)], axis=-1)


def potential_energy(proportions: Proportions, angles: tuple[Array, Array, Array]) -> Array:
    """The paper's E (4.2) of link angles, without g."""
    (l0, l1, l2), (m0, m1, m2) = proportions.lengths, proportions.masses
    s0, s1, s2 = (np.sin(angle) for angle in angles)
    wrist = l0 * s0 + l1 * s1
    tip = wrist + l2 * s2
    result: Array = (m0 * l0 * s0 + m1 * (l0 * s0 + wrist) + m2 * (tip + wrist)) / 2.0
    return result


def minimum_energy_angles(proportions: Proportions, r: Array, beta: Array) -> Array:
    """The angles (3, n) of least E within the joints' limits, each target searched by itself: all bends, then the
    golden section between the lowest's neighbours. No table has a part in it."""
    low, high = wrist_bend_limits(proportions, r)

    def height(share: Array) -> Array:
        return potential_energy(proportions, close_chain(proportions, r, beta, low + share * (high - low)))

    best, lowest = np.zeros(r.shape), np.full(r.shape, np.inf)
    for share in np.linspace(0.0, 1.0, _SCAN_SAMPLES):
        here = height(np.full(r.shape, share))
        best, lowest = np.where(here < lowest, share, best), np.minimum(here, lowest)
    left, right = np.maximum(best - 1.0 / (_SCAN_SAMPLES - 1), 0.0), np.minimum(best + 1.0 / (_SCAN_SAMPLES - 1), 1.0)
    for _ in range(40):
        span = _GOLDEN_RATIO * (right - left)
        lower = height(right - span) < height(left + span)
        left, right = np.where(lower, left, right - span), np.where(lower, left + span, right)
    return np.array(close_chain(proportions, r, beta, low + 0.5 * (left + right) * (high - low)))


def measure_accuracy(proportions: Proportions, table: BendTable, count: int, random: np.random.Generator) -> Accuracy:
    """The accuracy over `count` targets; their tips over ten times as many."""
    many = random_reachable_targets(proportions, 10 * count, random)
    solved = arm_batch.solve_arms(proportions, table, many)
    t0, t1, t2 = solved.angles()
    elbow, wrist = t1 - t0, t2 - t1
    broken = max(
        float((-elbow).max()),
        float((elbow - MAX_ELBOW_BEND_RAD).max()),
        float((-wrist).max()),
        float((wrist - MAX_WRIST_BEND_RAD).max()),
    )
    targets = many[:count]
    r, beta = np.linalg.norm(targets, axis=1), np.arctan2(targets[:, 1], np.hypot(targets[:, 0], targets[:, 2]))
    off = np.degrees(np.abs(np.array([t0, t1, t2])[:, :count] - minimum_energy_angles(proportions, r, beta))).max(
        axis=0
    )
    # the tip as it was solved, and as the three angles alone put it
    tip = joint_positions(proportions, np.array([t0, t1, t2]))[2]
    wanted = np.hypot(many[:, 0], many[:, 2]) + 1j * many[:, 1]
    theirs = tip_error(
        proportions,
        build_paper_table(proportions),
        random.uniform(0.0, 1.0, 10 * count),
        random.uniform(-0.5, 0.5, 10 * count) * pi,
    )
    return Accuracy(
        tip_error_max=max(float(np.linalg.norm(solved.tip - many, axis=1).max()), float(np.abs(tip - wanted).max())),
        limits_broken_by=max(broken, 0.0),
        angle_error_mean_deg=float(off.mean()),
        angle_error_p99_deg=float(np.percentile(off, 99)),
        angle_error_max_deg=float(off.max()),
        paper_tip_mean=float(theirs.mean()),
        paper_tip_max=float(theirs.max()),
    )
