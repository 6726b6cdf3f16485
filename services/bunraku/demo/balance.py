"""Hips and weight of a score: facing, target of the centre of mass, and height of hops."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from bunraku.demo.footwork import GRAVITY_M_S2
from bunraku.demo.score import FootPlacement, FootPlacements, Hop, Score
from bunraku.motion import easing
from bunraku.motion.easing import EasedMove
from bunraku.motion.rotation import Array

HOP_PUSH_OFF_S = 0.4
"""Duration in which the hips prepare for a hop and recover from it."""
MIN_LONG_STAND_S = 1.2
"""Duration on both feet from which the weight settles between them."""
MAX_SETTLE_S = 0.4
"""Longest duration of that movement, so that a held pose is still."""


def hip_facing(score: Score, time: Array) -> Array:
    """Return the facing of the hips (n,) at `time` (n,) seconds, in radians to the audience's left: between the
    feet."""
    feet = dict(score.initial_feet)
    start = now = _mean_foot_turn(feet)
    moves = []
    for footfall in score.list_footfalls():
        feet |= footfall.targets
        begin, end = footfall.takeoff_beat * score.seconds_per_beat, footfall.beat * score.seconds_per_beat
        # the hips start a turn before the foot does and end it later
        moves.append(EasedMove(begin - 0.12, end - begin + 0.3, np.array([_mean_foot_turn(feet) - now])))
        now = _mean_foot_turn(feet)
    return easing.superpose(time, np.array([start]), moves)[:, 0]


def weight_target(score: Score, time: Array) -> Array:
    """Return the target of the centre of mass (n, 2), x and z in metres, at `time` (n,) seconds.

    It is over the standing foot before the other is lifted and until it has landed, and between the feet in a long
    stand.
    """
    feet = dict(score.initial_feet)
    # position of the weight, start and end, and time before and after that it may move
    stands: list[tuple[Array, float, float, float]] = [(_midpoint(feet), 0.0, 0.0, 0.0)]
    for footfall in score.list_footfalls():
        begin, end = footfall.takeoff_beat * score.seconds_per_beat, footfall.beat * score.seconds_per_beat
        before = stands[-1][2]
        if begin - before > MIN_LONG_STAND_S:
            settle = min(0.3 * (begin - before), MAX_SETTLE_S)
            stands.append((_midpoint(feet), before + settle, begin - settle, 0.0))
        if isinstance(footfall, Hop):
            stands.append((_midpoint(feet), begin, begin, 0.12))
            stands.append((_midpoint(footfall.targets), end, end, 0.12))
        else:
            stands.append((_standing_foot_point(feet, footfall.targets), begin, end, min(0.5 * (end - begin), 0.12)))
        feet |= footfall.targets
    stands.append((_midpoint(feet), score.duration - 0.2, score.duration, 0.0))
    moves = []
    for (here, _, leave, early), (there, arrive, _, late) in pairwise(stands):
        moves.append(EasedMove(leave - early, arrive + late - (leave - early), there - here))
    return easing.superpose(time, stands[0][0], moves)


def hop_height(score: Score, time: Array) -> Array:
    """Return the height in metres (n,) that hops add to the hips at `time` (n,) seconds.

    The hips sink and push off, fly under gravity, and yield on landing: a cubic through the floor's height with the
    speed of the flight at both ends, which is the parabola itself in the air.
    """
    knots: list[tuple[float, float]] = []
    for hop in score.hops:
        begin, end = hop.takeoff_beat * score.seconds_per_beat, hop.beat * score.seconds_per_beat
        if not knots or begin > knots[-1][0] + 2.0 * HOP_PUSH_OFF_S:
            knots += [(knots[-1][0] + HOP_PUSH_OFF_S, 0.0)] if knots else []
            knots.append((begin - HOP_PUSH_OFF_S, 0.0))
        speed = 0.5 * GRAVITY_M_S2 * (end - begin)
        knots += [(begin, speed), (end, -speed)]
    if not knots:
        return np.zeros_like(time)
    knots.append((knots[-1][0] + HOP_PUSH_OFF_S, 0.0))
    times, slopes = np.array(knots).T
    return easing.hermite(time, times, np.zeros_like(times), slopes)


def _mean_foot_turn(feet: FootPlacements) -> float:
    return float(np.radians(0.5 * (feet["left"].turn + feet["right"].turn)))


def _floor_point(place: FootPlacement) -> Array:
    return np.array([place.x, place.z])


def _midpoint(feet: FootPlacements) -> Array:
    middle: Array = 0.5 * (_floor_point(feet["left"]) + _floor_point(feet["right"]))
    return middle


def _standing_foot_point(feet: FootPlacements, landing: FootPlacements) -> Array:
    """Return a point on the standing foot, 18 mm towards the path of the other foot."""
    ((side, to),) = landing.items()
    here = _floor_point(feet["right" if side == "left" else "left"])
    away = 0.5 * (_floor_point(feet[side]) + _floor_point(to)) - here
    inwards: Array = here + 0.018 * away / max(float(np.linalg.norm(away)), 0.05)
    return inwards
