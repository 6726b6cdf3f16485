"""Golden vectors of the marionette: `python -m tests.vectors.arm` rewrites `proto/vectors/arm.json`.

Both languages are judged by them: numbers to 1e-9. Tables are base64 of the served bytes.
"""

from __future__ import annotations

import base64
import hashlib
import json
from pathlib import Path
from typing import Any

import numpy as np

from bunraku.marionette import arms, table
from bunraku.marionette.limbs import ArmRig, LegRig, Limb
from bunraku.marionette.proportions import Proportions
from bunraku.motion import rotation
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import standard_figure

FILE = Path(__file__).resolve().parents[2] / "proto" / "vectors" / "arm.json"
IDENTITIES = ("3963-3523-2514-5316-3440-1244", "400-400-200-334-333-333", "300-300-400-560-320-120")
AWKWARD = [
    [0.0, -0.7, 0.0],
    [0.0, 0.7, 0.0],
    [0.0, 0.0, 0.0],
    [0.0, 0.0, 1.0],
    [2.0, 0.0, 0.0],
    [0.01, 0.0, -0.01],
    [-0.3, -1.4, -0.2],
    [0.0, 0.0, -0.6],
]
"""Straight below and above, at the shoulder, straight ahead, out of reach, too near, behind."""


def _numbers(values: Any) -> Any:
    return np.round(np.asarray(values, dtype=np.float64), 12).tolist()


def _solves(identity: str, random: np.random.Generator) -> dict[str, Any]:
    proportions = Proportions.parse(identity)
    stored = table.build_table(proportions)
    data = table.to_bytes(stored)
    targets = np.round(np.concatenate([np.array(AWKWARD), random.uniform(-0.6, 0.6, (14, 3))]), 6)
    solved = arms.solve(proportions, stored, targets)
    return {
        "proportions": identity,
        "inner_radius": _numbers(proportions.inner_radius),
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
                _numbers(solved.azimuth),
                _numbers(np.stack(solved.angles(), axis=-1)),
                _numbers(solved.elbow),
                _numbers(solved.wrist),
                _numbers(solved.tip),
                strict=True,
            )
        ],
    }


def _identities(random: np.random.Generator) -> list[dict[str, Any]]:
    """What arms of these lengths, with and without masses of their own, are known by."""
    cases: list[dict[str, Any]] = []
    for nth in range(24):
        a, b, c = np.round(random.uniform([0.2, 0.2, 0.1], [0.4, 0.35, 0.25]) * (1.0 if nth % 3 else 100.0), 6).tolist()
        d, e, f = np.round(random.uniform(0.3, 3.0, 3), 6).tolist()
        own = nth % 2 == 1
        made = Proportions.of((a, b, c), (d, e, f) if own else None)
        cases.append({"lengths": [a, b, c], "masses": [d, e, f] if own else None, "identity": made.identity})
    return cases


def _poses(random: np.random.Generator) -> Array:
    """Four poses of random joints (4, 18, 4), the last the rest."""
    vectors = random.uniform(-0.6, 0.6, (4, 18, 3))
    vectors[3] = 0.0
    return rotation.from_rotation_vector(vectors)


def _limbs(random: np.random.Generator) -> dict[str, Any]:
    figure = standard_figure()
    cases = []
    for pose in _poses(random):
        rows = pose.tolist()
        for limb in Limb:
            case: dict[str, Any] = {"limb": int(limb), "rotations": _numbers(pose)}
            if limb.is_hand:
                rig = ArmRig(figure, limb)
                target = np.round(random.uniform(-0.55, 0.55, 3), 6).tolist()
                x, y, z = target
                own = rig.target(rig.dance(rows))
                case |= {"target": target, "own": _numbers(own), "joints": _numbers(rig.hang((x, y, z), rig.up(rows)))}
            else:
                leg = LegRig(figure, limb)
                theta = round(float(random.uniform(-0.7, 2.0)), 6)
                case |= {"angle": theta, "own": _numbers(leg.angle(rows)), "joints": _numbers(leg.hang(theta, rows))}
            cases.append(case)
    return {"offsets": _numbers(figure.offsets), "tips": _numbers(figure.tips), "cases": cases}


def make() -> dict[str, Any]:
    """All vectors, as the file has them."""
    random = np.random.default_rng(20)
    return {
        "arms": [_solves(identity, random) for identity in IDENTITIES],
        "limbs": _limbs(random),
        "identities": _identities(random),
    }


def write() -> None:
    """Write the file anew."""
    FILE.parent.mkdir(parents=True, exist_ok=True)
    FILE.write_text(json.dumps(make(), indent=None, separators=(",", ":")).replace('{"', '\n{"') + "\n")


if __name__ == "__main__":
    write()
