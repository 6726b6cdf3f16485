"""Reader of BVH (Biovision Hierarchy): a tree of joints, then one row of channel values per frame.

There is no standard; the common ground is Meredith and Maddock, "Motion Capture File Formats Explained" (2001). The
reader accepts what exporters really write and reports its choices in `notes`; a file that it cannot read raises
`UnreadableFile` with the line number. Time and memory are linear in the size of the file, without recursion.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from bunraku.motion import rotation
from bunraku.motion.errors import UnreadableFile
from bunraku.motion.joint_tree import ancestor_chain
from bunraku.motion.readers.bvh_frames import parse_frames
from bunraku.motion.readers.bvh_hierarchy import MAX_LENGTH, Hierarchy, parse_hierarchy
from bunraku.motion.rotation import Array
from bunraku.motion.source_motion import NTSC_RATES, EndSite

BYTE_ORDER_MARKS = ((b"\xef\xbb\xbf", "utf-8"), (b"\xff\xfe", "utf-16-le"), (b"\xfe\xff", "utf-16-be"))
MAX_ANGLE_DEG = 1e6
"""Largest angle in either direction: beyond thousands of turns there is a broken value."""


@dataclass(frozen=True, slots=True)
class Bvh:
    """Contents of a BVH file in its own units, axes and names.

    For J joints, parents before children: `names`, `parents` (-1 for the root), `offsets` (J, 3) from the parent,
    `channels` (each a tuple of "Xposition" ... "Zrotation" in the file's order) and `joint_lines`, their line
    numbers. `ends` are the End Sites. `frames` (n, C) holds the channel values in the order of the joints, angles
    in degrees; `frame_time` is in seconds. `notes` are sentences about irregularities.
    """

    names: tuple[str, ...]
    parents: tuple[int, ...]
    offsets: Array
    channels: tuple[tuple[str, ...], ...]
    joint_lines: tuple[int, ...]
    ends: tuple[EndSite, ...]
    frames: Array
    frame_time: float
    notes: tuple[str, ...]

    @property
    def fps(self) -> float:
        """Frames per second: the whole number or NTSC rate that `frame_time` was rounded from, if there is one."""
        rate = 1.0 / self.frame_time
        if abs(rate - round(rate)) < 1e-9 * rate:
            return float(round(rate))
        digits = len(np.format_float_positional(self.frame_time).partition(".")[2])
        for usual in (round(rate), 24, 25, 30, 50, 60, 90, 100, 120, 240, *NTSC_RATES):
            if usual > 0 and abs(rate - usual) < 0.02 * rate and round(1.0 / usual, digits) == self.frame_time:
                return float(usual)
        return rate

    @property
    def metres_per_unit(self) -> None:
        """Unit of length: BVH files declare none."""
        return None

    @property
    def frame_count(self) -> int:
        """Number of frames."""
        return len(self.frames)

    @property
    def expressions(self) -> dict[str, Array]:
        """Weights of blend shapes: BVH files have none."""
        return {}

    @property
    def channel_columns(self) -> list[int]:
        """First column of each joint's channels in `frames`."""
        widths = [len(channels) for channels in self.channels]
        return [0, *np.cumsum(widths)[:-1].tolist()]

    @property
    def rest_positions(self) -> Array:
        """World positions (J, 3) of all joints without rotation, root at the origin."""
        position = np.zeros((len(self.names), 3))
        for joint, parent in enumerate(self.parents):
            if parent >= 0:
                position[joint] = position[parent] + self.offsets[joint]
        return position

    @property
    def rest_orientations(self) -> Array:
        """World orientations (J, 4) of all joints without rotation."""
        return np.tile(rotation.IDENTITY, (len(self.names), 1))

    def world_transforms(self, joints: list[int], frames: npt.NDArray[np.int64] | None = None) -> tuple[Array, Array]:
        """Return world positions (n, J, 3) and orientations (n, J, 4) of `joints` and their ancestors; others are zero.

        Rotation channels apply in file order, each about the axis rotated by the previous ones. Position channels
        replace the offset, as exporters mean them; below the root, if they stay nearer to zero than to the offset, they
        are added to it.
        """
        values = self.frames if frames is None else self.frames[frames]
        position = np.zeros((len(values), len(self.names), 3))
        orientation = np.zeros((len(values), len(self.names), 4))
        columns = self.channel_columns
        used = {ancestor for joint in joints for ancestor in ancestor_chain(self.parents, joint)}
        for joint in sorted(used):
            parent = self.parents[joint]
            local, offset = _local_transform(self, joint, values, columns[joint])
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


def parse_bvh(data: bytes) -> Bvh:
    """Parse a BVH file in UTF-8, UTF-16 with a byte order mark, or Latin-1.

    Raises `UnreadableFile` if the data is not a BVH file or contains no valid motion.
    """
    text = _normalise_text(data)
    if not text or text.isspace():
        raise UnreadableFile("Empty file", "the file has no content", hint="export the motion again and send that file")
    hierarchy = parse_hierarchy(text)
    width = sum(len(channels) for channels in hierarchy.channels)
    if width == 0:
        raise UnreadableFile(
            "No channels", "no joint has a channel, so nothing can move", hint="export with rotations of the joints"
        )
    frames, frame_time, notes = parse_frames(text, hierarchy.motion_start, hierarchy.motion_line, width)
    _check_range(hierarchy, frames)
    return Bvh(
        names=hierarchy.names,
        parents=hierarchy.parents,
        offsets=hierarchy.offsets,
        channels=hierarchy.channels,
        joint_lines=hierarchy.joint_lines,
        ends=hierarchy.ends,
        frames=frames,
        frame_time=frame_time,
        notes=(*hierarchy.notes, *notes),
    )


def _check_range(hierarchy: Hierarchy, frames: Array) -> None:
    """Raise `UnreadableFile` for values beyond `MAX_ANGLE_DEG` and `MAX_LENGTH`."""
    owners = [(joint, channel) for joint, channels in enumerate(hierarchy.channels) for channel in channels]
    limits = [MAX_ANGLE_DEG if channel.endswith("rotation") else MAX_LENGTH for _, channel in owners]
    too_large = np.abs(frames) > limits
    if too_large.any():
        frame, column = np.argwhere(too_large)[0].tolist()
        joint, channel = owners[column]
        raise UnreadableFile(
            "Value out of range",
            f"in frame {frame + 1}, {channel} is {frames[frame, column]:.3g}",
            field=hierarchy.names[joint],
            hint="the export went wrong in this frame; cut it out or export again",
        )


def _normalise_text(data: bytes) -> bytes:
    """Return `data` without byte order mark, in an ASCII-compatible encoding, with line feeds only."""
    if len(data) > 1 and 0 in data[:2] and data[0] != data[1]:
        # the first letter is of two bytes
        data = (b"\xff\xfe" if data[1] == 0 else b"\xfe\xff") + data
    for mark, encoding in BYTE_ORDER_MARKS:
        if data.startswith(mark):
            data = data[len(mark) :]
            if encoding != "utf-8":
                try:
                    data = data.decode(encoding).encode()
                except UnicodeError as error:
                    raise UnreadableFile(
                        "Broken text", f"the file says it is {encoding.upper()}, but it is not", hint="save it as UTF-8"
                    ) from error
            break
    return data.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
