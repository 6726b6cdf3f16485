from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bunraku.capture.calibration import MAX_CALIBRATION_FRAMES, calibrate
from bunraku.capture.errors import UnreadableCapture
from bunraku.capture.frame import MAX_COORDINATE, CapturedFrame, CaptureSkeleton
from bunraku.capture.mvn import MvnAssembler
from bunraku.capture.retarget import Retargeter
from bunraku.capture.vmc import VmcAssembler
from bunraku.marionette.solver.vector import IDENTITY, scale
from bunraku.motion import rotation
from tests.capture.samples import sample_analysis, sample_frames

SKELETON = VmcAssembler.skeleton


def test_figure_has_the_lengths_of_the_clip() -> None:
    calibration = calibrate(SKELETON, sample_frames())
    expected = sample_analysis().motion.figure.offsets
    lengths = np.linalg.norm(calibration.figure.offsets, axis=-1)
    limbs = [3, 4, 7, 8, 13, 14, 16, 17]
    np.testing.assert_allclose(lengths[limbs], np.linalg.norm(expected, axis=-1)[limbs], atol=1e-3)
    assert calibration.fit.rest.pose == "T"
    assert any("unit" in sentence for sentence in calibration.assumptions)


@pytest.mark.parametrize("factor", [100.0, 1000.0])
def test_unit_of_the_sender_is_detected(factor: float) -> None:
    larger = [
        CapturedFrame({bone: scale(place, factor) for bone, place in frame.positions.items()}, frame.rotations)
        for frame in sample_frames()
    ]
    figure = calibrate(SKELETON, larger).figure
    np.testing.assert_allclose(figure.offsets, calibrate(SKELETON, sample_frames()).figure.offsets, atol=1e-6)


def test_joints_may_be_missing_in_any_frames() -> None:
    chance = np.random.default_rng(1)
    thinned = []
    for frame in sample_frames():
        kept = {bone for bone in frame.rotations if chance.random() < 0.7}
        thinned.append(
            CapturedFrame(
                {bone: place for bone, place in frame.positions.items() if bone in kept},
                {bone: turn for bone, turn in frame.rotations.items() if bone in kept},
            )
        )
    figure = calibrate(SKELETON, thinned).figure
    expected = calibrate(SKELETON, sample_frames()).figure
    np.testing.assert_allclose(figure.offsets, expected.offsets, atol=0.02)


def test_many_frames_are_sampled() -> None:
    calibration = calibrate(SKELETON, sample_frames() * 10)
    assert len(calibration.fit.fit.position) <= MAX_CALIBRATION_FRAMES


def test_frames_of_no_body_are_rejected() -> None:
    frame = sample_frames()[0]
    legless = {bone: turn for bone, turn in frame.rotations.items() if "Leg" not in bone}
    collapsed = dict.fromkeys(frame.positions, (0.0, 0.0, 0.0))
    headless_tree = {bone: turn for bone, turn in frame.rotations.items() if bone not in ("Hips", "Root")}
    for positions, rotations, problem in (
        ({}, {}, "No joints"),
        (frame.positions, {"Hips": IDENTITY}, "humanoid"),
        (frame.positions, legless, "humanoid"),
        (frame.positions, headless_tree, "Separate joints"),
        (collapsed, frame.rotations, "Not a body|Not a humanoid|A leg without length"),
    ):
        with pytest.raises(UnreadableCapture, match=problem):
            calibrate(SKELETON, [CapturedFrame(positions, rotations)])
    with pytest.raises(UnreadableCapture, match="No frames"):
        calibrate(SKELETON, [])


@settings(max_examples=80)
@given(
    seed=st.integers(0, 1 << 30),
    size=st.floats(-9.0, 5.0),
    kept=st.floats(0.3, 1.0),
    moving=st.booleans(),
    skeleton=st.sampled_from([VmcAssembler.skeleton, MvnAssembler.skeleton]),
)
def test_any_frames_give_finite_poses_or_are_rejected(
    seed: int, size: float, kept: float, moving: bool, skeleton: CaptureSkeleton
) -> None:
    chance = np.random.default_rng(seed)
    joints = [joint for joint in skeleton.parents if chance.random() < kept]
    frames = []
    for _ in range(5):
        places = (10.0**size * chance.normal(size=(len(joints), 3))).clip(-MAX_COORDINATE, MAX_COORDINATE)
        turns = rotation.normalise(chance.normal(size=(len(joints), 4)) + (0.0 if moving else [9.0, 0.0, 0.0, 0.0]))
        frames.append(
            CapturedFrame(
                {joint: (x, y, z) for joint, (x, y, z) in zip(joints, places.tolist(), strict=True)},
                {joint: (w, x, y, z) for joint, (w, x, y, z) in zip(joints, turns.tolist(), strict=True)},
            )
        )
    try:
        retargeter = Retargeter(calibrate(skeleton, frames))
    except UnreadableCapture:
        return
    for frame in frames:
        pose = retargeter.retarget(frame)
        assert np.isfinite(pose.root).all()
        np.testing.assert_allclose(np.linalg.norm(pose.rotations, axis=-1), 1.0, atol=1e-9)
