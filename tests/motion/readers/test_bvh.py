from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bunraku.motion.bvh_writer import write_bvh
from bunraku.motion.errors import UnreadableFile
from bunraku.motion.readers.bvh import Bvh, parse_bvh
from bunraku.motion.rotation import from_rotation_vector
from bunraku.motion.skeleton import JOINT_COUNT, JOINTS, Motion, standard_figure, world_transforms
from tests.motion.readers.bvh_samples import HIERARCHY_TEXT, MINIMAL_BVH, ROWS, VALUES, motion_section


@pytest.mark.parametrize(
    "data",
    [
        pytest.param(MINIMAL_BVH, id="plain"),
        pytest.param(MINIMAL_BVH.replace(b"\n", b"\r\n"), id="CRLF"),
        pytest.param(MINIMAL_BVH.replace(b"\n", b"\r"), id="lone CR"),
        pytest.param(b"\xef\xbb\xbf" + MINIMAL_BVH, id="BOM"),
        pytest.param(b"\xff\xfe" + MINIMAL_BVH.decode().encode("utf-16-le"), id="UTF-16 little"),
        pytest.param(b"\xfe\xff" + MINIMAL_BVH.decode().encode("utf-16-be"), id="UTF-16 big"),
        pytest.param(MINIMAL_BVH.replace(b" ", b"\t").replace(b"End\tSite", b"End Site"), id="tabs"),
        pytest.param(MINIMAL_BVH.replace(b"\n", b"\n\n \t\n"), id="blank lines"),
        pytest.param(MINIMAL_BVH.replace(b"\n  {", b" {").replace(b"Hips\n{", b"Hips {"), id="brace on the line"),
        pytest.param(MINIMAL_BVH.lower().replace(b"hips", b"Hips").replace(b"spine", b"Spine"), id="lower case"),
        pytest.param(MINIMAL_BVH.replace(b"OFFSET", b"# a comment\nOFFSET"), id="comments"),
        pytest.param(HIERARCHY_TEXT + motion_section(b" ".join(ROWS)), id="all on one line"),
        pytest.param(HIERARCHY_TEXT + motion_section(*b" ".join(ROWS).split()), id="a value a line"),
        pytest.param(HIERARCHY_TEXT + motion_section(b"1e0 .2E1 30e-1 4. +5 6 7 8 9.50", ROWS[1]), id="E-notation"),
        pytest.param(MINIMAL_BVH.replace(b".", b","), id="decimal commas"),
        pytest.param(
            HIERARCHY_TEXT + motion_section(*(row.replace(b" ", b", ") for row in ROWS)), id="separating commas"
        ),
    ],
)
def test_every_dialect_parses_like_the_plain_file(data: bytes) -> None:
    bvh = parse_bvh(data)
    assert bvh.names == ("Hips", "Spine")
    assert bvh.parents == (-1, 0)
    assert bvh.offsets.tolist() == [[0.0, 90.0, 0.0], [0.0, 10.5, 0.0]]
    assert [end.offset.tolist() for end in bvh.ends] == [[0.0, 20.0, 0.0]]
    assert bvh.frames.tolist() == VALUES
    assert (bvh.frame_time, bvh.fps, bvh.notes) == (0.04, 25.0, ())


@pytest.mark.parametrize("data", [b"", b" \r\n\t", b"\xef\xbb\xbf"])
def test_empty_file_is_rejected(data: bytes) -> None:
    with pytest.raises(UnreadableFile, match="Empty file") as caught:
        parse_bvh(data)
    assert caught.value.hint


def test_broken_utf16_and_missing_channels_are_rejected() -> None:
    with pytest.raises(UnreadableFile, match="Broken text"):
        parse_bvh(b"\xff\xfeH\x00I")
    with pytest.raises(UnreadableFile, match="No channels"):
        parse_bvh(b"HIERARCHY\nROOT a\n{\nOFFSET 0 0 0\nCHANNELS 0\n}\nMOTION\nFrames: 1\nFrame Time: 1\n1\n")


