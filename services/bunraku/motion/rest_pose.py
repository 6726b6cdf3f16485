"""Detection of the source's rest pose, unit and axes.

The rest pose of a BVH file follows from its offsets without rotation. Usually a body stands in it: arms out (T), half
down (A) or down (I). Some exporters lay all bones along one axis and keep the pose in the rotations; then the frame of
the clip in which the body stands straightest replaces it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bunraku.motion import rotation
from bunraku.motion.errors import UnreadableFile
from bunraku.motion.naming.name_mapping import SHAPE_PROFILE, JointMapping
from bunraku.motion.rotation import Array
from bunraku.motion.source_motion import SourceMotion

REFERENCE_LEG_M = 0.82
"""Leg of an adult, hip to ankle, from which the unit is detected."""
METRES_PER_UNIT = {"m": 1.0, "cm": 0.01, "mm": 0.001, "inch": 0.0254, "CMU unit (0.45 scaled inch)": 0.0254 / 0.45}
"""Metres per unit. The CMU database uses inches scaled by 0.45 (mocap.cs.cmu.edu, FAQ)."""
UNIT_NAMES = {value: name for name, value in METRES_PER_UNIT.items()} | {0.1: "dm", 0.3048: "foot", 0.9144: "yard"}
"""Names of units that files declare, by metres per unit."""
MIN_DECLARED_LEG_M, MAX_DECLARED_LEG_M = 0.14, 1.43
"""Legs of bodies of 0.3 m and of 3 m. Beyond them, the unit that a file declares is taken for a mistake."""
MIN_BONE_SHARE = 0.02
"""Shortest thigh or shin, as a share of a leg."""
MAX_LEG_LOG_RATIO = np.log(1.55)
"""Largest deviation of a leg from `REFERENCE_LEG_M`, as the logarithm of a ratio: a child's to a giant's."""
MAX_SAMPLED_FRAMES = 256
"""Frames examined to detect unit, axes and sides."""

SIGNED_AXES: Array = np.concatenate([np.eye(3), -np.eye(3)])


@dataclass(frozen=True, slots=True)
class RestPose:
    """Rest pose, unit and axes of the source.

    `pose` is "T", "A", "I", "bone-aligned" or "other"; `unit` its name and `scale` metres per unit. `positions` (J, 3)
    and `orientations` (J, 4) are the source's joints at rest, in its own unit and axes; `rest_to_figure` (4,) rotates
    these axes to the figure's (y up, facing z, x to the left), and `motion_to_figure` (4,) the axes of the motion.
    """

    pose: str
    unit: str
    scale: float
    positions: Array
    orientations: Array
    rest_to_figure: Array
    motion_to_figure: Array
    assumptions: tuple[str, ...]


def sample_frames(source: SourceMotion) -> np.ndarray:
    """Return indices of at most `MAX_SAMPLED_FRAMES` frames, evenly over the clip, including the first."""
    return np.unique(np.linspace(0, source.frame_count - 1, MAX_SAMPLED_FRAMES).astype(np.int64))


def resolve_sides(position: Array, mapping: JointMapping) -> tuple[dict[str, int], list[str]]:
    """Return the joints of `mapping` with left and right as the body's front shows them, and sentences about changes.

    `position` (n, J, 3) are sampled frames. Toes point forwards and knees bend forwards; arms are above the legs of the
    same side. Names are contradicted only by strong evidence, that of whole feet.
    """
    joints = dict(mapping.joints)
    has_names = mapping.profile != SHAPE_PROFILE
    notes = []
    across = position[:, joints["l_hip"]] - position[:, joints["r_hip"]]
    shoulders = position[:, joints["l_shoulder"]] - position[:, joints["r_shoulder"]]
    alignment = float(np.mean(np.sum(rotation.normalise(across) * rotation.normalise(shoulders), axis=-1)))
    if alignment < (-0.7 if has_names else -0.3):
        _swap_sides(joints, ("shoulder", "elbow", "wrist"))
        notes.append("Left and right arm were exchanged: they are over the other leg.")
    up = _body_up(position, joints)
    forward = rotation.normalise(np.cross(position[:, joints["l_hip"]] - position[:, joints["r_hip"]], up))
    shown = 0.0
    for side in "lr":
        hip, knee = position[:, joints[f"{side}_hip"]], position[:, joints[f"{side}_knee"]]
        size = np.median(np.linalg.norm(knee - hip, axis=-1)) or 1.0
        ankle = position[:, joints[f"{side}_ankle"]] if f"{side}_ankle" in joints else knee
        bend = knee - 0.5 * (hip + ankle)
        shown += float(np.median(np.sum(bend * forward, axis=-1))) / size
        if f"{side}_midtarsal" in joints:
            foot = position[:, joints[f"{side}_midtarsal"]] - ankle
            shown += float(np.median(np.sum(foot * forward, axis=-1))) / size
    has_feet = {f"{side}_{joint}" for side in "lr" for joint in ("ankle", "midtarsal")} <= joints.keys()
    if shown < (-0.1 if not has_names else -0.4 if has_feet else -np.inf):
        _swap_sides(joints, ("hip", "knee", "ankle", "midtarsal", "shoulder", "elbow", "wrist"))
        notes.append("Left and right were exchanged: toes and knees point the other way.")
    return joints, notes


def find_rest_pose(
    source: SourceMotion, joints: dict[str, int], frames: np.ndarray, position: Array, orientation: Array
) -> RestPose:
    """Detect the rest pose of `source`; `joints` maps H-Anim joints to source indices.

    `position` (n, J, 3) and `orientation` (n, J, 4) are the sampled `frames` in the source's unit and axes. Raises
    `UnreadableFile` if the legs have no length.
    """
    guessed: list[str] = []
    unit, scale = _detect_unit(position, joints, source, guessed)
    at_rest = source.rest_positions
    up = rotation.normalise(_body_up(position, joints).mean(axis=0))
    if _is_standing(at_rest, joints):
        kind = _classify_arms(at_rest, joints)
        upright = _figure_axes(at_rest, joints, _nearest_axis(_body_up(at_rest[None], joints)[0]))
        world = _resolve_motion_axes(upright, up, position, joints, guessed)
        orientations = source.rest_orientations
    else:
        kind = "bone-aligned"
        axis = _nearest_axis(up)
        best = int(np.argmax(_straightness(position, joints, axis)))
        at_rest, orientations = position[best] - position[best, 0], orientation[best]
        upright = _figure_axes(at_rest, joints, axis)
        world = rotation.rotation_between(axis, np.array([0.0, 1.0, 0.0]))
        guessed.append(
            f"In the rest pose all bones lie along an axis; frame {int(frames[best]) + 1}, in which the body stands "
            "straightest, was taken for it."
        )
    if kind == "other":
        guessed.append("The rest pose is neither T, A nor I; the arms were turned down the shortest way.")
    turned = rotation.rotate(world, up)
    if turned[1] < 0.3:
        guessed.append("The body lies or hangs head down for most of the clip.")
    axis_up = rotation.rotate(rotation.conjugate(world), np.array([0.0, 1.0, 0.0]))
    if axis_up[1] < 0.9:
        name = "xyz"[int(np.argmax(np.abs(axis_up)))]
        guessed.append(f"The source's {'-' if axis_up.sum() < 0 else ''}{name} axis is up; it was turned to y.")
    return RestPose(kind, unit, scale, at_rest, orientations, upright, world, tuple(guessed))


def _swap_sides(joints: dict[str, int], names: tuple[str, ...]) -> None:
    for name in names:
        left, right = joints.pop(f"l_{name}", None), joints.pop(f"r_{name}", None)
        joints |= {key: value for key, value in ((f"l_{name}", right), (f"r_{name}", left)) if value is not None}


def _midpoint(position: Array, joints: dict[str, int], name: str) -> Array:
    middle: Array = 0.5 * (position[..., joints[f"l_{name}"], :] + position[..., joints[f"r_{name}"], :])
    return middle


def _lowest_leg_joint(joints: dict[str, int]) -> str:
    return "ankle" if {"l_ankle", "r_ankle"} <= joints.keys() else "knee"


def _body_up(position: Array, joints: dict[str, int]) -> Array:
    """Return the unit direction (..., 3) from feet over hips to shoulders; trunk and legs have equal weight."""
    trunk = _midpoint(position, joints, "shoulder") - _midpoint(position, joints, "hip")
    legs = _midpoint(position, joints, "hip") - _midpoint(position, joints, _lowest_leg_joint(joints))
    return rotation.normalise(rotation.normalise(trunk) + rotation.normalise(legs))


def _nearest_axis(direction: Array) -> Array:
    axis: Array = SIGNED_AXES[int(np.argmax(SIGNED_AXES @ direction))]
    return axis


def _detect_unit(
    position: Array, joints: dict[str, int], source: SourceMotion, assumptions: list[str]
) -> tuple[str, float]:
    """Return the unit and metres per unit: the declared one, unless it makes a body too small or too large.

    Otherwise it is the unit in which a leg is nearest to `REFERENCE_LEG_M`. Raises `UnreadableFile` if a bone of a
    leg has no length.
    """
    names, declared = source.names, source.metres_per_unit
    bones = [("hip", "knee"), ("knee", "ankle")] if _lowest_leg_joint(joints) == "ankle" else [("hip", "knee")] * 2
    lengths = {
        f"{s}_{b}": float(
            np.median(np.linalg.norm(position[:, joints[f"{s}_{a}"]] - position[:, joints[f"{s}_{b}"]], axis=-1))
        )
        for s in "lr"
        for a, b in dict.fromkeys(bones)
    }
    leg = sum(lengths.values()) / len(lengths) * 2.0
    shortest = min(lengths, key=lengths.__getitem__)
    if not lengths[shortest] > MIN_BONE_SHARE * leg:
        raise UnreadableFile(
            "A leg without length",
            f"{names[joints[shortest]]} is at the place of the joint above it",
            field=names[joints[shortest]],
            hint="export the skeleton with the offsets of its joints",
        )
    if declared is not None:
        if MIN_DECLARED_LEG_M <= leg * declared <= MAX_DECLARED_LEG_M:
            return _name_unit(declared), declared
        assumptions.append(
            f"The file says that its unit is {_name_unit(declared)}, in which a leg has {leg * declared:.3g} m; "
            "another one was taken."
        )
    name = min(METRES_PER_UNIT, key=lambda unit: abs(np.log(max(leg, 1e-12) * METRES_PER_UNIT[unit] / REFERENCE_LEG_M)))
    if abs(np.log(max(leg, 1e-12) * METRES_PER_UNIT[name] / REFERENCE_LEG_M)) > MAX_LEG_LOG_RATIO:
        assumptions.append(f"The unit is unknown: a leg of {leg:.4g} units was scaled to {REFERENCE_LEG_M} m.")
        return "unknown", REFERENCE_LEG_M / max(leg, 1e-12)
    assumptions.append(f"The unit is {name}: a leg of {leg:.4g} units is {leg * METRES_PER_UNIT[name]:.2f} m.")
    return name, METRES_PER_UNIT[name]


def _name_unit(metres: float) -> str:
    return next((name for unit, name in UNIT_NAMES.items() if abs(unit - metres) < 1e-3 * unit), f"{metres:.4g} m")


def _is_standing(position: Array, joints: dict[str, int]) -> bool:
    """Return whether the positions (J, 3) show a standing body: trunk up, legs down, hips and shoulders parallel."""
    trunk = rotation.normalise(_midpoint(position, joints, "shoulder") - _midpoint(position, joints, "hip"))
    end = _lowest_leg_joint(joints)
    legs = [rotation.normalise(position[joints[f"{s}_hip"]] - position[joints[f"{s}_{end}"]]) for s in "lr"]
    across = [rotation.normalise(position[joints[f"l_{n}"]] - position[joints[f"r_{n}"]]) for n in ("hip", "shoulder")]
    return bool(
        np.linalg.norm(trunk) > 0.5 and min(legs[0] @ trunk, legs[1] @ trunk) > 0.6 and across[0] @ across[1] > 0.6
    )


def _figure_axes(position: Array, joints: dict[str, int], up: Array) -> Array:
    """Return the rotation that brings `up` to y and the body's left to x; within 10 degrees it snaps to an axis."""
    left = (position[joints["l_hip"]] - position[joints["r_hip"]]) + (
        position[joints["l_shoulder"]] - position[joints["r_shoulder"]]
    )
    nearest = _nearest_axis(left - (left @ up) * up)
    left = rotation.normalise(left - (left @ up) * up)
    if left @ nearest > np.cos(np.radians(10.0)):
        left = nearest
    return rotation.conjugate(rotation.from_matrix(np.stack([left, up, np.cross(left, up)], axis=-1)))


