"""The figure's trunk: root, sacroiliac, vl5 and skullbase."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bunraku.motion import procrustes, rotation
from bunraku.motion.fitting import Fit
from bunraku.motion.kinematics import chain
from bunraku.motion.limbs import aimed
from bunraku.motion.naming import common_ancestor
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import INDEX

CROWN = 0.20
"""Metres from skullbase to the crown: where error is measured."""
NECK = 0.12
"""Metres from between the shoulders to the skullbase of a source that has no head."""
WEIGHTS: Array = np.array([1.0, 2.0, 2.0])
"""Skullbase and shoulders: a shoulder carries an arm."""
GAIN = 1e-4
"""Metres by which a way that is less plain must be better to be taken."""
SAMPLES = 200

HIPS = ("l_hip", "r_hip")
SHOULDERS = ("l_shoulder", "r_shoulder")


def place_trunk(fit: Fit) -> None:
    """Place root, sacroiliac, vl5 and skullbase, and say where hips and shoulders hang from them."""
    root = fit.joints[0]
    fit.placed[:, 0], fit.oriented[:, 0] = fit.position[:, root], fit.turn[:, root]
    _pelvis(fit)
    _chest(fit)
    _head(fit)


def _pelvis(fit: Fit) -> None:
    """sacroiliac: the source's, else at the root; where the hips move in it, turned as their line turns."""
    pelvis = INDEX["sacroiliac"]
    source = fit.joints.get(pelvis)
    if source is None:
        fit.place(pelvis, np.zeros(3), fit.oriented[:, 0])
    else:
        fit.place(pelvis, fit.mean_place(0, source), fit.turn[:, source])
    hips = fit.relative(pelvis, [fit.joints[INDEX[name]] for name in HIPS])
    places = procrustes.mean_places(fit.oriented[:, pelvis], hips)
    if procrustes.misfit(fit.oriented[:, pelvis], places, hips, np.ones(2)) > GAIN:
        fit.oriented[:, pelvis] = aimed(fit.oriented[:, pelvis], places[0] - places[1], hips[:, 1], hips[:, 0])
        places = procrustes.mean_places(fit.oriented[:, pelvis], hips)
    for name, place in zip(HIPS, places, strict=True):
        fit.offsets[INDEX[name]] = place


@dataclass(frozen=True, slots=True)
class _Choice:
    """vl5 at the source joint `source`, turned as `turned` (None: solved), with its points at `places` (m, 3)."""

    error: float
    source: int
    turned: int | None
    places: Array


def _chest(fit: Fit) -> None:
    """vl5: the place in the source's spine, and the turn (one of its joints' or the solved one), that fit best."""
    vl5 = INDEX["vl5"]
    carried = [INDEX[name] for name in ("skullbase", *SHOULDERS) if INDEX[name] in fit.joints]
    sources = [fit.joints[joint] for joint in carried]
    weights = WEIGHTS[-len(carried) :]
    root = fit.joints[0]
    above = chain(fit.bvh, root)
    way = chain(fit.bvh, common_ancestor(fit.bvh.parents, [fit.joints[INDEX[name]] for name in SHOULDERS]))
    spine = [joint for joint in reversed(way) if joint not in above] or [root]
    chosen = _best_chest(fit, spine, sources, weights)
    if chosen.source != root:
        fit.joints[vl5] = chosen.source
    fit.place(vl5, fit.mean_place(0, chosen.source), fit.turn[:, spine[-1] if chosen.turned is None else chosen.turned])
    targets = fit.relative(vl5, sources)
    if chosen.turned is None:
        fit.oriented[:, vl5] = procrustes.kabsch(chosen.places, targets, weights)
    for joint, place in zip(carried, procrustes.mean_places(fit.oriented[:, vl5], targets), strict=True):
        fit.offsets[joint] = place


def _best_chest(fit: Fit, spine: list[int], sources: list[int], weights: Array) -> _Choice:
    """Try every place and turn on a sample of frames; the first of equals is kept."""
    few = np.unique(np.linspace(0, len(fit.position) - 1, SAMPLES).astype(np.int64))
    choices: list[_Choice] = []
    for source in spine:
        placed = fit.placed[few, 0] + rotation.rotate(fit.oriented[few, 0], fit.mean_place(0, source))
        own = float(np.sqrt(np.mean(np.sum((placed - fit.position[few, source]) ** 2, axis=-1))))
        targets = fit.position[few][:, sources] - placed[:, None]
        for turned in (*spine, None):
            if turned is None:
                rested = fit.rested[sources] - fit.rested[source]
                places = procrustes.fitted_places(fit.turn[few, spine[-1]], targets, weights, rested)
                orientation = procrustes.kabsch(places, targets, weights)
            else:
                orientation = fit.turn[few, turned]
                places = procrustes.mean_places(orientation, targets)
            error = procrustes.misfit(orientation, places, targets, weights) + own / weights.sum()
            choices.append(_Choice(error, source, turned, places))
    least = min(choice.error for choice in choices)
    return next(choice for choice in choices if choice.error <= least + GAIN)


def _head(fit: Fit) -> None:
    head, vl5 = INDEX["skullbase"], INDEX["vl5"]
    source = fit.joints.get(head)
    if source is None:
        middle = fit.offsets[[INDEX[name] for name in SHOULDERS]].mean(axis=0)
        fit.place(head, middle + np.array([0.0, NECK, 0.0]), fit.oriented[:, vl5])
    else:
        fit.place(head, fit.offsets[head], fit.turn[:, source])
    fit.tips[head] = (0.0, CROWN, 0.0)
