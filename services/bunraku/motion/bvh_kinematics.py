"""Forward kinematics of a BVH file."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from bunraku.motion import rotation
from bunraku.motion.bvh import Bvh
from bunraku.motion.joint_tree import ancestor_chain
from bunraku.motion.rotation import Array


def channel_columns(bvh: Bvh) -> list[int]:
    """Return, for each joint, the first column of its channels in `bvh.frames`."""
    widths = [len(channels) for channels in bvh.channels]
    return [0, *np.cumsum(widths)[:-1].tolist()]


def rest_positions(bvh: Bvh) -> Array:
    """Return the positions (J, 3) of all joints without rotation, root at the origin, in the file's units and axes."""
    position = np.zeros((len(bvh.names), 3))
    for joint, parent in enumerate(bvh.parents):
        if parent >= 0:
            position[joint] = position[parent] + bvh.offsets[joint]
    return position


def forward_kinematics(bvh: Bvh, joints: list[int], frames: npt.NDArray[np.int64] | None = None) -> tuple[Array, Array]:
    """Return world positions (n, J, 3) and orientations (n, J, 4) of `joints` and their ancestors; others stay zero.

    `frames` selects frames by index (default: all). Units and axes are the file's. Rotation channels apply in file
    order, each about the axis rotated by the previous ones. Position channels replace the offset, as exporters mean
    them; below the root, if they stay nearer to zero than to the offset, they are added to it.
    """
    values = bvh.frames if frames is None else bvh.frames[frames]
    position = np.zeros((len(values), len(bvh.names), 3))
    orientation = np.zeros((len(values), len(bvh.names), 4))
    column = channel_columns(bvh)
    used = {ancestor for joint in joints for ancestor in ancestor_chain(bvh.parents, joint)}
    for joint in sorted(used):
        parent = bvh.parents[joint]
        local, offset = _local_transform(bvh, joint, values, column[joint])
        if parent < 0:
            position[:, joint], orientation[:, joint] = offset, local
        else:
            up = orientation[:, parent]
            position[:, joint] = position[:, parent] + rotation.rotate(up, offset)
            orientation[:, joint] = rotation.multiply(up, local)
    return position, orientation


def _local_transform(bvh: Bvh, joint: int, values: Array, column: int) -> tuple[Array, Array]:
    """Return rotation (n, 4) and offset (n, 3) of a joint relative to its parent."""
    turned = np.tile(rotation.IDENTITY, (len(values), 1))
    offset = bvh.offsets[joint]
    moved = np.tile(offset, (len(values), 1))
    for index, channel in enumerate(bvh.channels[joint]):
        track = values[:, column + index]
        axis = "XYZ".index(channel[0])
        if channel.endswith("rotation"):
            turned = rotation.multiply(turned, rotation.from_coordinate_axis(axis, np.radians(track)))
        elif channel.endswith("position"):
            moved[:, axis] = track
    given = ["XYZ".index(c[0]) for c in bvh.channels[joint] if c.endswith("position")]
    if given and bvh.parents[joint] >= 0:
        # over the whole clip, so that the result does not depend on the selected frames
        columns = [column + index for index, c in enumerate(bvh.channels[joint]) if c.endswith("position")]
        mean = bvh.frames[:, columns].mean(axis=0)
        if np.linalg.norm(mean) < np.linalg.norm(mean - offset[given]):
            moved[:, given] += offset[given]
    return turned, moved
