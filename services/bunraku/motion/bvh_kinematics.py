"""Where the joints of a BVH file are, frame by frame."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from bunraku.motion import rotation
from bunraku.motion.bvh import Bvh
from bunraku.motion.rotation import Array


def channel_columns(bvh: Bvh) -> list[int]:
    """For each joint, the column of `bvh.frames` where its channels begin."""
    widths = [len(channels) for channels in bvh.channels]
    return [0, *np.cumsum(widths)[:-1].tolist()]


def rest_positions(bvh: Bvh) -> Array:
    """Positions (J, 3) of all joints with no rotation, the root at the origin; the file's units and axes."""
    position = np.zeros((len(bvh.names), 3))
    for joint, parent in enumerate(bvh.parents):
        if parent >= 0:
            position[joint] = position[parent] + bvh.offsets[joint]
    return position


def ancestor_chain(bvh: Bvh, joint: int) -> list[int]:
    """`joint` and its ancestors up to the root."""
    way = []
    while joint >= 0:
        way.append(joint)
        joint = bvh.parents[joint]
    return way


def forward_kinematics(bvh: Bvh, joints: list[int], frames: npt.NDArray[np.int64] | None = None) -> tuple[Array, Array]:
    """World positions (n, J, 3) and orientations (n, J, 4) of `joints` and their ancestors; others stay zero.

    `frames` chooses frames by index (default: all). In the file's units and axes. Rotation channels turn in the
    order in which they stand, each about the axis that the ones before have turned. Position channels stand in
    place of the offset, as exporters mean them; below the root, where they stay nearer to zero than to the offset,
    they are added to it.
    """
    values = bvh.frames if frames is None else bvh.frames[frames]
    position = np.zeros((len(values), len(bvh.names), 3))
    orientation = np.zeros((len(values), len(bvh.names), 4))
    column = channel_columns(bvh)
    used = {ancestor for joint in joints for ancestor in ancestor_chain(bvh, joint)}
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
    """Rotation (n, 4) and offset (n, 3) or (3,) of a joint in its parent."""
    turned = np.tile(rotation.IDENTITY, (len(values), 1))
    offset = bvh.offsets[joint]
    moved = np.tile(offset, (len(values), 1))
    for index, channel in enumerate(bvh.channels[joint]):
        track = values[:, column + index]
        axis = "XYZ".index(channel[0])
        if channel.endswith("rotation"):
            turned = rotation.multiply(turned, rotation.from_coordinate_axis(axis, np.radians(track)))
        else:
            moved[:, axis] = track
    given = ["XYZ".index(c[0]) for c in bvh.channels[joint] if c.endswith("position")]
    if given and bvh.parents[joint] >= 0:
        # over the whole clip, so that all choices of frames are read alike
        columns = [column + index for index, c in enumerate(bvh.channels[joint]) if c.endswith("position")]
        mean = bvh.frames[:, columns].mean(axis=0)
        if np.linalg.norm(mean) < np.linalg.norm(mean - offset[given]):
            moved[:, given] += offset[given]
    return turned, moved