def _resolve_motion_axes(
    upright: Array, up: Array, position: Array, joints: dict[str, int], assumptions: list[str]
) -> Array:
    """Return the rotation of the motion's axes: the rest pose's, unless the body stands on another axis in the clip.

    A lying body has its hips near the floor; one that stands in other axes has them a leg's length along these axes.
    """
    axis = _nearest_axis(up)
    rested = rotation.rotate(upright, axis)
    legs = _midpoint(position, joints, "hip") - _midpoint(position, joints, _lowest_leg_joint(joints))
    height = np.median(position[:, 0] @ axis) / max(float(np.median(np.linalg.norm(legs, axis=-1))), 1e-12)
    if up @ axis > 0.9 and abs(rested[1]) < 0.5 and 0.6 < height < 1.5:
        assumptions.append("The motion stands on another axis than the rest pose.")
        return rotation.rotation_between(axis, np.array([0.0, 1.0, 0.0]))
    return upright


def _classify_arms(position: Array, joints: dict[str, int]) -> str:
    """Return "T", "A", "I" or "other" from the arms' angle to straight down."""
    down = -_body_up(position[None], joints)[0]
    across = rotation.normalise(position[joints["l_hip"]] - position[joints["r_hip"]])
    angles = []
    for side, out in (("l", across), ("r", -across)):
        arm = rotation.normalise(position[joints[f"{side}_elbow"]] - position[joints[f"{side}_shoulder"]])
        if np.hypot(arm @ down, arm @ out) < 0.8:
            return "other"
        angles.append(np.degrees(np.arctan2(arm @ out, arm @ down)))
    angle = float(np.mean(angles))
    if angle < -20.0 or angle > 115.0 or abs(angles[0] - angles[1]) > 40.0:
        return "other"
    return "I" if angle < 20.0 else "A" if angle < 65.0 else "T"


def _straightness(position: Array, joints: dict[str, int], up: Array) -> Array:
    """Score each frame (n,) by how straight the body stands, with straight arms beside it."""

    def direction(a: str, b: str) -> Array:
        return rotation.normalise(position[:, joints[b]] - position[:, joints[a]])

    end = _lowest_leg_joint(joints)
    across = direction("r_hip", "l_hip")
    score: Array = 2.0 * _body_up(position, joints) @ up + np.sum(
        across * direction("r_shoulder", "l_shoulder"), axis=-1
    )
    for side in "lr":
        thigh = direction(f"{side}_hip", f"{side}_knee")
        arm = direction(f"{side}_shoulder", f"{side}_elbow")
        forward = np.cross(across, up)
        score = score - thigh @ up - np.abs(np.sum(arm * forward, axis=-1)) - np.maximum(arm @ up, 0.0)
        if end == "ankle":
            score = score + np.sum(thigh * direction(f"{side}_knee", f"{side}_ankle"), axis=-1)
        if f"{side}_wrist" in joints:
            score = score + np.sum(arm * direction(f"{side}_elbow", f"{side}_wrist"), axis=-1)
    return score