@pytest.mark.parametrize(
    ("time", "fps"),
    [(b".0083333", 120.0), (b"0.0333333", 30.0), (b"0.033367", pytest.approx(29.97, abs=1e-3)), (b"0.025000", 40.0)],
)
def test_rounded_frame_time_gives_the_original_rate(time: bytes, fps: float) -> None:
    assert parse_bvh(HIERARCHY_TEXT + motion_section(time=b"Frame Time: " + time)).fps == fps


def test_all_real_clips_parse(shared: Path) -> None:
    clips = sorted((shared / "mocap" / "bvh").glob("*.bvh"))
    assert clips
    for clip in clips:
        bvh = parse_bvh(clip.read_bytes())
        assert bvh.frames.shape == (len(bvh.frames), sum(map(len, bvh.channels)))
        assert len(bvh.frames) > 100
        assert bvh.fps in (40.0, 120.0)
        last = [float(word) for word in clip.read_bytes().rstrip().splitlines()[-1].split()]
        assert bvh.frames[-1] == pytest.approx(last, rel=1e-14, abs=0.0)


@st.composite
def motions(draw: st.DrawFn) -> Motion:
    random = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    n = draw(st.integers(1, 5))
    turned = from_rotation_vector(random.uniform(-3.0, 3.0, (n, JOINT_COUNT, 3)))
    return Motion(
        standard_figure(), draw(st.sampled_from([24.0, 30.0, 60.0, 120.0])), random.normal(0, 2, (n, 3)), turned
    )


@settings(max_examples=25)
@given(motions())
def test_written_motion_parses_to_the_same_motion(motion: Motion) -> None:
    bvh: Bvh = parse_bvh(write_bvh(motion))
    assert (bvh.names, bvh.notes, bvh.fps) == (JOINTS, (), motion.fps)
    position, orientation = bvh.world_transforms(list(range(JOINT_COUNT)))
    true_position, true_orientation = world_transforms(motion.figure, motion.root, motion.rotations)
    assert np.abs(position / 100.0 - true_position).max() < 1e-6
    assert np.abs(np.sum(orientation * true_orientation, axis=-1)).min() > 1.0 - 1e-9


def test_quarter_turn_about_z_rotates_the_spine() -> None:
    bvh = parse_bvh(HIERARCHY_TEXT + motion_section(b"1 2 3 90 0 0 0 0 0", b"1 2 3 90 90 0 0 0 0"))
    position, _ = bvh.world_transforms([1])
    assert position[:, 0].tolist() == [[1.0, 2.0, 3.0]] * 2
    # z first, then x about the turned x: the spine, y, goes to -x, then to z
    assert position[:, 1] == pytest.approx(np.array([[-9.5, 2.0, 3.0], [1.0, 2.0, 13.5]]))
    assert bvh.rest_positions.tolist() == [[0.0, 0.0, 0.0], [0.0, 10.5, 0.0]]
    assert bvh.channel_columns == [0, 6]


@pytest.mark.parametrize("y", [10.5, 0.0])
def test_limb_position_channels_replace_or_extend_the_offset(y: float) -> None:
    channels = b"6 Xposition Yposition Zposition Zrotation Xrotation Yrotation"
    row = b"0 0 0 0 0 0 0.5 %f 0 0 0 0" % y
    bvh = parse_bvh(HIERARCHY_TEXT.replace(b"3 Zrotation Xrotation Yrotation", channels, 1) + motion_section(row, row))
    position, _ = bvh.world_transforms([1], np.array([1]))
    assert position[0, 1].tolist() == [0.5, 10.5, 0.0]


def test_root_without_position_channels_stays_at_its_offset() -> None:
    bvh = parse_bvh(
        HIERARCHY_TEXT.replace(b"6 Xposition Yposition Zposition", b"3", 1) + motion_section(b"0 0 0 0 0 0")
    )
    assert bvh.world_transforms([0])[0][:, 0].tolist() == [[0.0, 90.0, 0.0]]
