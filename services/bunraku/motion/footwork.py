"""What the feet do over time, and what the body must do to stand on them: facing, weight and leaps, from a score."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bunraku.motion import easing, rotation
from bunraku.motion.easing import Move
from bunraku.motion.rotation import Array
from bunraku.motion.score import Hop, Place, Score, Side, Step
from bunraku.motion.skeleton import INDEX, Figure

FLOOR = -0.014
"""Height of the floor and of a planted sole, metres (the figure's midtarsal stands at .0001)."""
GRAVITY = 9.81
_MIDDLE = 0.06
"""The middle of the sole lies this far before the ankle, metres, and the heel nearly as far behind it."""
_HEEL = -0.056


@dataclass(frozen=True, slots=True)
class Foot:
    """One foot over n frames: world position of the ankle (n, 3), world orientation of the foot (n, 4), flexion of the toes
    upwards (n,) in radians, facing (n,) in radians to the left of the audience."""

    ankle: Array
    orientation: Array
    toes: Array
    facing: Array


def foot(score: Score, figure: Figure, side: Side, time: Array) -> Foot:
    """The foot of `side` over `time` (n,) seconds: still and flat where it is planted, in an arc where it swings."""
    beat = score.seconds_per_beat
    place = score.left if side == "left" else score.right
    moves: list[Move] = []
    clearance, heel_up, toe_up = np.zeros_like(time), np.zeros_like(time), np.zeros_like(time)
    start = _vector(place)
    for footfall in score.footfalls():
        if isinstance(footfall, Step) and footfall.foot != side:
            continue
        begin, end = footfall.lifted * beat, footfall.beat * beat
        to = footfall.to if isinstance(footfall, Step) else footfall.left if side == "left" else footfall.right
        # the foot is over its place a little before it is down
        moves.append(Move(begin, 0.95 * (end - begin), _vector(to) - _vector(place)))
        place = to
        if isinstance(footfall, Hop):
            apex = GRAVITY * (end - begin) ** 2 / 8.0
            clearance += 1.1 * apex * easing.bump(time, begin, 0.5 * (begin + end), end)
            heel_up += np.radians(24.0) * easing.bump(time, begin, begin + 0.4 * (end - begin), end)
        elif footfall.stamp:
            fall = end - footfall.fall * beat
            rise = min(fall, begin + 0.9 * beat)
            high = easing.minimum_jerk((time - begin) / (rise - begin)) - easing.falling((time - fall) / (end - fall))
            clearance += footfall.lift * high
            toe_up += np.radians(8.0) * high
        else:
            peak = end - footfall.fall * beat
            clearance += footfall.lift * easing.bump(time, begin, peak, end)
            heel_up += np.radians(10.0) * easing.bump(time, begin, begin + 0.35 * (end - begin), begin + 0.8 * (end - begin))
            toe_up += np.radians(6.0) * easing.bump(time, begin + 0.45 * (end - begin), begin + 0.8 * (end - begin), end)
    track = easing.superpose(time, start, moves)
    orientation = rotation.multiply(rotation.about_axis(1, track[:, 2]), rotation.about_axis(0, heel_up - toe_up))
    letter = side[0]
    ankle_height = sum(figure.offsets[INDEX[f"{letter}_{joint}"]][1] for joint in ("hip", "knee", "ankle")) + (
        figure.offsets[INDEX["humanoid_root"]][1] + figure.offsets[INDEX["sacroiliac"]][1]
    )
    sole = FLOOR - ankle_height
    ball = figure.offsets[INDEX[f"{letter}_midtarsal"]]
    toe = figure.tips[INDEX[f"{letter}_midtarsal"]]
    from_ankle = lambda point: rotation.rotate(orientation, np.asarray(point))  # noqa: E731
    ankle = np.stack([track[:, 0], clearance + FLOOR, track[:, 1]], axis=-1) - from_ankle((0.0, 0.0, _MIDDLE))
    flat = rotation.multiply(orientation, rotation.about_axis(0, -heel_up))
    lowest = np.min(
        [
            from_ankle((0.0, sole, _HEEL))[:, 1],
            from_ankle((0.0, sole, ball[2]))[:, 1],
            from_ankle((0.0, sole, ball[2]))[:, 1] + rotation.rotate(flat, toe)[:, 1],
        ],
        axis=0,
    )
    ankle[:, 1] = clearance + FLOOR - lowest
    return Foot(ankle, orientation, heel_up, track[:, 2])


def facing(score: Score, time: Array) -> Array:
    """Where the hips face (n,), radians to the left of the audience: between the two feet, turning as they step."""
    beat = score.seconds_per_beat
    feet = {"left": score.left.turn, "right": score.right.turn}
    now = start = 0.5 * (feet["left"] + feet["right"])
    moves = []
    for footfall in score.footfalls():
        feet |= _turns(footfall)
        to = 0.5 * (feet["left"] + feet["right"])
        duration = (footfall.beat - footfall.lifted) * beat + 0.3
        moves.append(Move(footfall.lifted * beat - 0.12, duration, np.radians([to - now])))
        now = to
    return easing.superpose(time, np.radians([start]), moves)[:, 0]


def weight(score: Score, time: Array) -> Array:
    """Where the centre of mass must be over the floor (n, 2): x and z in metres.

    It is over the standing foot before the other is lifted and until it has landed, and between the feet in a long stand.
    """
    beat = score.seconds_per_beat
    feet = {"left": score.left, "right": score.right}
    # where, from when to when, and by how much of either end a shift of weight may run into it
    stands: list[tuple[Array, float, float, float]] = [(_between(feet), 0.0, 0.0, 0.0)]
    for footfall in score.footfalls():
        begin, end = footfall.lifted * beat, footfall.beat * beat
        idle = begin - stands[-1][2]
        if idle > 1.2:
            stands.append((_between(feet), stands[-1][2] + 0.4 * idle, begin - 0.4 * idle, 0.1 * idle))
        if isinstance(footfall, Hop):
            stands.append((_between(feet), begin, begin, 0.12))
            feet = {"left": footfall.left, "right": footfall.right}
            stands.append((_between(feet), end, end, 0.12))
        else:
            other: Side = "right" if footfall.foot == "left" else "left"
            stands.append((_on(feet[other], feet[footfall.foot], footfall.to), begin, end, min(0.4 * (end - begin), 0.12)))
            feet[footfall.foot] = footfall.to
    stands.append((_between(feet), score.duration - 0.2, score.duration, 0.0))
    moves = []
    for (here, _, leave, early), (there, arrive, _, late) in zip(stands, stands[1:], strict=False):
        moves.append(Move(leave - early, arrive + late - leave + early, there - here))
    return easing.superpose(time, stands[0][0], moves)


def leap(score: Score, time: Array) -> Array:
    """Height in metres (n,) that hops add to the hips: a push, free flight under gravity, and a landing that gives way."""
    beat = score.seconds_per_beat
    knots: list[float] = []
    slopes: list[float] = []
    for hop in sorted(score.hops, key=lambda hop: hop.beat):
        begin, end = hop.lifted * beat, hop.beat * beat
        speed = 0.5 * GRAVITY * (end - begin)
        if not knots or begin - knots[-1] > 0.8:
            knots += [knots[-1] + 0.4] if knots else []
            slopes += [0.0] if slopes else []
            knots.append(begin - 0.4)
            slopes.append(0.0)
        elif knots:
            pass
        knots += [begin, end]
        slopes += [speed, -speed]
    if not knots:
        return np.zeros_like(time)
    knots.append(knots[-1] + 0.4)
    slopes.append(0.0)
    return easing.hermite(time, np.array(knots), np.zeros(len(knots)), np.array(slopes))


def _vector(place: Place) -> Array:
    return np.array([place.x, place.z, np.radians(place.turn)])


def _turns(footfall: Step | Hop) -> dict[str, float]:
    if isinstance(footfall, Hop):
        return {"left": footfall.left.turn, "right": footfall.right.turn}
    return {footfall.foot: footfall.to.turn}


def _between(feet: dict[str, Place]) -> Array:
    return 0.5 * (_vector(feet["left"])[:2] + _vector(feet["right"])[:2])


def _on(standing: Place, left: Place, landing: Place) -> Array:
    """A point on the standing foot, a little to the side where the other foot comes from and goes to."""
    here = _vector(standing)[:2]
    away = 0.5 * (_vector(left)[:2] + _vector(landing)[:2]) - here
    inwards: Array = here + 0.018 * away / max(float(np.linalg.norm(away)), 0.05)
    return inwards
