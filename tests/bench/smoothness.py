"""Smoothness of claims, control and releases of limbs: the part of `make bench-ik` that needs the whole marionette.

Lengths are in arm lengths, positions in the shoulder's frame, at 60 frames per second.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from itertools import islice
from math import cos, pi, sin
from typing import NamedTuple

import numpy as np

from bunraku.demo import choreography
from bunraku.marionette.bodies import BODIES
from bunraku.marionette.constants import MAX_REACH, MIN_REACH
from bunraku.marionette.elbow import Elbow
from bunraku.marionette.limb_rig import ArmRig, Limb
from bunraku.marionette.merge import Marionette, apply_overlay
from bunraku.marionette.ownership import LimbGrant, LimbInput
from bunraku.marionette.proportions import Proportions
from bunraku.marionette.solver import shoulder as limit
from bunraku.marionette.solver import vector
from bunraku.marionette.solver.elbow_step import elevation
from bunraku.marionette.solver.vector import Vector
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import Figure, standard_figure

FRAME_US = 16_667
HAND_SPEED = 0.5
"""Speed of a hand, arm lengths per second."""
UP = (0.0, 1.0, 0.0)
HandPath = list[Vector]


def straight_path(begin: Vector, end: Vector, speed: float = HAND_SPEED) -> HandPath:
    """Return a hand's path from one position straight to another and back, one position per frame."""
    way = vector.subtract(end, begin)
    steps = max(int(vector.length(way) * 60.0 / speed), 1)
    outward = [vector.add(begin, vector.scale(way, k / steps)) for k in range(steps + 1)]
    return outward + outward[-2::-1]


def circular_path(radius: float, normal: Vector, speed: float, turns: float = 2.0, away: float = 0.0) -> HandPath:
    """Return a hand's path around the shoulder, in the plane of the unit vector `normal`, offset by `away` along it."""
    one = vector.any_perpendicular(normal)
    other = vector.cross(normal, one)
    middle = vector.scale(normal, away)
    steps = int(turns * 2.0 * pi * radius * 60.0 / speed)
    angles = [turns * 2.0 * pi * k / steps for k in range(steps)]
    return [
        vector.add(middle, vector.add(vector.scale(one, radius * cos(a)), vector.scale(other, radius * sin(a))))
        for a in angles
    ]


def slow_paths(inner: float) -> Iterator[HandPath]:
    """Yield paths at `HAND_SPEED` through the reachable shell: over and under the shoulder, in and out, around."""
    random = np.random.default_rng(4)
    for height in (-0.95, -0.6, -0.3, 0.3, 0.6, 0.9):
        for off in (0.0, 1e-9, 1e-6, 1e-3, 0.01, 0.03, 0.1):
            for heading in np.linspace(0.0, pi, 4, endpoint=False):
                ahead, side = (sin(heading), 0.0, cos(heading)), (cos(heading), 0.0, -sin(heading))
                half = 0.9 * (1.0 - height * height) ** 0.5
                middle = vector.add((0.0, height, 0.0), vector.scale(side, off))
                yield straight_path(
                    vector.subtract(middle, vector.scale(ahead, half)), vector.add(middle, vector.scale(ahead, half))
                )
    for _ in range(60):
        direction = vector.unit(_random_direction(random), UP)
        yield straight_path(vector.scale(direction, MAX_REACH), vector.scale(direction, inner))
        yield circular_path(random.uniform(0.3, 0.95), direction, HAND_SPEED)
    while True:
        begin, end = (
            vector.scale(vector.unit(_random_direction(random), UP), random.uniform(inner, MAX_REACH)) for _ in "ab"
        )
        yield straight_path(begin, end)


