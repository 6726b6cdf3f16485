"""Conversion of a recorded skeleton to the paper's 19 channels (paper 2), with the error of the fit."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from bunraku.motion import rotation
from bunraku.motion.errors import UnreadableFile
from bunraku.motion.extension import ExtendedPose
from bunraku.motion.extension_fit import ExtensionMotion, extended_pose, fit_body_extension
from bunraku.motion.face import Face, face_of, gaze_of_eyes, shows_gaze
from bunraku.motion.fit import FigureFit
from bunraku.motion.hands import WRISTS
from bunraku.motion.hands_fit import HandsMotion, fit_hands, measure_hands
from bunraku.motion.joint_tree import common_ancestor
from bunraku.motion.limb_fit import fit_arm, fit_leg
from bunraku.motion.naming.expression_mapping import describe_unknown, map_expressions
from bunraku.motion.naming.eye_mapping import map_eyes
from bunraku.motion.naming.finger_mapping import FingerChain, map_fingers
from bunraku.motion.naming.name_mapping import SHAPE_PROFILE, find_head_by_name, map_by_name
from bunraku.motion.naming.shape_mapping import find_head, map_by_shape
from bunraku.motion.placement import MAX_STAGE_DISTANCE_M
from bunraku.motion.rest_pose import RestPose, find_rest_pose, resolve_sides, sample_frames
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import (
    JOINT_COUNT,
    JOINT_INDEX,
    JOINTS,
    Figure,
    Motion,
    joint_and_tip_positions,
    world_transforms,
)
from bunraku.motion.source_motion import SourceMotion
from bunraku.motion.trunk_fit import fit_trunk

MAX_TRAVEL_M, MAX_DISTANCE_M = 1e3, 1e9
"""Farthest that a motion may lead from where it mostly is, and from the origin: beyond them there is a broken value."""
FLOOR_TOLERANCE_M = 0.5
"""The height is kept if the lowest point of the feet is within this distance of the floor."""
POOR_FIT_MM = 25.0
"""Mean distance of joints above which the fit is said to be poor; those of recorded people are below 10 mm."""
CALIBRATION_POSE_LIMITS = (0.05, 4.0)
"""The first frame is a calibration pose if its mean joint distance to the second exceeds the first limit, in metres,
and exceeds the largest later step by the second limit, a factor."""


class JointFit(NamedTuple):
    """Index of the source joint that a joint of the figure follows, and their mean distance in millimetres."""

    source: int
    mean_mm: float


@dataclass(frozen=True, slots=True)
class FaceMotion:
    """Face of a motion: the axes of its expressions, and the values (n, C, 3) of their channels."""

    face: Face
    values: Array


@dataclass(frozen=True, slots=True)
class Analysis:
    """Result of the analysis of a source.

    `motion` has the source's frame rate; `profile` is the naming convention ("shape": none matched); `source_joints`
    maps H-Anim joints to source joints; `rest_pose` is "T", "A", "I", "bone-aligned" or "other"; `unit` the unit of
    length; `assumptions` are sentences for the uploader. Fit errors are distances between the figure's joints and the
    source's, over all mapped joints and frames, in millimetres; `joint_fits` has each joint's. `extension` has the
    source's spine, neck and clavicles, if it has such joints; with them, the errors are the `extended` ones. `hands`
    has the source's fingers, if it has any that move, with the errors of their joints on the extended figure; `face`
    its face, if it has expressions or eyes that turn.
    """

    motion: Motion
    profile: str
    source_joints: dict[str, str]
    rest_pose: str
    unit: str
    assumptions: list[str]
    mean_fit_error_mm: float
    max_fit_error_mm: float
    joint_fits: dict[str, JointFit]
    extension: ExtensionMotion | None
    extended_mean_error_mm: float
    extended_max_error_mm: float
    hands: HandsMotion | None = None
    hands_mean_error_mm: float = 0.0
    hands_max_error_mm: float = 0.0
    face: FaceMotion | None = None


@dataclass(frozen=True, slots=True)
class SourceFit:
    """Fit of a figure to a source: the state of the fit, and the rest pose and naming convention that led to it.

    `moved` (3,) was added to all positions, in metres, because the source was off the floor or far from the stage. The
    fit begins at `first_frame` of the source.
    """

    fit: FigureFit
    rest: RestPose
    profile: str
    moved: Array
    assumptions: list[str]
    first_frame: int = 0

    def build_figure(self) -> Figure:
        """Return the figure; in its rest pose the lowest point is on the floor."""
        still = np.tile(rotation.IDENTITY, (JOINT_COUNT, 1))
        offsets = self.fit.offsets.copy()
        offsets[0] = 0.0
        offsets[0, 1] = -joint_and_tip_positions(Figure(offsets, self.fit.tips), np.zeros(3), still)[:, 1].min()
        return Figure(offsets, self.fit.tips)


def analyse(source: SourceMotion) -> Analysis:
    """Fit the 19 channels and a figure with the source's limb lengths to `source`.

    The figure's rest pose is H-Anim's I-pose, facing z, y up; elbows, wrists, knees, ankles and finger tips lie
    straight below the previous joint, so that an elbow bends about -x and a knee about x. Raises `UnreadableFile` if
    the skeleton is not humanoid.
    """
    fitted = fit_source(source)
    fit = fitted.fit
    figure = fitted.build_figure()
    motion = Motion(figure, source.fps, fit.joint_positions[:, 0].copy(), fit.local_rotations())
    placed, _ = world_transforms(motion.figure, motion.root, motion.rotations)
    mapped = sorted(fit.joints)
    apart = 1000.0 * np.linalg.norm(placed[:, mapped] - fit.position[:, [fit.joints[j] for j in mapped]], axis=-1)
    if apart.mean() > POOR_FIT_MM:
        fitted.assumptions.append(
            f"The fit is poor: the figure's joints are {apart.mean():.0f} mm from the source's on average. "
            "The source may not have the body of a human."
        )
    extension = fit_body_extension(fit)
    pose = None if extension is None else extended_pose(fit, figure, extension)
    extended = apart if extension is None or pose is None else _measure_extended(fit, pose, extension)
    hands = fit_hands(fit)
    hands_apart = np.zeros(1)
    if hands is not None:
        hands_apart = measure_hands(fit, hands, (placed if pose is None else pose.positions)[:, list(WRISTS)])
    return Analysis(
        motion=motion,
        profile=fitted.profile,
        source_joints={JOINTS[joint]: source.names[fit.joints[joint]] for joint in mapped},
        rest_pose=fitted.rest.pose,
        unit=fitted.rest.unit,
        assumptions=fitted.assumptions,
        mean_fit_error_mm=float(apart.mean()),
        max_fit_error_mm=float(apart.max()),
        joint_fits={
            JOINTS[joint]: JointFit(fit.joints[joint], mean)
            for joint, mean in zip(mapped, apart.mean(axis=0).tolist(), strict=True)
        },
        extension=extension,
        extended_mean_error_mm=float(extended.mean()),
        extended_max_error_mm=float(extended.max()),
        hands=hands,
        hands_mean_error_mm=float(hands_apart.mean()),
        hands_max_error_mm=float(hands_apart.max()),
        face=_read_face(source, fitted),
    )


def _read_face(source: SourceMotion, fitted: SourceFit) -> FaceMotion | None:
    """Return the face of a source in the frames of the fit, None if it shows no known expression."""
    expressions, unknown = map_expressions(source.expressions)
    if unknown:
        fitted.assumptions.append(describe_unknown(unknown))
    expressions = {name: weights[fitted.first_frame :] for name, weights in expressions.items()}
    fit = fitted.fit
    if fit.eyes and not shows_gaze(expressions):
        head = rotation.conjugate(fit.turn[:, [fit.joints[JOINT_INDEX["skullbase"]]]])
        expressions |= gaze_of_eyes(rotation.multiply(head, fit.turn[:, fit.eyes])) or {}
    if not expressions:
        return None
    face, values = face_of(expressions)
    return FaceMotion(face, values) if face.axes else None


def _measure_extended(fit: FigureFit, pose: ExtendedPose, extension: ExtensionMotion) -> Array:
    """Return the distances (n, m) of the extended figure's joints from the source's, millimetres."""
    mapped = [joint for joint in sorted(fit.joints) if JOINTS[joint] != "vl5" or not extension.extension.spine_count]
    placed = np.concatenate([pose.positions[:, mapped], pose.extra_positions], axis=1)
    sources = [*(fit.joints[joint] for joint in mapped), *extension.sources]
    apart: Array = 1000.0 * np.linalg.norm(placed - fit.position[:, sources], axis=-1)
    return apart


def fit_source(source: SourceMotion) -> SourceFit:
    """Fit a figure and the rules of its joints to all frames of `source`. Raises `UnreadableFile` as `analyse`."""
    naming = map_by_name(source.names, source.parents) or map_by_shape(source)
    guessed = [*source.notes]
    frames = sample_frames(source)
    position, orientation = source.world_transforms(list(range(len(source.names))), frames)
    joints, exchanged = resolve_sides(position, naming)
    guessed += exchanged
    joints = _complete_mapping(source, joints, guessed)
    if naming.profile == SHAPE_PROFILE:
        pairs = ", ".join(f"{joint} = {source.names[index]}" for joint, index in sorted(joints.items()))
        guessed.append(f"No naming convention matches; the skeleton's shape gave {pairs}.")
    rest = find_rest_pose(source, joints, frames, position, orientation)
    guessed += rest.assumptions
    eyes = map_eyes(source.names, source.parents, joints["skullbase"]) if "skullbase" in joints else None
    fit = FigureFit.from_source(source, joints, rest, _find_fingers(source, joints, rest), eyes or ())
    first_frame = int(_starts_with_calibration_pose(fit))
    if first_frame:
        guessed.append("The first frame is a pose apart from the dance; it was left out.")
        fit = fit.without_first_frame()
    moved = _move_to_stage(fit, guessed)
    fit_trunk(fit)
    for side in "lr":
        fit_leg(fit, side)
        fit_arm(fit, side)
    return SourceFit(fit, rest, naming.profile, moved, guessed, first_frame)


def _find_fingers(source: SourceMotion, joints: dict[str, int], rest: RestPose) -> tuple[FingerChain, ...]:
    """Return the source's joints of the ten fingers."""
    positions = rest.scale * rotation.rotate(rest.rest_to_figure, rest.positions)
    return map_fingers(source.names, source.parents, positions, [joints.get("l_wrist"), joints.get("r_wrist")])


