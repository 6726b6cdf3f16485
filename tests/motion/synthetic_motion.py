"""Motions for tests: a smooth dance of a figure, in the conventions of several programs."""

from __future__ import annotations

import numpy as np

from bunraku.motion import rotation
from bunraku.motion.bvh_writer import euler_zxy
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import (
    JOINT_COUNT,
    JOINT_INDEX,
    JOINTS,
    PARENTS,
    TIP_JOINTS,
    Figure,
    Motion,
    standard_figure,
    world_transforms,
)

LEFT = ("l_shoulder", "l_elbow", "l_wrist")
RIGHT = ("r_shoulder", "r_elbow", "r_wrist")


def straight_figure() -> Figure:
    """The standard figure with limbs straight down, as analysis makes them."""
    figure = standard_figure()
    offsets, tips = figure.offsets.copy(), np.zeros((JOINT_COUNT, 3))
    for side in "lr":
        for name in ("knee", "ankle", "elbow", "wrist"):
            joint = JOINT_INDEX[f"{side}_{name}"]
            offsets[joint] = (0.0, -np.linalg.norm(offsets[joint]), 0.0)
        tips[JOINT_INDEX[f"{side}_wrist"]] = (0.0, -0.18, 0.0)
        tips[JOINT_INDEX[f"{side}_midtarsal"]] = (0.0, 0.0, 0.07)
    tips[JOINT_INDEX["skullbase"]] = (0.0, 0.2, 0.0)
    still = np.tile(rotation.IDENTITY, (JOINT_COUNT, 1))
    from_root, _ = world_transforms(Figure(offsets, tips), np.zeros(3), still)
    offsets[0] = (0.0, -from_root[:, 1].min(), 0.0)
    return Figure(offsets, tips)


def smooth_motion(frames: int = 90, seed: int = 0, swing: float = 0.5, fps: float = 30.0) -> Motion:
    """A smooth dance of the straight figure, all joints turning by up to about `swing` radians; it begins at rest."""
    random = np.random.default_rng(seed)
    t = np.arange(frames) / fps
    rate = random.uniform(0.3, 1.0, (JOINT_COUNT, 3))
    turn = swing / 3**0.5 * random.uniform(-1.0, 1.0, (JOINT_COUNT, 3))
    rotations = rotation.from_rotation_vector(turn * np.sin(2.0 * np.pi * rate * t[:, None, None]))
    figure = straight_figure()
    root = figure.offsets[0] + 0.05 * np.sin(t[:, None] * [1.0, 2.0, 1.5])
    return Motion(figure, fps, root, rotations)


def stepping_motion(frames: int = 90, fps: float = 30.0) -> Motion:
    """A figure that stands, and lifts its right foot in the middle third."""
    figure = straight_figure()
    rotations = np.tile(rotation.IDENTITY, (frames, JOINT_COUNT, 1))
    at = np.arange(frames) / frames
    lift = 0.8 * np.clip(12 * np.minimum(at - 1 / 3, 2 / 3 - at), 0.0, 1.0)
    rotations[:, JOINT_INDEX["r_hip"]] = rotation.from_rotation_vector(lift[:, None] * [-1.0, 0.0, 0.0])
    return Motion(figure, fps, np.tile(figure.offsets[0], (frames, 1)), rotations)


def pose_with_arms(degrees: float) -> Array:
    """World orientations (18, 4) of the figure with its arms raised to the sides by `degrees` from hanging."""
    angle = np.radians(degrees)
    orientations = np.tile(rotation.IDENTITY, (JOINT_COUNT, 1))
    for name in LEFT:
        orientations[JOINT_INDEX[name]] = rotation.from_coordinate_axis(2, angle)
    for name in RIGHT:
        orientations[JOINT_INDEX[name]] = rotation.from_coordinate_axis(2, -angle)
    return orientations


def bone_aligned(figure: Figure) -> Array:
    """World orientations (18, 4) of joint frames whose y axis lies along the bone to the next joint."""
    orientations = np.tile(rotation.IDENTITY, (JOINT_COUNT, 1))
    for joint in range(JOINT_COUNT):
        children = [k for k in range(JOINT_COUNT) if PARENTS[k] == joint]
        bone = figure.offsets[children[0]] if children else figure.tips[joint]
        orientations[joint] = rotation.rotation_between(bone, np.array([0.0, 1.0, 0.0]))
    return orientations


def export_bvh(
    motion: Motion,
    rest_orientations: Array | None = None,
    axes: Array = rotation.IDENTITY,
    units_per_metre: float = 100.0,
    names: tuple[str, ...] = JOINTS,
) -> bytes:
    """`motion` as BVH whose joints are unturned where the figure's have the world orientations `at_rest` (18, 4).

    The whole is turned by `axes` (4,), in `per_metre` units to the metre, its joints called `names`.
    """
    rest_orientations = pose_with_arms(0.0) if rest_orientations is None else rest_orientations
    placed, oriented = world_transforms(motion.figure, motion.root, motion.rotations)
    placed = rotation.rotate(axes, placed) * units_per_metre
    source = rotation.multiply(
        rotation.multiply(axes, oriented), rotation.conjugate(rotation.multiply(axes, rest_orientations))
    )
    local = source.copy()
    local[:, 1:] = rotation.multiply(rotation.conjugate(source[:, PARENTS[1:]]), source[:, 1:])
    turned = rotation.multiply(axes, rest_orientations)
    offsets = np.zeros((JOINT_COUNT, 3))
    offsets[1:] = rotation.rotate(turned[list(PARENTS[1:])], motion.figure.offsets[1:]) * units_per_metre
    tips = rotation.rotate(turned, motion.figure.tips) * units_per_metre
    lines = ["HIERARCHY"]
    _append_joint(lines, 0, names, offsets, tips)
    lines += ["MOTION", f"Frames: {motion.frame_count}", f"Frame Time: {1.0 / motion.fps:.10g}"]
    values = np.concatenate([placed[:, 0], euler_zxy(local).reshape(motion.frame_count, -1)], axis=1)
    lines += [" ".join(f"{value:.9f}" for value in row) for row in values]
    return "\n".join(lines).encode()


def _append_joint(lines: list[str], joint: int, names: tuple[str, ...], offsets: Array, tips: Array) -> None:
    position = "" if joint else "Xposition Yposition Zposition "
    lines += [f"{'JOINT' if joint else 'ROOT'} {names[joint]}", "{", "OFFSET " + _format_values(offsets[joint])]
    lines.append(f"CHANNELS {3 if joint else 6} {position}Zrotation Xrotation Yrotation")
    for child in range(JOINT_COUNT):
        if PARENTS[child] == joint:
            _append_joint(lines, child, names, offsets, tips)
    if joint in TIP_JOINTS:
        lines += ["End Site", "{", "OFFSET " + _format_values(tips[joint]), "}"]
    lines.append("}")


def _format_values(values: Array) -> str:
    return " ".join(f"{value:.9f}" for value in values)
