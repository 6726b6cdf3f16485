from __future__ import annotations

import numpy as np
import pytest

from bunraku.motion.errors import UnreadableFile
from bunraku.motion.readers import bvh
from bunraku.motion.readers.acclaim import parse_amc, parse_asf
from tests.motion.readers.sources import write_acclaim
from tests.motion.synthetic_motion import export_bvh, smooth_motion

SOURCE = bvh.parse_bvh(export_bvh(smooth_motion(frames=6)))
ASF, AMC = write_acclaim(SOURCE, SOURCE.names)


def test_bones_begin_where_joints_are() -> None:
    motion = parse_amc(AMC, parse_asf(ASF))
    positions, _ = motion.world_transforms([])
    expected, _ = SOURCE.world_transforms(list(range(len(SOURCE.names))))
    joints = [motion.names.index(name) for name in SOURCE.names[1:]]
    np.testing.assert_allclose(positions[:, joints], expected[:, 1:], atol=1e-5)
    assert (motion.fps, motion.frame_count, motion.names[0]) == (120.0, 6, "root")
    assert len(motion.ends) == 5


def test_axes_turn_the_frame_of_the_angles() -> None:
    asf = b"""
:units
  angle deg
:root
  order TX TY TZ RX RY RZ
:bonedata
  begin
    name a
    direction 1 0 0
    length 2
    axis 0 0 90 XYZ
    dof rx
  end
  begin
    name b
    direction 0 0 1
    length 1
    axis 0 0 0 XYZ
  end
:hierarchy
  begin
    root a
    a b
  end
"""
    motion = parse_amc(b":DEGREES\n1\nroot 1 2 3 0 0 0\na 90\n", parse_asf(asf))
    # x of the bone's frame is y of the world: the bone turns from x to -z
    np.testing.assert_allclose(motion.positions[0], [[1.0, 2.0, 3.0], [1.0, 2.0, 3.0], [1.0, 2.0, 1.0]], atol=1e-12)
    assert motion.ends[0].offset.tolist() == [0.0, 0.0, 1.0]


def test_radians_are_read() -> None:
    skeleton = parse_asf(ASF.replace(b"angle deg", b"angle rad"))
    assert skeleton.radians == 1.0
    still = parse_amc(AMC, parse_asf(ASF)).orientations
    turned = parse_amc(AMC, skeleton).orientations
    # the AMC says degrees itself
    np.testing.assert_allclose(turned, still)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        (b"\nname l_hip", b""),
        (b"\nname l_hip", b"\nname r_hip"),
        (b"direction 0.0", b"direction x"),
        (b"axis 0 0 0 XYZ", b"axis 0 0 0 XXZ"),
        (b"  begin\n  root", b"  begin\n  rooty"),
        (b"root link1\n", b"root link1 link1\n"),
    ],
)
def test_broken_skeletons_are_refused_with_the_line(old: bytes, new: bytes) -> None:
    assert old in ASF
    with pytest.raises(UnreadableFile) as caught:
        parse_asf(ASF.replace(old, new, 1))
    assert caught.value.title == "Broken Acclaim file"
    assert caught.value.line is not None
    assert caught.value.hint


def test_missing_bones_are_refused() -> None:
    with pytest.raises(UnreadableFile, match="No skeleton"):
        parse_asf(b":version 1.10\n")


@pytest.mark.parametrize(
    ("data", "detail"),
    [
        (b"root 0 0 0 0 0 0\n", "before the number"),
        (b"1\nroot 0 0 0\n", "degrees of freedom"),
        (b"1\nroot 0 0 0 0 0 nan\n", "not numbers"),
        (b"1\nnobody 1\n", "no bone 'nobody'"),
        (b"1\nl_hip 1 2 3\nl_hip 1 2 3\n", "twice in a frame"),
    ],
)
def test_broken_motions_are_refused_with_the_line(data: bytes, detail: str) -> None:
    with pytest.raises(UnreadableFile, match=detail) as caught:
        parse_amc(data, parse_asf(ASF))
    assert caught.value.line is not None


def test_bones_without_values_in_a_frame_are_at_rest_in_it() -> None:
    motion = parse_amc(b"1\nl_hip 10 0 0\n2\n3\nl_hip 20 0 0\n4\n", parse_asf(ASF))
    turned = np.degrees(2.0 * np.arccos(motion.orientations[:, motion.names.index("l_hip"), 0]))
    np.testing.assert_allclose(turned, [10.0, 0.0, 20.0, 0.0], atol=1e-6)


def test_motion_without_frames_is_refused() -> None:
    with pytest.raises(UnreadableFile, match="No motion"):
        parse_amc(b":DEGREES\n", parse_asf(ASF))