def _complete_mapping(source: SourceMotion, joints: dict[str, int], assumptions: list[str]) -> dict[str, int]:
    """Return the mapping with root and head, if names or shape left them open.

    The root is the joint where legs and trunk separate, whatever its name: files may have a joint on the floor above
    it, or a pelvis below it that carries only the legs, which is then the sacroiliac.
    """
    joints = dict(joints)
    hips = [joints["l_hip"], joints["r_hip"]]
    if "skullbase" not in joints:
        head = find_head_by_name(source.names, source.parents, joints)
        if head is None and (head := find_head(source, joints)) is not None:
            assumptions.append(f"No joint is named as the head; {source.names[head]} was taken for it.")
        if head is not None:
            joints["skullbase"] = head
    root = common_ancestor(source.parents, [*hips, joints["l_shoulder"], joints["r_shoulder"]])
    pelvis = common_ancestor(source.parents, hips)
    joints["humanoid_root"] = root
    for name in ("sacroiliac", "vl5"):
        joints.pop(name, None)
    if pelvis != root:
        joints["sacroiliac"] = pelvis
    missing = [name for name in JOINTS if name not in joints and name not in ("sacroiliac", "vl5")]
    if missing:
        assumptions.append(f"The source has no {', '.join(missing)}; they keep a fixed place.")
    return joints


