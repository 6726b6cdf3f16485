from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bunraku.motion.analysis import Analysis, analyse
from bunraku.motion.errors import UnreadableFile
from bunraku.motion.readers.bvh import Bvh, parse_bvh
from bunraku.motion.readers.motion_file import list_takes, read_motion
from bunraku.motion.skeleton import world_transforms
from tests.motion.readers.fbx_writer import write_fbx
from tests.motion.readers.sources import write_acclaim, write_glb, write_zip
from tests.motion.synthetic_motion import export_bvh, smooth_motion

CLIPS = ("cmu_12_01_walk", "mass_walk", "perfume_C")
SECONDS = 4.0


def read_clip(name: str, shared: Path) -> Bvh:
    source = parse_bvh((shared / "mocap" / "bvh" / f"{name}.bvh").read_bytes())
    return replace(source, frames=source.frames[1 : 1 + int(SECONDS * source.fps)])


def apart_mm(one: Analysis, other: Analysis) -> float:
    """Return the largest distance of the joints of two analyses in millimetres."""
    assert one.motion.frame_count == other.motion.frame_count
    placed = [world_transforms(each.motion.figure, each.motion.root, each.motion.rotations)[0] for each in (one, other)]
    return 1000.0 * float(np.linalg.norm(placed[0] - placed[1], axis=-1).max())


@pytest.mark.parametrize("name", CLIPS)
@pytest.mark.parametrize("scale", [1.0, 0.01])
def test_glb_has_the_joints_of_the_bvh_file(name: str, scale: float, shared: Path) -> None:
    source = read_clip(name, shared)
    expected, found = analyse(source), analyse(read_motion(write_glb(source, scale=scale)))
    assert found.source_joints == expected.source_joints
    # frames are numbered, so equal rates are equal times
    assert found.motion.fps == pytest.approx(expected.motion.fps, rel=1e-6)
    assert apart_mm(found, expected) < 1.0


@pytest.mark.parametrize("name", CLIPS)
def test_vrm_animation_is_read_by_its_bones(name: str, shared: Path) -> None:
    source = read_clip(name, shared)
    expected = analyse(source)
    bones = {
        "humanoid_root": "hips",
        "skullbase": "head",
        **{
            f"{letter}_{joint}": side + bone
            for letter, side in (("l", "left"), ("r", "right"))
            for joint, bone in (
                *(("hip", "UpperLeg"), ("knee", "LowerLeg"), ("ankle", "Foot"), ("midtarsal", "Toes")),
                *(("shoulder", "UpperArm"), ("elbow", "LowerArm"), ("wrist", "Hand")),
            )
        },
    }
    mapped = [(bones[joint], name) for joint, name in expected.source_joints.items() if joint in bones]
    human = {bone: {"node": source.names.index(name)} for bone, name in mapped}
    extension = {"VRMC_vrm_animation": {"specVersion": "1.0", "humanoid": {"humanBones": human}}}
    names = tuple(f"node{number}" for number in range(len(source.names)))
    found = analyse(read_motion(write_glb(source, names, extensions=extension)))
    assert found.profile == "VRM"
    assert apart_mm(found, expected) < 1.0


@pytest.mark.parametrize("name", CLIPS)
def test_acclaim_has_the_joints_of_the_bvh_file(name: str, shared: Path) -> None:
    source = read_clip(name, shared)
    names = tuple(f"{number}_{name}".replace(" ", "") for number, name in enumerate(source.names))
    asf, amc = write_acclaim(source, names)
    motion = read_motion(write_zip({"walk.asf": asf, "walk.amc": amc}))
    positions, orientations = motion.world_transforms(list(range(len(motion.names))))
    expected, _ = source.world_transforms(list(range(len(source.names))))
    found = positions[:, [0, *(motion.names.index(name) for name in names[1:])]]
    assert np.abs(found - expected).max() * analyse(source).motion.figure.offsets[3, 1] < 1e-3
    assert np.isfinite(orientations).all()


def test_real_acclaim_clip_is_a_dance(shared: Path) -> None:
    folder = shared / "mocap" / "asfamc"
    packed = write_zip({name: (folder / name).read_bytes() for name in ("03.asf", "03_01.amc", "03_02.amc")})
    for take, frames in (("03_01.amc", 432), ("03_02.amc", None)):
        analysis = analyse(read_motion(packed, take))
        assert (analysis.profile, analysis.motion.fps) == ("Acclaim", 120.0)
        assert analysis.mean_fit_error_mm < 5.0
        if frames:
            assert analysis.motion.frame_count == frames
    assert any("Of 2 takes" in sentence for sentence in analyse(read_motion(packed)).assumptions)