def measure_elbow_steps(rig: ArmRig, path: HandPath) -> tuple[float, float, float]:
    """Return the maxima of elbow movement per frame, of tip error, and of depth in the shoulder's limit."""
    inner = max(rig.arm.min_tip_distance, MIN_REACH)
    elbow = Elbow(rig.arm, rig.shoulder)
    max_elbow_step = max_tip_error = 0.0
    depth = -pi
    last: Vector | None = None
    for position in path:
        reach = vector.length(position)
        if reach < inner or reach > MAX_REACH:
            position = vector.scale(rig.target_direction(position), min(max(reach, inner), MAX_REACH))
            if reach < inner:
                # outside the reach of the hand: the path continues behind it
                last = None
                elbow.reset()
                continue
        direction = rig.target_direction(position)
        if not elbow.has_begun:
            reach = vector.length(position)
            normal = (
                vector.cross(direction, UP) if vector.length(vector.cross(direction, UP)) > 1e-9 else (1.0, 0.0, 0.0)
            )
            bent = rig.arm.close_chain(reach, 0.0, rig.arm.gravity_bend(reach, elevation(direction, UP)))
            elbow.begin(direction, normal, -bent[0])
            for _ in range(120):
                elbow.step(direction, reach, UP, FRAME_US * 1e-6)
        tip, normal, bend = elbow.step(direction, vector.length(position), UP, FRAME_US * 1e-6)
        shoulder, *others = rig.bend_joints(vector.length(tip), bend)
        positions = rig.joint_positions(
            (vector.multiply(rig.chord_frame(rig.target_direction(tip), normal), shoulder), others[0], others[1])
        )
        elbow_position, tip_position = (
            vector.scale(one, 1.0 / rig.arm_length_m) for one in (positions[0], positions[2])
        )
        depth = max(depth, limit.depth_in_caps(rig.shoulder, rig.target_direction(elbow_position)))
        max_tip_error = max(max_tip_error, vector.length(vector.subtract(tip_position, position)))
        if last is not None:
            max_elbow_step = max(max_elbow_step, vector.length(vector.subtract(elbow_position, last)))
        last = elbow_position
    return max_elbow_step, max_tip_error, depth


class HandoverSmoothness(NamedTuple):
    """One claim and release of a hand.

    Accelerations are maxima: of the hand while it is controlled (`taking`) and while it returns, and of the motion's
    own hand meanwhile (`dancing`). Times are from the grant until the hand is within a hundredth of its target, and
    from the release until it follows the motion, milliseconds.
    """

    taking: float
    returning: float
    dancing: float
    taken_ms: float
    back_ms: float


def measure_handover(
    limb: Limb, figure: Figure, poses: Array, begin: int, away: Vector, phase: int
) -> HandoverSmoothness:
    """Claim a hand `phase` µs after frame `begin` of poses (n, 18, 4), hold it for half a second, and release it.

    Its target is `away` from its position in the motion."""
    rig, puppet = ArmRig(figure, limb), Marionette(figure)
    own_hands = [rig.tip_target(rig.pose_joints(pose)) for pose in poses[begin - 3 : begin + 80].tolist()]
    times = [(begin - 3 + k) * FRAME_US for k in range(len(own_hands))]
    hands = own_hands[:4]
    granted = times[3] + phase
    puppet.observe_pose(poses[begin - 1], times[2])
    puppet.observe_pose(poses[begin], times[3])
    grant = puppet.ownership.claim(limb, "one", granted)
    assert isinstance(grant, LimbGrant)
    target = vector.add(own_hands[3], away)
    taken = back = released = 0
    home = 36
    for k in range(4, len(own_hands)):
        now = times[k]
        if k == 34:
            puppet.ownership.release(limb, "one", grant.epoch, now - FRAME_US + phase)
            released = now - FRAME_US + phase
        elif k < 34:
            puppet.ownership.apply_input(
                "one", LimbInput(limb, 1, grant.epoch, k, now - FRAME_US + phase, target), now - FRAME_US + phase
            )
        merged = apply_overlay(poses[begin - 3 + k], puppet.compute_overlay(poses[begin - 3 + k], now))
        hands.append(rig.tip_target(rig.pose_joints(merged.tolist())))
        if not taken and vector.length(vector.subtract(hands[-1], target)) < 0.01:
            taken = now - granted - round(FRAME_US * (1.0 - _path_share(hands[-2], hands[-1], target)))
        off = vector.length(vector.subtract(hands[-1], own_hands[k]))
        if released and off > 1e-4:
            back, home = now + FRAME_US - released, k + 2
    accelerations = np.linalg.norm(_accelerations(hands[:home]), axis=1)
    dancing = np.linalg.norm(_accelerations(own_hands[:home]), axis=1)
    return HandoverSmoothness(
        float(accelerations[2:32].max()),
        float(accelerations[32:].max()),
        float(dancing[32:].max()),
        taken / 1e3 or math.inf,
        back / 1e3,
    )


def _path_share(begin: Vector, end: Vector, target: Vector) -> float:
    """Return the share of a frame interval after which a hand came within a hundredth of a target."""
    for step in range(21):
        position = vector.add(begin, vector.scale(vector.subtract(end, begin), step / 20.0))
        if vector.length(vector.subtract(position, target)) < 0.01:
            return step / 20.0
    return 1.0


def _accelerations(positions: list[Vector]) -> Array:
    second: Array = np.diff(np.array(positions), 2, axis=0) / (FRAME_US * 1e-6) ** 2
    return second


