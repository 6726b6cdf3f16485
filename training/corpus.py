"""Corpus of motion clips: `hanim19/*.npz`, and `CORPUS.csv` with the origin and licence of each."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np

from bunraku.motion import rotation
from bunraku.motion.skeleton import JOINTS, Figure, Motion

_UNKNOWN_ORIGIN = "origin not stated"


def list_clips(corpus: Path) -> list[str]:
    """Return the names of all clips. Raises FileNotFoundError if there are none."""
    names = sorted(path.stem for path in (corpus / "hanim19").glob("*.npz"))
    if not names:
        raise FileNotFoundError(f"No clips in {corpus / 'hanim19'}. Name the folder that contains hanim19/*.npz.")
    return names


def load_clip(corpus: Path, name: str) -> Motion:
    """Return one clip in metres, y up."""
    with np.load(corpus / "hanim19" / f"{name}.npz") as clip:
        figure = Figure(clip["off"].astype(np.float64), clip["tip"].astype(np.float64))
        rotations = rotation.normalise(clip["Q"].astype(np.float64))
        return Motion(figure, float(clip["fps"]), clip["root"].astype(np.float64), rotations)


def clip_family(name: str) -> str:
    """Return the family of a clip: clips that may share dancers, stages or tools.

    Benchmarks use a prior that was trained without the family of the clip.
    """
    for family in ("perfume", "isaac", "mass"):
        if name.startswith(family):
            return family
    return "cmu"


def licensed_clips(corpus: Path) -> set[str]:
    """Return the clips that may be used for training: those with a licence stated for the motion itself."""
    with (corpus / "CORPUS.csv").open(encoding="utf-8", newline="") as rows:
        return {
            row["clip"]
            for row in csv.DictReader(rows)
            if row["licence_as_stated"] and _UNKNOWN_ORIGIN not in row["licence_as_stated"]
        }


def read_performers(corpus: Path) -> dict[str, list[str]]:
    """Return the licensed clips of each family of performers, as `CORPUS.csv` names them in its column `family`."""
    licensed = licensed_clips(corpus)
    families: dict[str, list[str]] = {}
    with (corpus / "CORPUS.csv").open(encoding="utf-8", newline="") as rows:
        for row in csv.DictReader(rows):
            if row["clip"] in licensed:
                families.setdefault(row["family"], []).append(row["clip"])
    return families


def reduce_frame_rate(motion: Motion, factor: int) -> Motion:
    """Return every `factor`-th frame of the motion."""
    return Motion(motion.figure, motion.fps / factor, motion.root[::factor], motion.rotations[::factor])


def mirror_motion(motion: Motion) -> Motion:
    """Return the motion with left and right exchanged."""
    mirror = [JOINTS.index({"l_": "r_", "r_": "l_"}.get(n[:2], n[:2]) + n[2:]) for n in JOINTS]
    flip = np.array([-1.0, 1.0, 1.0])
    figure = Figure(motion.figure.offsets[mirror] * flip, motion.figure.tips[mirror] * flip)
    return Motion(figure, motion.fps, motion.root * flip, motion.rotations[:, mirror] * [1.0, 1.0, -1.0, -1.0])