def bvh_clip() -> bytes:
    return export_bvh(smooth_motion(frames=10))


@pytest.mark.parametrize(
    ("files", "take", "title"),
    [
        ({"readme.txt": b"hello"}, None, "No motion"),
        ({"a.bvh": bvh_clip(), "b/c.bvh": bvh_clip()}, "d.bvh", "No such take"),
        ({"a.amc": b"#!OML:ASF\n1\n"}, None, "No skeleton"),
        ({"a.bvh": write_zip({"b.bvh": bvh_clip()})}, None, "Archive in an archive"),
        ({"a.c3d": b"\x02\x50" + bytes(600)}, None, "Markers, not joints"),
    ],
)
def test_archives_are_refused_with_a_hint(files: dict[str, bytes], take: str | None, title: str) -> None:
    with pytest.raises(UnreadableFile) as caught:
        read_motion(write_zip(files), take)
    assert caught.value.title == title
    assert caught.value.hint


def test_file_of_an_archive_is_chosen_by_its_name() -> None:
    long = export_bvh(smooth_motion(frames=30))
    packed = write_zip({"__MACOSX/a.bvh": b"x" * 100_000, "short.bvh": bvh_clip(), "in/long.BVH": long, "b.txt": b"x"})
    assert [read_motion(packed, take).frame_count for take in (None, "short.bvh", "long.BVH")] == [30, 10, 30]


SOURCE = parse_bvh(bvh_clip())


@pytest.mark.parametrize(
    ("data", "names"),
    [
        (bvh_clip(), []),
        (b"no motion", []),
        (write_fbx(), []),
        (write_glb(SOURCE), []),
        (write_zip({"a.bvh": bvh_clip()}), []),
        (write_fbx(takes=("walk", "run")), ["walk", "run"]),
        (write_glb(SOURCE, animations=("idle", "dance")), ["idle", "dance"]),
        (write_zip({"a/c.bvh": b"x", "b/c.bvh": b"x"}), ["a/c.bvh", "b/c.bvh"]),
        (write_zip({"a.zip": b"x", "in/a.bvh": write_zip({"b": b""}), "b.fbx": b"x"}), ["b.fbx", "a.bvh"]),
        (
            write_zip({"p/a.fbx": write_fbx(takes=("walk", "run")), "b.glb": write_glb(SOURCE), "c.bvh": b"x"}),
            ["b.glb", "c.bvh", "a.fbx/walk", "a.fbx/run"],
        ),
    ],
)
def test_each_listed_take_can_be_chosen(data: bytes, names: list[str]) -> None:
    assert list_takes(data, 100).names == names
    for name in names:
        try:
            title = type(read_motion(data, name)).__name__
        except UnreadableFile as error:
            title = error.title
        assert title != "No such take"


def test_list_of_takes_is_bounded() -> None:
    found = list_takes(write_zip({f"{number}.bvh": b"x" for number in range(9)}), 4)
    assert (found.names, found.count) == (["0.bvh", "1.bvh", "2.bvh", "3.bvh"], 9)


def test_animation_of_a_file_of_an_archive_is_chosen_by_both_names() -> None:
    packed = write_zip({"a.glb": write_glb(SOURCE, animations=("idle", "dance")), "b.bvh": bvh_clip()})
    assert any("'dance' was read" in note for note in read_motion(packed, "a.glb/dance").notes)
    assert any("'idle' was read" in note for note in read_motion(packed, "a.glb").notes)
    with pytest.raises(UnreadableFile, match="No such take"):
        read_motion(packed, "a.glb/jump")


@pytest.mark.parametrize(
    ("data", "title"),
    [
        (b"\x02\x50" + bytes(600), "Markers, not joints"),
        (b"#!OML:ASF x.asf\n:FULLY-SPECIFIED\n:DEGREES\n1\n", "Motion without skeleton"),
        (b"# AST/ASF file\n:version 1.10\n:name VICON\n", "Skeleton without motion"),
        (b"PK\x03\x04" + bytes(100), "Broken archive"),
        (b"glTF" + bytes(100), "Not a glTF 2 file"),
        (b"Kaydara FBX Binary  \0" + bytes(100), "Broken FBX file"),
        (b"; FBX 7.3.0 project file\n", "Broken FBX file"),
        (b'{"asset": {"version": "1.0"}}', "Not a glTF 2 file"),
        (b"", "Empty file"),
        (b"<?xml version='1.0'?>", "Not a BVH file"),
    ],
)
def test_other_files_are_refused_with_a_hint(data: bytes, title: str) -> None:
    with pytest.raises(UnreadableFile) as caught:
        read_motion(data)
    assert caught.value.title == title
    assert caught.value.hint
