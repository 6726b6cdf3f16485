"""Trajectories of the feet from the steps of a score: flat and still when planted, an arc when they swing."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bunraku.demo.score import FootPlacement, Hop, Score, Side, Step
from bunraku.motion import easing, rotation
from bunraku.motion.easing import EasedMove
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import JOINT_INDEX, Figure

FLOOR_HEIGHT_M = -0.014
"""Height of the floor and of a planted sole (the standing figure's midtarsal is at .0001)."""
GRAVITY_M_S2 = 9.81
SOLE_CENTRE_OFFSET_M = 0.06
"""Distance of the sole's centre, the position of a step, in front of the ankle."""
HEEL_OFFSET_M = 0.056
"""Distance of the heel behind the ankle."""


@dataclass(frozen=True, slots=True)
class FootTrack:
    """One foot over n frames.

    World position of the ankle (n, 3) in metres, world orientation of the foot (n, 4), upward bend of the toes (n,) and
    facing of the foot (n,) to the audience's left, both in radians.
    """

    ankle_position: Array
    orientation: Array
    toe_bend: Array
    facing: Array


def animate_foot(score: Score, figure: Figure, side: Side, time: Array) -> FootTrack:
    """Return the foot of `side` while `figure` performs `score`, over `time` (n,) seconds."""
    place = score.initial_feet[side]
    start = _placement_vector(place)
    moves = []
    clearance, heel_up, toes_up = np.zeros_like(time), np.zeros_like(time), np.zeros_like(time)
    for footfall in score.list_footfalls():
        if side not in footfall.targets:
            continue
        begin, end = footfall.takeoff_beat * score.seconds_per_beat, footfall.beat * score.seconds_per_beat
        to = footfall.targets[side]
        # reaches its position shortly before landing, so that it comes down vertically
        moves.append(EasedMove(begin, 0.95 * (end - begin), _placement_vector(to) - _placement_vector(place)))
        place = to
        swing = _hop_swing if isinstance(footfall, Hop) else _stamp_swing if footfall.is_stamp else _glide_swing
        for track, part in zip((clearance, heel_up, toes_up), swing(score, footfall, time), strict=True):
            track += part
    track = easing.superpose(time, start, moves)
    orientation = rotation.multiply(
        rotation.from_coordinate_axis(1, track[:, 2]), rotation.from_coordinate_axis(0, heel_up - toes_up)
    )
    lowest, middle = _sole_geometry(figure, side, orientation, heel_up)
    ankle = np.stack([track[:, 0], FLOOR_HEIGHT_M + clearance - lowest, track[:, 1]], axis=-1)
    ankle[:, [0, 2]] -= middle[:, [0, 2]]
    return FootTrack(ankle, orientation, heel_up, track[:, 2])


def _placement_vector(place: FootPlacement) -> Array:
    return np.array([place.x, place.z, np.radians(place.turn)])


def _sole_geometry(figure: Figure, side: Side, orientation: Array, toe_bend: Array) -> tuple[Array, Array]:
    """Return the height of the sole's lowest point above the ankle (n,), and the vector to the sole's centre (n, 3)."""
    chain = ("humanoid_root", "sacroiliac", *(f"{side[0]}_{joint}" for joint in ("hip", "knee", "ankle")))
    down = FLOOR_HEIGHT_M - sum(float(figure.offsets[JOINT_INDEX[joint]][1]) for joint in chain)
    midtarsal = JOINT_INDEX[f"{side[0]}_midtarsal"]
    heel = rotation.rotate(orientation, np.array([0.0, down, -HEEL_OFFSET_M]))
    ball = rotation.rotate(orientation, np.array([0.0, down, figure.offsets[midtarsal][2]]))
    bent = rotation.multiply(orientation, rotation.from_coordinate_axis(0, -toe_bend))
    tip = ball + rotation.rotate(bent, figure.tips[midtarsal])
    middle = rotation.rotate(orientation, np.array([0.0, 0.0, SOLE_CENTRE_OFFSET_M]))
    return np.min([heel[:, 1], ball[:, 1], tip[:, 1]], axis=0), middle


def _swing_times(score: Score, footfall: Step | Hop) -> tuple[float, float, float]:
    """Return the times of lifting, of starting to come down (half way in a hop), and of landing, in seconds."""
    begin, end = footfall.takeoff_beat * score.seconds_per_beat, footfall.beat * score.seconds_per_beat
    if isinstance(footfall, Hop):
        return begin, 0.5 * (begin + end), end
    return begin, end - footfall.fall_beats * score.seconds_per_beat, end


def _glide_swing(score: Score, step: Step | Hop, time: Array) -> tuple[Array, Array, Array]:
    """Return clearance of the sole (n,) in metres, rise of heel and of toes (n,) in radians, in a gliding step.

    The heel is down before the toes rise: where the lowest point of the sole changes, the foot rests on it.
    """
    begin, peak, end = _swing_times(score, step)
    quarter = 0.25 * (end - begin)
    # a quick foot stays flatter
    tilt = np.radians(10.0) * min(1.0, (end - begin) / 0.3)
    return (
        step.lift * easing.bump(time, begin, peak, end),
        tilt * easing.bump(time, begin, begin + quarter, begin + 2.0 * quarter),
        0.6 * tilt * easing.bump(time, begin + 2.0 * quarter, begin + 3.0 * quarter, end),
    )


def _stamp_swing(score: Score, step: Step | Hop, time: Array) -> tuple[Array, Array, Array]:
    """Return the same as `_glide_swing` for a stamp: the foot rises within 0.9 beats, waits with toes up, and falls."""
    begin, fall, end = _swing_times(score, step)
    rise = min(fall, begin + 0.9 * score.seconds_per_beat)
    up = easing.minimum_jerk((time - begin) / (rise - begin))
    raised = up - easing.ease_in((time - fall) / (end - fall))
    return step.lift * raised, np.zeros_like(time), np.radians(8.0) * raised


def _hop_swing(score: Score, hop: Step | Hop, time: Array) -> tuple[Array, Array, Array]:
    """Return the same as `_glide_swing` for a hop: the legs stretch at take-off and draw up under the body."""
    begin, peak, end = _swing_times(score, hop)
    apex = GRAVITY_M_S2 * (end - begin) ** 2 / 8.0
    return (
        hop.lift * apex * easing.bump(time, begin, peak, end),
        np.radians(24.0) * easing.bump(time, begin, 0.6 * begin + 0.4 * end, end),
        np.zeros_like(time),
    )