def _starts_with_calibration_pose(fit: FigureFit) -> bool:
    """Return whether the first frame is a calibration pose before an otherwise smooth motion."""
    if len(fit.position) < 4:
        return False
    local = fit.position[:, list(fit.joints.values())] - fit.position[:, [fit.joints[0]]]
    step = np.linalg.norm(np.diff(local, axis=0), axis=-1).mean(axis=-1)
    return bool(step[0] > CALIBRATION_POSE_LIMITS[0] and step[0] > CALIBRATION_POSE_LIMITS[1] * step[1:].max())


def _move_to_stage(fit: FigureFit, assumptions: list[str]) -> Array:
    """Move the source if its feet are far from the floor or its middle from the stage; return by how much (3,), metres.

    Raises `UnreadableFile` if the motion leads too far away.
    """
    moved = np.zeros(3)
    feet = [source for joint, source in fit.joints.items() if JOINTS[joint][2:] in ("ankle", "midtarsal")]
    lowest = float(fit.position[:, feet or list(fit.joints.values()), 1].min())
    root = fit.position[:, fit.joints[0]]
    middle = np.median(root, axis=0)
    for start, limit, name in (
        (np.zeros(3), MAX_DISTANCE_M, "the origin"),
        (middle, MAX_TRAVEL_M, "where it mostly is"),
    ):
        apart = np.abs(root - start).max(axis=-1)
        if not apart.max() <= limit:
            frame = int(apart.argmax())
            raise UnreadableFile(
                "Leaves the stage",
                f"in frame {frame + 1} the body is {apart[frame]:.3g} m from {name}",
                field=fit.source.names[fit.joints[0]],
                hint=f"correct the positions of the root: at most {limit:.0g} m can be read",
            )
    if abs(lowest) > FLOOR_TOLERANCE_M:
        assumptions.append(
            f"The lowest point of the feet was {lowest:.2f} m from the floor; the dance was moved onto it."
        )
        moved[1] = -lowest
    if np.hypot(middle[0], middle[2]) > MAX_STAGE_DISTANCE_M:
        assumptions.append(
            f"The dance was {np.hypot(middle[0], middle[2]):.3g} m from the middle of the stage; it was moved there."
        )
        moved[[0, 2]] = -middle[[0, 2]]
    fit.position += moved
    return moved
