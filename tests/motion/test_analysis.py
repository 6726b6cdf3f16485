from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bunraku.motion import bvh, rotation
from bunraku.motion.analysis import Analysis, analyse
from bunraku.motion.errors import UnreadableMotion
from bunraku.motion.kinematics import pose
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import INDEX, JOINTS, Figure, Motion, points, world
from bunraku.motion.writers import write_bvh
from tests.motion.sources import bone_aligned, dance, pose_with_arms, straight_figure, told

CLIPS = {
    # clip: frames, worst mean and max fit in mm
    "cmu_12_01_walk": (523, 1.0, 7.0),
    "mass_cart": (286, 8.5, 55.0),
    "mass_dance": (381, 4.5, 50.0),
    "mass_walk": (132, 2.0, 12.0),
    "perfume_A": (1299, 10.5, 95.0),
    "perfume_C": (1299, 4.0, 50.0),
}


def assert_same(made: Motion, motion: Motion, within: float = 1e-5) -> None:
    np.testing.assert_allclose(made.figure.offsets, motion.figure.offsets, atol=within)
    np.testing.assert_allclose(made.figure.tips, motion.figure.tips, atol=within)
    np.testing.assert_allclose(made.root, motion.root, atol=within)
    assert np.abs(np.abs(np.sum(made.rotations * motion.rotations, axis=-1)) - 1.0).max() < within**1.5
    assert made.fps == motion.fps


@settings(max_examples=10, deadline=None)
@given(seed=st.integers(0, 10_000), swing=st.floats(0.0, 0.8))
def test_a_dance_written_read_and_analysed_is_the_same_dance(seed: int, swing: float) -> None:
    motion = dance(seed=seed, swing=swing)
    analysis = analyse(bvh.read(write_bvh(motion)))
    assert_same(analysis.motion, motion)
    assert analysis.profile == "H-Anim 1"
    assert analysis.fit_max < 0.01


@pytest.mark.parametrize(("degrees", "name"), [(90.0, "T"), (70.0, "T"), (45.0, "A"), (10.0, "I"), (0.0, "I")])
def test_rest_poses_are_told_and_turned_to_the_same_figure(degrees: float, name: str) -> None:
    motion = dance()
    analysis = analyse(bvh.read(told(motion, pose_with_arms(degrees))))
    assert analysis.rest == name
    assert_same(analysis.motion, motion)


@pytest.mark.parametrize(
    ("axes", "said"),
    [
        (rotation.about_axis(0, np.array(np.pi / 2)), "source's z axis is up"),
        (rotation.about_axis(1, np.array(np.pi / 2)), ""),
        (rotation.about_axis(1, np.array(np.pi)), ""),
        (rotation.about_axis(2, np.array(-np.pi / 2)), "source's x axis is up"),
        (rotation.about_axis(1, np.array(0.7)), ""),
    ],
)
def test_any_axes_are_turned_to_y_up_facing_z(axes: Array, said: str) -> None:
    motion = dance()
    analysis = analyse(bvh.read(told(motion, pose_with_arms(90.0), axes)))
    assert_same(analysis.motion, motion)
    assert any(said in sentence for sentence in analysis.guessed)


@pytest.mark.parametrize(
    ("per_metre", "unit"), [(1.0, "m"), (100.0, "cm"), (1000.0, "mm"), (1 / 0.0254, "inch"), (0.45 / 0.0254, "CMU")]
)
def test_units_are_told_from_the_leg(per_metre: float, unit: str) -> None:
    motion = dance()
    analysis = analyse(bvh.read(told(motion, per_metre=per_metre)))
    assert analysis.unit.startswith(unit)
    assert_same(analysis.motion, motion)


def test_a_size_no_unit_explains_is_scaled_and_said() -> None:
    analysis = analyse(bvh.read(told(dance(), per_metre=5.0)))
    assert analysis.unit == "unknown"
    offsets = analysis.motion.figure.offsets
    assert -offsets[INDEX["l_knee"], 1] - offsets[INDEX["l_ankle"], 1] == pytest.approx(0.82, abs=1e-6)
    assert any("fits no unit" in sentence for sentence in analysis.guessed)


