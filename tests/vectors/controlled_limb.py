"""A limb that is claimed, controlled and released, frame by frame (`pulled.json`).

The motion is defined by a formula, to keep the file small: joint j has the rotation vector swing * sin(2 pi hertz t +
phase), component by component, with t in seconds.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from bunraku.marionette.controlled_limb import ControlledHand, ControlledLeg
from bunraku.marionette.handover import Handover
from bunraku.marionette.limb_rig import Limb
from bunraku.motion import rotation
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import JOINT_COUNT, standard_figure

FRAME_COUNT = 150
FRAME_S = 1.0 / 60.0
FRAME_STRIDE = 3


def swinging_poses(swing: Array, hertz: Array, phase: Array, frames: int) -> Array:
    """Return the rotations (frames, 18, 4) of the motion at 60 fps; the parameters are (18, 3) each."""
    t = (np.arange(frames) * FRAME_S)[:, None, None]
    return rotation.from_rotation_vector(swing * np.sin(2.0 * np.pi * hertz * t + phase))


def _limb_vector(limb: Limb, seed: int) -> dict[str, Any]:
    random = np.random.default_rng(seed)
    swing, hertz, phase = (
        np.round(random.uniform(low, high, (JOINT_COUNT, 3)), 3) for low, high in ((0.0, 0.5), (0.2, 1.2), (0.0, 6.2))
    )
    # target from a frame on, within and out of reach and behind the back; None after a release
    asked: list[list[Any]] = []
    for frame in (3, 15, 30, 31, 32, 50, 70):
        where = random.uniform(-0.8, 0.8, 3) if limb.is_hand else [random.uniform(-0.7, 2.0), 0.0, 0.0]
        asked.append([frame, [round(float(part), 4) for part in where]])
    asked += [[90, None], [108, asked[0][1]], [122, None]]
    controlled = ControlledHand(standard_figure(), limb) if limb.is_hand else ControlledLeg(standard_figure(), limb)
    handover = Handover()
    frames, target, is_taken = [], None, False
    for frame, pose in enumerate(swinging_poses(swing, hertz, phase, FRAME_COUNT).tolist()):
        for begin, where in asked:
            if begin == frame:
                target = tuple(where) if where is not None else None
                is_taken = is_taken or where is not None
        handover.advance(target is not None, FRAME_S)
        controlled.observe_pose(pose, FRAME_S)
        joints = controlled.solve_joints(pose, target, handover.weight, FRAME_S) if is_taken else None
        if joints is None and is_taken:
            controlled.reset()
            is_taken = False
        if frame % FRAME_STRIDE == 0:
            frames.append(None if joints is None else [list(joint) for joint in joints])
    return {
        "limb": int(limb),
        "swing": swing.tolist(),
        "hertz": hertz.tolist(),
        "phase": phase.tolist(),
        "asked": asked,
        "every": FRAME_STRIDE,
        "joints": frames,
    }


def make_vectors() -> dict[str, Any]:
    """Return the content of the file."""
    return {
        "seconds": FRAME_S,
        "frames": FRAME_COUNT,
        "cases": [_limb_vector(limb, 10 * seed + limb) for limb in Limb for seed in range(2 if limb.is_hand else 1)],
    }
