"""Arm tables, solved arms and legs, and table names (`arm.json`). Tables are base64 of the served bytes."""

from __future__ import annotations

import base64
import hashlib
import json
from pathlib import Path
from typing import Any

import numpy as np

from bunraku.marionette import arm_batch, bend_table
from bunraku.marionette.limb_rig import ArmRig, LegRig, Limb
from bunraku.marionette.proportions import Proportions
from bunraku.motion import rotation
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import standard_figure

VECTORS_FILE = Path(__file__).resolve().parents[2] / "proto" / "vectors" / "arm.json"
IDENTITIES = ("3963-3523-2514-5316-3440-1244", "400-400-200-334-333-333", "300-300-400-560-320-120")
EDGE_CASE_TARGETS = [
    [0.0, -0.7, 0.0],
    [0.0, 0.7, 0.0],
    [0.0, 0.0, 0.0],
    [0.0, 0.0, 1.0],
    [2.0, 0.0, 0.0],
    [0.01, 0.0, -0.01],
    [-0.3, -1.4, -0.2],
    [0.0, 0.0, -0.6],
]
"""Below, above, at the shoulder, ahead, out of reach, too near, and behind."""


def _rounded_list(values: Any) -> Any:
    return np.round(np.asarray(values, dtype=np.float64), 12).tolist()


def _arm_vectors(identity: str, random: np.random.Generator) -> dict[str, Any]:
    proportions = Proportions.parse(identity)
    stored = bend_table.build_bend_table(proportions)
    data = bend_table.pack_bend_table(stored)
    targets = np.round(np.concatenate([np.array(EDGE_CASE_TARGETS), random.uniform(-0.6, 0.6, (14, 3))]), 6)
    solved = arm_batch.solve_arms(proportions, stored, targets)
    return {
        "proportions": identity,
        "inner_radius": _rounded_list(proportions.min_tip_distance),
        "sha256": hashlib.sha256(data).hexdigest(),
        "table": base64.b64encode(data).decode(),
        "solves": [
            {
                "target": target,
                "azimuth": azimuth,
                "angles": angles,
                "elbow": elbow,
                "wrist": wrist,
                "tip": tip,
            }
            for target, azimuth, angles, elbow, wrist, tip in zip(
                targets.tolist(),
                _rounded_list(solved.azimuth),
                _rounded_list(np.stack(solved.angles(), axis=-1)),
                _rounded_list(solved.elbow),
                _rounded_list(solved.wrist),
                _rounded_list(solved.tip),
                strict=True,
            )
        ],
    }


def _identity_vectors(random: np.random.Generator) -> list[dict[str, Any]]:
    """Return the table names of arms of random lengths, with and without masses."""
    cases: list[dict[str, Any]] = []
    for nth in range(24):
        a, b, c = np.round(random.uniform([0.2, 0.2, 0.1], [0.4, 0.35, 0.25]) * (1.0 if nth % 3 else 100.0), 6).tolist()
        d, e, f = np.round(random.uniform(0.3, 3.0, 3), 6).tolist()
        own = nth % 2 == 1
        made = Proportions.from_links((a, b, c), (d, e, f) if own else None)
        cases.append({"lengths": [a, b, c], "masses": [d, e, f] if own else None, "identity": made.identity})
    return cases


def _random_poses(random: np.random.Generator) -> Array:
    """Return four poses (4, 18, 4) of random joints, the last at rest."""
    vectors = random.uniform(-0.6, 0.6, (4, 18, 3))
    vectors[3] = 0.0
    return rotation.from_rotation_vector(vectors)


def _limb_vectors(random: np.random.Generator) -> dict[str, Any]:
    figure = standard_figure()
    cases = []
    for pose in _random_poses(random):
        rows = pose.tolist()
        for limb in Limb:
            case: dict[str, Any] = {"limb": int(limb), "rotations": _rounded_list(pose)}
            if limb.is_hand:
                rig = ArmRig(figure, limb)
                target = np.round(random.uniform(-0.55, 0.55, 3), 6).tolist()
                x, y, z = target
                own = rig.tip_target(rig.pose_joints(rows))
                case |= {
                    "target": target,
                    "own": _rounded_list(own),
                    "joints": _rounded_list(rig.solve((x, y, z), rig.local_up(rows))),
                }
            else:
                leg = LegRig(figure, limb)
                theta = round(float(random.uniform(-0.7, 2.0)), 6)
                case |= {
                    "angle": theta,
                    "own": _rounded_list(leg.thigh_angle(rows)),
                    "joints": _rounded_list(leg.solve(theta, rows)),
                }
            cases.append(case)
    return {"offsets": _rounded_list(figure.offsets), "tips": _rounded_list(figure.tips), "cases": cases}


def make_vectors() -> dict[str, Any]:
    """Return the content of the file."""
    random = np.random.default_rng(20)
    return {
        "arms": [_arm_vectors(identity, random) for identity in IDENTITIES],
        "limbs": _limb_vectors(random),
        "identities": _identity_vectors(random),
    }


def write_vectors() -> None:
    """Write the file."""
    VECTORS_FILE.parent.mkdir(parents=True, exist_ok=True)
    VECTORS_FILE.write_text(json.dumps(make_vectors(), indent=None, separators=(",", ":")).replace('{"', '\n{"') + "\n")


if __name__ == "__main__":
    write_vectors()