@pytest.mark.parametrize("swing", [0.3, 0.6])
def test_bones_along_one_axis_give_the_same_joints(swing: float) -> None:
    motion = dance(swing=swing)
    analysis = analyse(bvh.read(told(motion, bone_aligned(motion.figure))))
    assert analysis.rest == "bone-aligned"
    made, expected = analysis.motion, world(motion.figure, motion.root, motion.rotations)[0]
    placed, _ = world(made.figure, made.root, made.rotations)
    np.testing.assert_allclose(placed, expected, atol=2e-4)
    # frame 1 of the dance is its rest, which stands straightest: the twist of every limb is found, too
    assert np.abs(np.sum(made.rotations * motion.rotations, axis=-1)).min() > 1.0 - 1e-5


def test_sides_named_wrongly_are_exchanged() -> None:
    motion = dance()
    swapped = tuple({"l_": "r_", "r_": "l_"}.get(name[:2], name[:2]) + name[2:] for name in JOINTS)
    analysis = analyse(bvh.read(told(motion, names=swapped)))
    assert analysis.mapped["l_knee"] == "r_knee"
    assert any("exchanged" in sentence for sentence in analysis.guessed)
    assert_same(analysis.motion, motion)


def test_elbows_bend_about_minus_x_and_knees_about_x() -> None:
    motion = dance(swing=0.0)
    motion.rotations[:, INDEX["l_elbow"]] = rotation.about_axis(0, np.full(motion.frames, -1.0))
    motion.rotations[:, INDEX["r_knee"]] = rotation.about_axis(0, np.full(motion.frames, 1.0))
    made = analyse(bvh.read(told(motion, pose_with_arms(90.0)))).motion
    placed, _ = world(made.figure, made.root, made.rotations)
    assert (placed[:, INDEX["l_wrist"], 2] > placed[:, INDEX["l_elbow"], 2] + 0.1).all()
    assert (placed[:, INDEX["r_ankle"], 2] < placed[:, INDEX["r_knee"], 2] - 0.1).all()
    assert_same(made, motion)


def test_a_dance_high_above_the_floor_is_moved_onto_it() -> None:
    motion = dance()
    high = replace(motion, root=motion.root + np.array([0.0, 3.0, 0.0]))
    analysis = analyse(bvh.read(told(high)))
    assert any("floor" in sentence for sentence in analysis.guessed)
    placed, _ = world(analysis.motion.figure, analysis.motion.root, analysis.motion.rotations)
    assert placed[..., 1].min() == pytest.approx(0.0, abs=1e-6)


def test_a_first_frame_apart_from_the_dance_is_left_out() -> None:
    motion = dance(swing=0.3)
    motion.rotations[0] = rotation.IDENTITY
    for name, angle in (("l_shoulder", 1.5), ("r_shoulder", -1.5)):
        motion.rotations[0, INDEX[name]] = rotation.about_axis(2, np.array(angle))
    analysis = analyse(bvh.read(told(motion)))
    assert analysis.motion.frames == motion.frames - 1
    assert any("first frame" in sentence for sentence in analysis.guessed)


def test_names_of_nobody_are_mapped_by_shape() -> None:
    motion = dance()
    analysis = analyse(bvh.read(told(motion, pose_with_arms(90.0), names=tuple(f"bone{k}" for k in range(18)))))
    assert analysis.profile == "shape"
    assert_same(analysis.motion, motion)


def test_what_is_no_body_is_refused() -> None:
    chain = b"HIERARCHY ROOT a { OFFSET 0 0 0 CHANNELS 3 Zrotation Xrotation Yrotation\n"
    chain += b"JOINT b { OFFSET 0 1 0 CHANNELS 0 } } MOTION Frames: 1 Frame Time: 0.1\n0 0 0\n"
    with pytest.raises(UnreadableMotion, match="two arms and two legs") as refusal:
        analyse(bvh.read(chain))
    assert refusal.value.line == 1


@pytest.fixture(params=sorted(CLIPS))
def clip(request: pytest.FixtureRequest, shared: Path) -> tuple[str, bvh.Bvh]:
    return request.param, bvh.read((shared / "mocap" / "bvh" / f"{request.param}.bvh").read_bytes())


