"""Calibration: the figure of a performer and the rules of its joints, from the first frames of a capture.

The frames become the structure that the analysis of files works on, so a capture gets the same figure and the same
rules as a recording of it: unit, axes and rest pose are detected, limb lengths measured, joints fitted.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bunraku.capture.errors import UnreadableCapture
from bunraku.capture.frame import CapturedFrame, CaptureSkeleton
from bunraku.capture.source_pose import SourcePose, find_parents
from bunraku.marionette.solver.vector import IDENTITY, ZERO, Quaternion, Vector, subtract
from bunraku.motion import rotation
from bunraku.motion.analysis import SourceFit, fit_source
from bunraku.motion.errors import UnreadableFile
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import Figure
from bunraku.motion.source_motion import SampledMotion, chain_transforms

MAX_CALIBRATION_FRAMES = 512
"""Two seconds at 240 frames/s."""
NOMINAL_FPS = 60.0
"""Frame rate of the motion that is analysed. The result does not depend on it."""
LEG_RANGE_M = (0.1, 3.0)
"""Range of a thigh and a shin together after the detection of the unit; beyond it the positions are not a body's."""


@dataclass(frozen=True, slots=True)
class Calibration:
    """Figure of a performer, and how the source's joints determine its own.

    `joints` are the source's joints, `offsets` and `turns` their last transforms relative to their parents, from which
    the capture continues. `assumptions` are sentences for the performer.
    """

    skeleton: CaptureSkeleton
    joints: tuple[str, ...]
    offsets: tuple[Vector, ...]
    turns: tuple[Quaternion, ...]
    fit: SourceFit
    figure: Figure

    @property
    def assumptions(self) -> list[str]:
        """Sentences about what the calibration detected and assumed."""
        return self.fit.assumptions


def calibrate(skeleton: CaptureSkeleton, frames: Sequence[CapturedFrame]) -> Calibration:
    """Return the calibration from `frames`, of which at most `MAX_CALIBRATION_FRAMES` are used, evenly spread.

    A joint takes part if one of the frames has its rotation and its position is known. Raises `UnreadableCapture` if
    the joints are not those of a body.
    """
    if not frames:
        raise UnreadableCapture("No frames", "a calibration needs at least one frame")
    chosen = np.unique(np.linspace(0, len(frames) - 1, MAX_CALIBRATION_FRAMES).astype(np.int64))
    frames = [frames[index] for index in chosen]
    rotated = set().union(*(frame.rotations.keys() for frame in frames))
    placed = set(skeleton.t_pose).union(*(frame.positions.keys() for frame in frames))
    joints = [name for name in skeleton.parents if name in rotated and name in placed]
    if not joints:
        raise UnreadableCapture("No joints", "no frame has a joint with rotation and position")
    offsets, turns = _track_joints(skeleton, joints, frames)
    source = _build_source(joints, find_parents(skeleton, joints), offsets, turns)
    try:
        with np.errstate(all="ignore"):
            fit = fit_source(source)
            figure = fit.build_figure()
    except UnreadableFile as error:
        raise UnreadableCapture(error.title, error.detail, field=error.field, hint=_REMEDY) from error
    except (ArithmeticError, ValueError, np.linalg.LinAlgError) as error:
        raise UnreadableCapture("Not a body", "the positions of the joints are degenerate", hint=_REMEDY) from error
    _check_figure(figure)
    return Calibration(
        skeleton=skeleton,
        joints=tuple(joints),
        offsets=_as_vectors(offsets[-1]),
        turns=_as_quaternions(turns[-1]),
        fit=fit,
        figure=figure,
    )


_REMEDY = "send hips, legs and arms with positions, and stand upright during the calibration"


def _track_joints(
    skeleton: CaptureSkeleton, joints: Sequence[str], frames: Sequence[CapturedFrame]
) -> tuple[Array, Array]:
    """Return positions (n, J, 3) and rotations (n, J, 4) relative to the parents, in all frames.

    A joint has its first known transform in the frames before it.
    """
    places = [skeleton.t_pose.get(joint, ZERO) for joint in joints]
    initial: tuple[list[Vector], list[Quaternion]] = (
        [
            subtract(place, places[parent]) if parent >= 0 else place
            for place, parent in zip(places, find_parents(skeleton, joints), strict=True)
        ],
        [IDENTITY for _ in joints],
    )
    pose = SourcePose(skeleton, joints, *initial)
    unplaced, unturned = set(joints), set(joints)
    for frame in frames:
        pose.update(frame)
        if not unplaced.isdisjoint(frame.positions) or not unturned.isdisjoint(frame.rotations):
            offsets, turns = pose.local_transforms()
            for index, joint in enumerate(joints):
                if joint in unplaced and joint in frame.positions:
                    initial[0][index] = offsets[index]
                if joint in unturned and joint in frame.rotations:
                    initial[1][index] = turns[index]
            unplaced.difference_update(frame.positions)
            unturned.difference_update(frame.rotations)
    pose = SourcePose(skeleton, joints, *initial)
    tracks = []
    for frame in frames:
        pose.update(frame)
        tracks.append(pose.local_transforms())
    return np.array([offsets for offsets, _ in tracks]), np.array([turns for _, turns in tracks])


def _build_source(joints: Sequence[str], parents: Sequence[int], offsets: Array, turns: Array) -> SampledMotion:
    """Return the frames as a source motion whose rest pose has the mean positions."""
    if parents.count(-1) > 1:
        names = [joint for joint, parent in zip(joints, parents, strict=True) if parent < 0]
        raise UnreadableCapture("Separate joints", f"{', '.join(names[:5])} have no common parent", hint=_REMEDY)
    positions, orientations = chain_transforms(parents, offsets, turns)
    rest_turns = np.tile(rotation.IDENTITY, (len(joints), 1))
    rest_positions, rest_orientations = chain_transforms(parents, offsets.mean(axis=0), rest_turns)
    return SampledMotion(
        names=tuple(joints),
        parents=tuple(parents),
        ends=(),
        fps=NOMINAL_FPS,
        rest_positions=rest_positions,
        rest_orientations=rest_orientations,
        positions=positions,
        orientations=orientations,
    )


def _check_figure(figure: Figure) -> None:
    legs = [float(np.linalg.norm(figure.offsets[[hip + 1, hip + 2]], axis=-1).sum()) for hip in (2, 6)]
    if not (np.isfinite(figure.offsets).all() and all(LEG_RANGE_M[0] <= leg <= LEG_RANGE_M[1] for leg in legs)):
        raise UnreadableCapture("Not a body", f"the legs would have {legs[0]:.2f} and {legs[1]:.2f} m", hint=_REMEDY)


def _as_vectors(values: Array) -> tuple[Vector, ...]:
    return tuple((x, y, z) for x, y, z in values.tolist())


def _as_quaternions(values: Array) -> tuple[Quaternion, ...]:
    return tuple((w, x, y, z) for w, x, y, z in values.tolist())
