"""BVH writer."""

from __future__ import annotations

import numpy as np

from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import JOINTS, PARENTS, TIP_JOINTS, Motion

CENTIMETRES_PER_METRE = 100.0


def euler_zxy(q: Array) -> Array:
    """Return Euler angles (..., 3) in degrees of unit quaternions (..., 4), applied about z, x and y.

    Each rotation is about the axis rotated by the previous ones; the angle about x is within 90 degrees. Where it is
    90, the angle about y is zero.
    """
    w, x, y, z = (q[..., i] for i in range(4))
    sine = 2.0 * (w * x + y * z)
    locked = np.abs(sine) > 1.0 - 1e-12
    about_z = np.where(
        locked,
        np.arctan2(2.0 * (x * y + w * z), 1.0 - 2.0 * (y * y + z * z)),
        np.arctan2(2.0 * (w * z - x * y), 1.0 - 2.0 * (x * x + z * z)),
    )
    about_x = np.arctan2(sine, np.hypot(2.0 * (w * y - x * z), 1.0 - 2.0 * (x * x + y * y)))
    about_y = np.where(locked, 0.0, np.arctan2(2.0 * (w * y - x * z), 1.0 - 2.0 * (x * x + y * y)))
    angles: Array = np.degrees(np.stack([about_z, about_x, about_y], axis=-1))
    return angles


def write_bvh(motion: Motion) -> bytes:
    """Write `motion` as BVH in centimetres, y up, facing z, with H-Anim joint names and the I-pose as rest pose.

    The root has six channels with absolute positions; all joints rotate in the order z, x, y. Lengths and angles have 6
    decimals.
    """
    offsets = motion.figure.offsets * CENTIMETRES_PER_METRE
    offsets[0] = 0.0
    lines = ["HIERARCHY"]
    depth = 0
    for joint, name in enumerate(JOINTS):
        while joint and depth > _joint_depth(joint):
            depth -= 1
            lines.append("\t" * depth + "}")
        indent = "\t" * depth
        kind, channels = ("JOINT", "3") if joint else ("ROOT", "6 Xposition Yposition Zposition")
        lines += [f"{indent}{kind} {name}", indent + "{", f"{indent}\tOFFSET {_format_values(offsets[joint])}"]
        lines.append(f"{indent}\tCHANNELS {channels} Zrotation Xrotation Yrotation")
        depth += 1
        if joint in TIP_JOINTS:
            tip = _format_values(motion.figure.tips[joint] * CENTIMETRES_PER_METRE)
            lines += [f"{indent}\tEnd Site", indent + "\t{", f"{indent}\t\tOFFSET {tip}", indent + "\t}"]
    while depth > 0:
        depth -= 1
        lines.append("\t" * depth + "}")
    lines += ["MOTION", f"Frames: {motion.frame_count}", f"Frame Time: {1.0 / motion.fps:.10g}"]
    angles = euler_zxy(motion.rotations).reshape(motion.frame_count, -1)
    values = np.concatenate([motion.root * CENTIMETRES_PER_METRE, angles], axis=1)
    form = " ".join(["%.6f"] * values.shape[1])
    lines += [form % tuple(row) for row in values.tolist()]
    return ("\n".join(lines) + "\n").encode()


def _joint_depth(joint: int) -> int:
    return 0 if PARENTS[joint] < 0 else 1 + _joint_depth(PARENTS[joint])


def _format_values(values: Array) -> str:
    return " ".join(f"{value:.6f}" for value in values.tolist())