def analysis_of(source: bvh.Bvh) -> Analysis:
    return analyse(source)


def test_real_clips_fit(clip: tuple[str, bvh.Bvh]) -> None:
    name, source = clip
    analysis = analysis_of(source)
    motion = analysis.motion
    frames, mean, worst = CLIPS[name]
    assert motion.frames == frames
    assert motion.fps == (40.0 if name.startswith("perfume") else 120.0)
    assert analysis.fit_mean < mean
    assert analysis.fit_max < worst
    assert set(JOINTS) - set(analysis.mapped) == {"sacroiliac"}
    assert analysis.rest == "T"
    offsets, tips = motion.figure.offsets, motion.figure.tips
    for side in "lr":
        for joint in ("elbow", "wrist", "knee", "ankle"):
            assert (offsets[INDEX[f"{side}_{joint}"], [0, 2]] == 0.0).all()
            assert -0.5 < offsets[INDEX[f"{side}_{joint}"], 1] < -0.1
        assert (tips[INDEX[f"{side}_wrist"], [0, 2]] == 0.0).all()
        assert offsets[INDEX[f"{side}_midtarsal"], 2] > 0.1
    assert offsets[INDEX["l_hip"], 0] > 0.05 > -0.05 > offsets[INDEX["r_hip"], 0]
    standing = points(motion.figure, offsets[0], np.tile(rotation.IDENTITY, (18, 1)))
    assert standing[:, 1].min() == pytest.approx(0.0, abs=1e-9)
    assert np.allclose(np.linalg.norm(motion.rotations, axis=-1), 1.0)
    assert -0.1 < world(motion.figure, motion.root, motion.rotations)[0][..., 1].min() < 0.15


def test_reported_fit_is_the_distance_from_the_source(clip: tuple[str, bvh.Bvh]) -> None:
    name, source = clip
    analysis = analysis_of(source)
    placed, _ = world(analysis.motion.figure, analysis.motion.root, analysis.motion.rotations)
    scale = {"cm": 0.01, "CM": 0.0254 / 0.45}[analysis.unit[:2]]
    position, _ = pose(source, list(range(len(source.names))))
    position = scale * position[len(position) - len(placed) :]
    apart = [
        1000.0 * np.linalg.norm(placed[:, INDEX[joint]] - position[:, source.names.index(of)], axis=-1)
        for joint, of in analysis.mapped.items()
    ]
    assert np.mean(apart) == pytest.approx(analysis.fit_mean, rel=1e-6), name
    assert np.max(apart) == pytest.approx(analysis.fit_max, rel=1e-6)


def test_real_clips_are_near_what_the_study_made_of_them(clip: tuple[str, bvh.Bvh], shared: Path) -> None:
    name, source = clip
    analysis = analysis_of(source)
    study = np.load(shared / "mocap" / "hanim19" / f"{name}.npz")
    offsets = study["off"].astype(float)
    figure = Figure(offsets, study["tip"].astype(float))
    theirs, _ = world(figure, study["root"].astype(float), study["Q"].astype(float))
    ours, _ = world(analysis.motion.figure, analysis.motion.root, analysis.motion.rotations)
    theirs *= _leg(analysis.motion.figure.offsets) / _leg(offsets)
    legs = [INDEX[f"{side}_{joint}"] for side in "lr" for joint in ("hip", "knee", "ankle", "midtarsal")]
    # legs are rigid chains in every clip: both must be where the source is
    np.testing.assert_allclose(ours[:, legs], theirs[:, legs], atol=2e-3)
    apart = np.linalg.norm(ours - theirs, axis=-1)
    apart[:, INDEX["vl5"]] = 0.0  # the study took the first spine joint, analysis the one that fits best
    assert apart.mean() < 0.025


def _leg(offsets: Array) -> float:
    joints = [INDEX[f"{side}_{joint}"] for side in "lr" for joint in ("knee", "ankle")]
    return float(np.linalg.norm(offsets[joints], axis=-1).sum() / 2.0)


def test_straight_figure_is_what_tests_think() -> None:
    figure = straight_figure()
    assert points(figure, figure.offsets[0], np.tile(rotation.IDENTITY, (18, 1)))[:, 1].min() == pytest.approx(0.0)
