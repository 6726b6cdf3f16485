"""Accuracy of the arm solver: distance of tips from targets, angles against the true minimum, joint limits."""

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
    """Accuracy for one body.

    Lengths are fractions of the arm length; the angle error of a target is the maximum of its three angle errors.
    """

    tip_error_max: float
    limits_broken_by: float
    """Maximum excess over a limit of elbow or wrist, radians."""
    angle_error_mean_deg: float
    angle_error_p99_deg: float
    angle_error_max_deg: float
    paper_tip_mean: float
    paper_tip_max: float


def random_reachable_targets(proportions: Proportions, count: int, random: np.random.Generator) -> Array:
    """Return hand tip positions (count, 3), uniform in distance, elevation and azimuth.

    Compared with a uniform distribution in space, more of them lie near the shoulder and its axis, where angles change
    fastest."""
    r = random.uniform(proportions.min_tip_distance, MAX_TIP_DISTANCE, count)
    beta, azimuth = random.uniform(-0.5 * pi, 0.5 * pi, count), random.uniform(-pi, pi, count)
    level = r * np.cos(beta)
    return np.stack([level * np.sin(azimuth), r * np.sin(beta), level * np.cos(azimuth)], axis=-1)


def potential_energy(proportions: Proportions, angles: tuple[Array, Array, Array]) -> Array:
    """Return the potential energy E of link angles (paper, section 4.2), without g."""
    (l0, l1, l2), (m0, m1, m2) = proportions.lengths, proportions.masses
    s0, s1, s2 = (np.sin(angle) for angle in angles)
    wrist = l0 * s0 + l1 * s1
    tip = wrist + l2 * s2
    result: Array = (m0 * l0 * s0 + m1 * (l0 * s0 + wrist) + m2 * (tip + wrist)) / 2.0
    return result


def minimum_energy_angles(proportions: Proportions, r: Array, beta: Array) -> Array:
    """Return the angles (3, n) of minimum E within the joint limits, searched for each target without a table.

    All bends are sampled; then a golden-section search runs between the neighbours of the lowest sample."""
    low, high = wrist_bend_limits(proportions, r)

    def energy_at(share: Array) -> Array:
        return potential_energy(proportions, close_chain(proportions, r, beta, low + share * (high - low)))

    best, lowest = np.zeros(r.shape), np.full(r.shape, np.inf)
    for share in np.linspace(0.0, 1.0, _SCAN_SAMPLES):
        energy = energy_at(np.full(r.shape, share))
        best, lowest = np.where(energy < lowest, share, best), np.minimum(energy, lowest)
    left, right = np.maximum(best - 1.0 / (_SCAN_SAMPLES - 1), 0.0), np.minimum(best + 1.0 / (_SCAN_SAMPLES - 1), 1.0)
    for _ in range(40):
        span = _GOLDEN_RATIO * (right - left)
        lower = energy_at(right - span) < energy_at(left + span)
        left, right = np.where(lower, left, right - span), np.where(lower, left + span, right)
    return np.array(close_chain(proportions, r, beta, low + 0.5 * (left + right) * (high - low)))


def measure_accuracy(proportions: Proportions, table: BendTable, count: int, random: np.random.Generator) -> Accuracy:
    """Measure the accuracy over `count` targets; tips over ten times as many."""
    many = random_reachable_targets(proportions, 10 * count, random)
    solved = arm_batch.solve_arms(proportions, table, many)
    t0, t1, t2 = solved.angles()
    elbow, wrist = t1 - t0, t2 - t1
    limit_excess = max(
        float((-elbow).max()),
        float((elbow - MAX_ELBOW_BEND_RAD).max()),
        float((-wrist).max()),
        float((wrist - MAX_WRIST_BEND_RAD).max()),
    )
    targets = many[:count]
    r, beta = np.linalg.norm(targets, axis=1), np.arctan2(targets[:, 1], np.hypot(targets[:, 0], targets[:, 2]))
    angle_errors = np.degrees(
        np.abs(np.array([t0, t1, t2])[:, :count] - minimum_energy_angles(proportions, r, beta))
    ).max(axis=0)
    # the tip of the solver, and the tip computed from the three angles
    tip = joint_positions(proportions, np.array([t0, t1, t2]))[2]
    expected = np.hypot(many[:, 0], many[:, 2]) + 1j * many[:, 1]
    paper_errors = tip_error(
        proportions,
        build_paper_table(proportions),
        random.uniform(0.0, 1.0, 10 * count),
        random.uniform(-0.5, 0.5, 10 * count) * pi,
    )
    return Accuracy(
        tip_error_max=max(float(np.linalg.norm(solved.tip - many, axis=1).max()), float(np.abs(tip - expected).max())),
        limits_broken_by=max(limit_excess, 0.0),
        angle_error_mean_deg=float(angle_errors.mean()),
        angle_error_p99_deg=float(np.percentile(angle_errors, 99)),
        angle_error_max_deg=float(angle_errors.max()),
        paper_tip_mean=float(paper_errors.mean()),
        paper_tip_max=float(paper_errors.max()),
    )
