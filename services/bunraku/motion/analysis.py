"""From a recorded skeleton to the paper's 19 channels (paper 2): one figure, one motion, and how well they fit."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bunraku.motion import rotation
from bunraku.motion.bvh import Bvh
from bunraku.motion.fitting import Fit
from bunraku.motion.kinematics import pose
from bunraku.motion.limbs import place_arm, place_leg
from bunraku.motion.naming import by_name, common_ancestor
from bunraku.motion.rest import find_rest, sample, sides
from bunraku.motion.shape import by_shape, find_head
from bunraku.motion.skeleton import JOINT_COUNT, JOINTS, PARENTS, Figure, Motion, points, world
from bunraku.motion.trunk import place_trunk

FLOOR_ERROR = 0.5
"""The height is left alone while the lowest point of the feet is within this of the floor, metres."""
APART = (0.05, 4.0)
"""A first frame is no part of the dance if its joints are, on average, this many metres from the second and this many
times the largest step after."""


@dataclass(frozen=True, slots=True)
class Analysis:
    """What was made of a source.

    `motion` is the dance at the source's frame rate; `profile` says whose names the joints have ("shape": nobody's);
    `mapped` is H-Anim joint -> source joint; `rest` the source's rest pose ("T", "A", "I", "bone-aligned", "other");
    `unit` its unit of length; `guessed` sentences for the person who sent it. `fit_mean` and `fit_max` are the
    distances of the figure's joints from the source's, over all mapped joints and frames, in millimetres.
    """

    motion: Motion
    profile: str
    mapped: dict[str, str]
    rest: str
    unit: str
    guessed: list[str]
    fit_mean: float
    fit_max: float


def analyse(bvh: Bvh) -> Analysis:
    """The 19 channels of `bvh` for a figure with its limb lengths.

    The figure is at rest in H-Anim's I-pose, facing z, y up; elbows, wrists, knees, ankles and finger tips lie straight
    below the joint before, so that an elbow bends about -x and a knee about x. Raises `UnreadableMotion` where the
    skeleton is no humanoid.
    """
    naming = by_name(bvh.names, bvh.parents) or by_shape(bvh)
    guessed = [*bvh.notes, *naming.guessed]
    frames = sample(bvh)
    position, orientation = pose(bvh, list(range(len(bvh.names))), frames)
    joints, exchanged = sides(position, naming.joints)
    guessed += exchanged
    joints = _completed(bvh, joints, guessed)
    rest = find_rest(bvh, joints, frames, position, orientation)
    guessed += rest.guessed
    fit = Fit.begin(bvh, joints, rest)
    if _first_is_apart(fit):
        guessed.append("The first frame is a pose apart from the dance; it was left out.")
        fit = fit.without_first()
    _move_to_floor(fit, guessed)
    place_trunk(fit)
    for side in "lr":
        place_leg(fit, side)
        place_arm(fit, side)
    motion = _motion(fit, bvh.fps)
    placed, _ = world(motion.figure, motion.root, motion.rotations)
    mapped = sorted(fit.joints)
    apart = 1000.0 * np.linalg.norm(placed[:, mapped] - fit.position[:, [fit.joints[j] for j in mapped]], axis=-1)
    return Analysis(
        motion=motion,
        profile=naming.profile,
        mapped={JOINTS[joint]: bvh.names[fit.joints[joint]] for joint in mapped},
        rest=rest.pose,
        unit=rest.unit,
        guessed=guessed,
        fit_mean=float(apart.mean()),
        fit_max=float(apart.max()),
    )


def _completed(bvh: Bvh, joints: dict[str, int], guessed: list[str]) -> dict[str, int]:
    """The mapping with root and head, where names or shape left them open.

    The root is where legs and trunk part, whatever it is called: files have a joint on the floor above it, or a
    pelvis below it that carries the legs only, which is then the sacroiliac.
    """
    joints = dict(joints)
    hips = [joints["l_hip"], joints["r_hip"]]
    if "skullbase" not in joints and (head := find_head(bvh, joints)) is not None:
        joints["skullbase"] = head
        guessed.append(f"No joint is named as the head; {bvh.names[head]} was taken for it.")
    root = common_ancestor(bvh.parents, [*hips, joints["l_shoulder"], joints["r_shoulder"]])
    pelvis = common_ancestor(bvh.parents, hips)
    joints["humanoid_root"] = root
    for name in ("sacroiliac", "vl5"):
        joints.pop(name, None)
    if pelvis != root:
        joints["sacroiliac"] = pelvis
    missing = [name for name in JOINTS if name not in joints and name not in ("sacroiliac", "vl5")]
    if missing:
        guessed.append(f"The source has no {', '.join(missing)}; they keep a fixed place.")
    return joints


def _first_is_apart(fit: Fit) -> bool:
    """Whether the first frame is a pose to calibrate by, set before a dance that is smooth without it."""
    if len(fit.position) < 4:
        return False
    local = fit.position[:, list(fit.joints.values())] - fit.position[:, [fit.joints[0]]]
    step = np.linalg.norm(np.diff(local, axis=0), axis=-1).mean(axis=-1)
    return bool(step[0] > APART[0] and step[0] > APART[1] * step[1:].max())


def _move_to_floor(fit: Fit, guessed: list[str]) -> None:
    feet = [source for joint, source in fit.joints.items() if JOINTS[joint][2:] in ("ankle", "midtarsal")]
    lowest = float(fit.position[:, feet or list(fit.joints.values()), 1].min())
    if abs(lowest) > FLOOR_ERROR:
        guessed.append(f"The lowest point of the feet was {lowest:.2f} m from the floor; the dance was moved onto it.")
        fit.position[..., 1] -= lowest


def _motion(fit: Fit, fps: float) -> Motion:
    """The figure's channels; at rest its lowest point is on the floor."""
    rotations = fit.oriented.copy()
    parents = fit.oriented[:, PARENTS[1:]]
    rotations[:, 1:] = rotation.multiply(rotation.conjugate(parents), fit.oriented[:, 1:])
    still = np.tile(rotation.IDENTITY, (JOINT_COUNT, 1))
    offsets = fit.offsets.copy()
    offsets[0] = 0.0
    offsets[0, 1] = -points(Figure(offsets, fit.tips), np.zeros(3), still)[:, 1].min()
    return Motion(Figure(offsets, fit.tips), fps, fit.placed[:, 0].copy(), rotation.normalise(rotations))