def measure_handovers(count: int, distance: float) -> list[HandoverSmoothness]:
    """Measure claims in the demo motion at random times, with targets `distance` away in random directions."""
    motion = choreography.animate_dance()
    random = np.random.default_rng(7)
    found: list[HandoverSmoothness] = []
    rigs = [ArmRig(motion.figure, limb) for limb in (Limb.LEFT_HAND, Limb.RIGHT_HAND)]
    while len(found) < count:
        limb = Limb(len(found) % 2)
        rig = rigs[limb]
        begin = int(random.integers(4, len(motion.rotations) - 90))
        way = vector.unit(_random_direction(random), UP)
        target = vector.add(
            rig.tip_target(rig.pose_joints(motion.rotations[begin].tolist())), vector.scale(way, distance)
        )
        if (
            MIN_REACH < vector.length(target) < MAX_REACH
            and limit.depth_in_caps(rig.shoulder, rig.target_direction(target)) < 0.0
        ):
            found.append(
                measure_handover(
                    limb,
                    motion.figure,
                    motion.rotations,
                    begin,
                    vector.scale(way, distance),
                    int(random.integers(FRAME_US)),
                )
            )
    return found


def _random_direction(random: np.random.Generator) -> Vector:
    x, y, z = random.normal(size=3).tolist()
    return (x, y, z)


def create_figure(proportions: Proportions) -> Figure:
    """Return the standard figure with arms of these proportions and unchanged arm length."""
    figure = standard_figure()
    offsets, tips = figure.offsets.copy(), figure.tips.copy()
    for limb in (Limb.LEFT_HAND, Limb.RIGHT_HAND):
        _, elbow, wrist = limb.joint_indices
        links = [offsets[elbow], offsets[wrist], tips[wrist]]
        whole = sum(float(np.linalg.norm(link)) for link in links)
        for link, share in zip(links, proportions.lengths, strict=True):
            link *= share * whole / np.linalg.norm(link)
    return Figure(offsets, tips)


def measure_smoothness(paths: int = 300, hands: int = 200) -> dict[str, float]:
    """Measure all figures of this module and print a table; takes some tens of seconds."""
    print(f"\n{'elbow, arm lengths a frame':<34}{'slow hand':>10}{'circles':>10}{'tip off':>10}{'in a cap':>10}")
    slow: list[float] = []
    fast: list[float] = []
    for body in BODIES:
        rig = ArmRig(create_figure(body.proportions), Limb.LEFT_HAND)
        steps = [measure_elbow_steps(rig, path) for path in islice(slow_paths(MIN_REACH), paths)]
        circles = [measure_elbow_steps(rig, path) for path in fast_circular_paths()]
        # inside the shoulder's limits the tip is exact; other paths are reported separately
        exact = [max_tip_error for _, max_tip_error, _ in steps if max_tip_error < 1e-6]
        print(
            f"{body.name:<34}{max(s for s, _, _ in steps):10.4f}{max(s for s, _, _ in circles):10.4f}"
            f"{max(exact):10.0e}{max(d for _, _, d in steps + circles):10.0e}"
            f"   tip exact on {len(exact)} of {len(steps)} paths, the others lead behind the back",
            flush=True,
        )
        slow += [step for step, _, _ in steps]
        fast += [step for step, _, _ in circles]
    print(f"\n{'hand-over':<34}{'median':>10}{'95 %':>10}{'p95':>10}")
    found = np.array(measure_handovers(hands, 0.25))
    for name, column in zip(HandoverSmoothness._fields, found.T, strict=True):
        median, p95, maximum = np.percentile(column, (50, 95, 100))
        print(f"{name:<34}{median:10.1f}{p95:10.1f}{maximum:10.1f}")
    return {
        "elbow_step_max": max(slow),
        "elbow_step_circle_max": max(fast),
        "handover_accel": float(found[:, 0].max()),
        "handover_ms": float(np.percentile(found[:, 3], 95)),
        "handover_ms_max": float(found[:, 3].max()),
        "handback_accel_p95": float(np.percentile(found[:, 1], 95)),
        "handback_ms": float(found[:, 4].max()),
    }


def fast_circular_paths() -> Iterator[HandPath]:
    """Yield circles around the shoulder at two arm lengths per second, level, upright and tilted."""
    for radius in (0.5, 0.6, 0.7, 0.8, 0.9):
        for normal in (
            (0.0, 1.0, 0.0),
            (1.0, 0.0, 0.0),
            (0.0, 0.0, 1.0),
            (0.6, 0.8, 0.0),
            (0.0, 0.6, 0.8),
            (0.6, 0.0, 0.8),
        ):
            yield circular_path(radius, normal, 4.0 * HAND_SPEED)


if __name__ == "__main__":
    print(json.dumps(measure_smoothness()))
