"""A folder of motion clips as 19 channels: `hanim19/*.npz`, with `CORPUS.csv` saying where each is from."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np

from bunraku.motion import rotation
from bunraku.motion.skeleton import JOINTS, Figure, Motion

_UNKNOWN_ORIGIN = "origin not stated"


def list_clips(corpus: Path) -> list[str]:
    """The clips of the folder; raises FileNotFoundError where there are none."""
    found = sorted(path.stem for path in (corpus / "hanim19").glob("*.npz"))
    if not found:
        raise FileNotFoundError(f"no clips in {corpus / 'hanim19'}")
    return found


def load_clip(corpus: Path, name: str) -> Motion:
    """One clip; metres, y up."""
    with np.load(corpus / "hanim19" / f"{name}.npz") as clip:
        figure = Figure(clip["off"].astype(np.float64), clip["tip"].astype(np.float64))
        rotations = rotation.normalise(clip["Q"].astype(np.float64))
        return Motion(figure, float(clip["fps"]), clip["root"].astype(np.float64), rotations)


def clip_family(name: str) -> str:
    """Clips that could share dancers, stages or tools; figures are told with priors that saw none of a clip's
    family."""
    for family in ("perfume", "isaac", "mass"):
        if name.startswith(family):
            return family
    return "cmu"


def licensed_clips(corpus: Path) -> set[str]:
    """The clips that may be learned from: with a licence stated for the motion itself."""
    with (corpus / "CORPUS.csv").open(encoding="utf-8", newline="") as rows:
        return {
            row["clip"]
            for row in csv.DictReader(rows)
            if row["licence_as_stated"] and _UNKNOWN_ORIGIN not in row["licence_as_stated"]
        }


def mirror_motion(motion: Motion) -> Motion:
    """The same dance with left and right exchanged."""
    twin = [JOINTS.index({"l_": "r_", "r_": "l_"}.get(n[:2], n[:2]) + n[2:]) for n in JOINTS]
    flip = np.array([-1.0, 1.0, 1.0])
    figure = Figure(motion.figure.offsets[twin] * flip, motion.figure.tips[twin] * flip)
    return Motion(figure, motion.fps, motion.root * flip, motion.rotations[:, twin] * [1.0, 1.0, -1.0, -1.0])
