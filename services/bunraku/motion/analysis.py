"""From a recorded skeleton to the paper's 19 channels (paper 2): one figure, one motion, and how well they fit."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from bunraku.motion import limbs, rotation, trunk
from bunraku.motion.bvh import Bvh
from bunraku.motion.kinematics import chain, pose
from bunraku.motion.naming import Naming, by_name, common_ancestor
from bunraku.motion.rest import Rest, find_rest, sample, sides
from bunraku.motion.rotation import Array
from bunraku.motion.shape import by_shape, find_head
from bunraku.motion.skeleton import INDEX, JOINT_COUNT, JOINTS, PARENTS, Figure, Motion, points, standard_figure, world

CROWN, HAND, TOES = 0.20, 0.18, 0.07
"""Metres beyond skullbase, wrist and midtarsal: where error is measured (design, the codec)."""
HAND_LENGTHS = (0.10, 0.26)
"""A source's own hand is believed within these, metres."""
FLOOR_ERROR = 0.5
"""The height is left alone while the lowest point of the clip is within this of the floor, metres."""
CHEST_WEIGHTS: Array = np.array([1.0, 2.0, 2.0])
"""Skullbase and shoulders: a shoulder carries an arm."""
CHEST_GAIN = 1e-4
"""Metres a solved chest must be better by to be taken before a joint of the source."""


@dataclass(frozen=True, slots=True)
class Analysis:
    """What was made of a source.

    `motion` is the dance at the source's frame rate; `profile` whose names the joints have ("shape" if none's);
    `mapped` H-Anim joint -> source joint; `rest` the source's rest pose; `guessed` sentences for the person who sent
    it. `fit_mean` and `fit_max` are the distances of the figure's joints from the source's, over all mapped joints
    and frames, in millimetres.
    """

    motion: Motion
    profile: str
    mapped: dict[str, str]
    rest: str
    unit: str
    guessed: list[str]
    fit_mean: float
    fit_max: float


@dataclass(slots=True)
class _Fit:
    """The work in hand: the source in the figure's axes and metres, and the figure so far.

    `joints` H-Anim index -> source index; `position` (n, J, 3) and `turn` (n, J, 4), each source joint's rotation from
    its rest; `rested` (J, 3) the source at rest. `offsets`, `tips` (18, 3), and `placed` (n, 18, 3), `oriented`
    (n, 18, 4) in the world are the figure's.
    """

    joints: dict[int, int]
    position: Array
    turn: Array
    rested: Array
    offsets: Array = field(init=False)
    tips: Array = field(init=False)
    placed: Array = field(init=False)
    oriented: Array = field(init=False)

    def __post_init__(self) -> None:
        n = len(self.position)
        self.offsets, self.tips = np.zeros((JOINT_COUNT, 3)), np.zeros((JOINT_COUNT, 3))
        self.placed, self.oriented = np.zeros((n, JOINT_COUNT, 3)), np.zeros((n, JOINT_COUNT, 4))

    def set(self, joint: int, offset: Array, orientation: Array) -> None:
        """Place a joint: its `offset` (3,) in its parent, its world `orientation` (n, 4)."""
        parent = PARENTS[joint]
        self.offsets[joint] = offset
        self.placed[:, joint] = self.placed[:, parent] + rotation.rotate(self.oriented[:, parent], offset)
        self.oriented[:, joint] = orientation


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
    named, said = sides(position, naming.joints)
    named = _completed(bvh, Naming(naming.profile, named), guessed)
    rest = find_rest(bvh, named, frames, position, orientation)
    guessed += [*said, *rest.guessed]
    fit = _source(bvh, named, rest)
    first = 1 if _calibration(fit) else 0
    if first:
        guessed.append("The first frame is a pose apart from the dance; it was left out.")
        fit = _Fit(fit.joints, fit.position[1:], fit.turn[1:], fit.rested)
    _shift_to_floor(fit, guessed)
    _trunk(bvh, fit)
    for side in "lr":
        _leg(bvh, fit, side, rest.scale, rest.upright)
        _arm(bvh, fit, side, rest.scale, rest.upright)
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


def _completed(bvh: Bvh, naming: Naming, guessed: list[str]) -> dict[str, int]:
    """The mapping with root and head, where names or shape left them open.

    The root is where legs and trunk part, whatever it is called: files have a joint on the floor above it, or a
    pelvis below it that carries the legs only, which is then the sacroiliac.
    """
    joints = dict(naming.joints)
    hips = [joints["l_hip"], joints["r_hip"]]
    shoulders = [joints["l_shoulder"], joints["r_shoulder"]]
    if "skullbase" not in joints and (head := find_head(bvh, joints)) is not None:
        joints["skullbase"] = head
        guessed.append(f"No joint is named as the head; {bvh.names[head]} was taken for it.")
    root = common_ancestor(bvh.parents, hips + shoulders)
    pelvis = common_ancestor(bvh.parents, hips)
    joints["humanoid_root"] = root
    joints.pop("sacroiliac", None)
    if pelvis != root and pelvis not in hips:
        joints["sacroiliac"] = pelvis
    missing = [name for name in JOINTS if name not in joints and name not in ("sacroiliac", "vl5")]
    if missing:
        guessed.append(f"The source has no {', '.join(missing)}; they keep a fixed place.")
    return joints


def _source(bvh: Bvh, joints: dict[str, int], rest: Rest) -> _Fit:
    """The source's joints in metres and the figure's axes, over the whole clip."""
    index = {INDEX[name]: source for name, source in joints.items()}
    used = sorted({ancestor for source in index.values() for ancestor in chain(bvh, source)})
    position, orientation = pose(bvh, used)
    position = rest.scale * rotation.rotate(rest.world, position)
    turn = np.zeros_like(orientation)
    back = rotation.conjugate(rotation.multiply(rest.upright, rest.orientations))
    turn[:, used] = rotation.multiply(rotation.multiply(rest.world, orientation[:, used]), back[used])
    return _Fit(index, position, turn, rest.scale * rotation.rotate(rest.upright, rest.positions))


def _calibration(fit: _Fit) -> bool:
    """Whether the first frame stands apart: a pose to calibrate by, far from the second, the dance itself being smooth."""
    if len(fit.position) < 4:
        return False
    sources = list(fit.joints.values())
    local = fit.position[:, sources] - fit.position[:, [fit.joints[0]]]
    step = np.linalg.norm(np.diff(local, axis=0), axis=-1).mean(axis=-1)
    return bool(step[0] > 0.05 and step[0] > 4.0 * step[1:].max())


def _shift_to_floor(fit: _Fit, guessed: list[str]) -> None:
    feet = [source for joint, source in fit.joints.items() if JOINTS[joint][2:] in ("ankle", "midtarsal")]
    lowest = float(fit.position[:, feet or list(fit.joints.values()), 1].min())
    if abs(lowest) > FLOOR_ERROR:
        guessed.append(f"The lowest point of the feet was {lowest:.2f} m from the floor; the dance was moved onto it.")
        fit.position[..., 1] -= lowest


def _relative(fit: _Fit, joint: int, names: tuple[str, ...]) -> Array:
    """Source positions (n, m, 3) of `names`, from where the figure's `joint` is."""
    sources = [fit.joints[INDEX[name]] for name in names]
    return fit.position[:, sources] - fit.placed[:, [joint]]


def _trunk(bvh: Bvh, fit: _Fit) -> None:
    """Root, sacroiliac, vl5, skullbase."""
    root = fit.joints[0]
    fit.placed[:, 0], fit.oriented[:, 0] = fit.position[:, root], fit.turn[:, root]
    pelvis, hips = INDEX["sacroiliac"], ("l_hip", "r_hip")
    source = fit.joints.get(pelvis)
    if source is None:
        fit.set(pelvis, np.zeros(3), fit.oriented[:, 0])
    else:
        fit.set(pelvis, _mean_place(fit, 0, source), fit.turn[:, source])
    places = trunk.mean_places(fit.oriented[:, pelvis], _relative(fit, pelvis, hips))
    between_hips = fit.position[:, fit.joints[INDEX["l_hip"]]] - fit.position[:, fit.joints[INDEX["r_hip"]]]
    if trunk.misfit(fit.oriented[:, pelvis], places, _relative(fit, pelvis, hips), np.ones(2)) > CHEST_GAIN:
        still = np.zeros_like(between_hips)
        fit.oriented[:, pelvis] = limbs.aimed(fit.oriented[:, pelvis], places[0] - places[1], still, between_hips)
        places = trunk.mean_places(fit.oriented[:, pelvis], _relative(fit, pelvis, hips))
    for name, place in zip(hips, places, strict=True):
        fit.offsets[INDEX[name]] = place
    _chest(bvh, fit)


def _mean_place(fit: _Fit, parent: int, source: int) -> Array:
    """Where the source joint lies in the figure's joint `parent` on average (3,)."""
    targets = fit.position[:, [source]] - fit.placed[:, [parent]]
    return trunk.mean_places(fit.oriented[:, parent], targets)[0]


def _chest(bvh: Bvh, fit: _Fit) -> None:
    """vl5: of the source's spine joints the place, and of their orientations and the solved one the turn, that fit best."""
    vl5, head = INDEX["vl5"], INDEX["skullbase"]
    carried = tuple(name for name in ("skullbase", "l_shoulder", "r_shoulder") if INDEX[name] in fit.joints)
    weights = CHEST_WEIGHTS[-len(carried) :]
    root = fit.joints[0]
    shoulders = [fit.joints[INDEX[f"{side}_shoulder"]] for side in "lr"]
    way = chain(bvh, common_ancestor(bvh.parents, shoulders))
    spine = [joint for joint in way if joint not in chain(bvh, root)] or [root]
    few = np.unique(np.linspace(0, len(fit.position) - 1, 200).astype(np.int64))
    best: tuple[float, int, int | None, Array] | None = None
    for source in spine[::-1]:
        targets = fit.position[few][:, [fit.joints[INDEX[name]] for name in carried]] - fit.position[few][:, [source]]
        place = _mean_place(fit, 0, source)
        own = fit.placed[few, 0] + rotation.rotate(fit.oriented[few, 0], place) - fit.position[few, source]
        rested = fit.rested[[fit.joints[INDEX[name]] for name in carried]] - fit.rested[source]
        for turned in [*spine[::-1], None]:
            # the joint itself may be off where it bends with the spine; what hangs from it is off with it
            seen = targets - own[:, None]
            if turned is None:
                start = fit.turn[few][:, spine[0]]
                places = trunk.fitted_places(start, seen, weights, rested)
                orientation = trunk.kabsch(places, seen, weights)
            else:
                orientation = fit.turn[few][:, turned]
                places = trunk.mean_places(orientation, seen)
            error = trunk.misfit(orientation, places, seen, weights) + float(np.sqrt(np.mean(own**2))) / len(weights)
            if best is None or error < best[0] - CHEST_GAIN:
                best = error, source, turned, places
    if best is None:
        raise AssertionError("there is always a spine joint to try")
    _, source, turned, places = best
    if source != root:
        fit.joints[vl5] = source
    fit.set(vl5, _mean_place(fit, 0, source), fit.turn[:, spine[0] if turned is None else turned])
    targets = _relative(fit, vl5, carried)
    if turned is None:
        fit.oriented[:, vl5] = trunk.kabsch(places, targets, weights)
    places = trunk.mean_places(fit.oriented[:, vl5], targets)
    for name, place in zip(carried, places, strict=True):
        fit.offsets[INDEX[name]] = place
    if head in fit.joints:
        fit.set(head, fit.offsets[head], fit.turn[:, fit.joints[head]])
    else:
        fit.set(head, fit.offsets[[INDEX["l_shoulder"], INDEX["r_shoulder"]]].mean(axis=0) + [0.0, 0.12, 0.0],
                fit.oriented[:, vl5])
    fit.tips[head] = (0.0, CROWN, 0.0)


def _follow(fit: _Fit, joint: int, turn: Array, offset: Array) -> None:
    """Place a limb's `joint` (whose own offset is known) so that `offset`, that of the next joint, points at the source's.

    `turn` (4,) brings the source's rest to the figure's.
    """
    source, following = fit.joints[joint], fit.joints.get(joint + 1)
    fit.set(joint, fit.offsets[joint], rotation.multiply(fit.turn[:, source], rotation.conjugate(turn)))
    fit.offsets[joint + 1] = offset
    if following is not None:
        fit.oriented[:, joint] = limbs.aimed(
            fit.oriented[:, joint], offset, fit.placed[:, joint], fit.position[:, following]
        )


def _bone(fit: _Fit, joint: int) -> tuple[Array, float]:
    """The bone from `joint` to the next in the source at rest (3,), and its mean length."""
    start, end = fit.joints[joint], fit.joints[joint + 1]
    return fit.rested[end] - fit.rested[start], limbs.mean_length(fit.position[:, start], fit.position[:, end])


def _leg(bvh: Bvh, fit: _Fit, side: str, scale: float, upright: Array) -> None:
    hip, knee, ankle, midtarsal = (INDEX[f"{side}_{name}"] for name in ("hip", "knee", "ankle", "midtarsal"))
    thigh, length = _bone(fit, hip)
    turn = limbs.turn_down(thigh)
    _follow(fit, hip, turn, length * limbs.DOWN)
    standard = standard_figure().offsets
    if ankle in fit.joints:
        shank, length = _bone(fit, knee)
        turn = limbs.turn_down(shank)
        _follow(fit, knee, turn, length * limbs.DOWN)
    else:
        _follow(fit, knee, turn, length * limbs.DOWN)
        fit.set(ankle, fit.offsets[ankle], fit.oriented[:, knee])
    foot, toes = standard[midtarsal] * [0.0, 1.0, 1.0], np.array([0.0, 0.0, 1.0])
    turn = rotation.IDENTITY
    if midtarsal in fit.joints:
        bone, length = _bone(fit, ankle)
        if _forwards(bone):
            foot = rotation.normalise(bone) * length
        else:
            foot = rotation.normalise(foot) * length
            turn = rotation.between(bone, foot)
        end = _beyond(bvh, fit.joints[midtarsal], fit.rested, scale, upright)
        if turn is rotation.IDENTITY and end is not None and _forwards(end):
            toes = rotation.normalise(end)
    elif ankle in fit.joints and (end := _beyond(bvh, fit.joints[ankle], fit.rested, scale, upright)) is not None:
        if _forwards(end) and 0.08 < np.linalg.norm(end) < 0.35:
            foot = end * 0.65
    if ankle in fit.joints:
        _follow(fit, ankle, turn, foot)
    fit.offsets[midtarsal] = foot
    source = fit.joints.get(midtarsal)
    followed = fit.oriented[:, ankle] if source is None else rotation.multiply(
        fit.turn[:, source], rotation.conjugate(turn)
    )
    fit.set(midtarsal, foot, followed)
    fit.tips[midtarsal] = TOES * toes


def _forwards(foot: Array) -> bool:
    """Whether a bone of the foot (3,), in the figure's axes, points to the front and not up."""
    x, y, z = rotation.normalise(foot).tolist()
    return bool(z > 0.5 and abs(x) < 0.6 and y < 0.3)


def _arm(bvh: Bvh, fit: _Fit, side: str, scale: float, upright: Array) -> None:
    shoulder, elbow, wrist = (INDEX[f"{side}_{name}"] for name in ("shoulder", "elbow", "wrist"))
    bone, length = _bone(fit, shoulder)
    turn = limbs.turn_down(bone)
    _follow(fit, shoulder, turn, length * limbs.DOWN)
    hand = HAND
    if wrist in fit.joints:
        bone, length = _bone(fit, elbow)
        turn = limbs.turn_down(bone)
        _follow(fit, elbow, turn, length * limbs.DOWN)
        end = _beyond(bvh, fit.joints[wrist], fit.rested, scale, upright)
        if end is not None and HAND_LENGTHS[0] <= np.linalg.norm(end) <= HAND_LENGTHS[1]:
            hand = float(np.linalg.norm(end))
            turn = limbs.turn_down(end)
        orientation = rotation.multiply(fit.turn[:, fit.joints[wrist]], rotation.conjugate(turn))
    else:
        _follow(fit, elbow, turn, length * limbs.DOWN)
        orientation = fit.oriented[:, elbow]
    fit.set(wrist, fit.offsets[wrist], orientation)
    fit.tips[wrist] = hand * limbs.DOWN


def _beyond(bvh: Bvh, source: int, rested: Array, scale: float, upright: Array) -> Array | None:
    """From a source joint to the farthest point that hangs from it at rest (3,), in the figure's axes; None: nothing does."""
    below = [joint for joint in range(source, len(bvh.parents)) if source in chain(bvh, joint)]
    found = [rested[joint] - rested[source] for joint in below[1:]]
    found += [
        rested[end.parent] - rested[source] + scale * rotation.rotate(upright, end.offset)
        for end in bvh.ends
        if end.parent in below
    ]
    far = max(found, key=lambda v: float(np.linalg.norm(v)), default=None)
    return far if far is not None and np.linalg.norm(far) > 1e-3 else None


def _motion(fit: _Fit, fps: float) -> Motion:
    """The figure's channels; at rest its lowest point is on the floor."""
    rotations = fit.oriented.copy()
    rotations[:, 1:] = rotation.multiply(rotation.conjugate(fit.oriented[:, PARENTS[1:]]), fit.oriented[:, 1:])
    rotations = rotation.normalise(rotations)
    identity = np.tile(rotation.IDENTITY, (JOINT_COUNT, 1))
    fit.offsets[0] = 0.0
    lowest = points(Figure(fit.offsets, fit.tips), np.zeros(3), identity)[:, 1].min()
    fit.offsets[0] = (0.0, -lowest, 0.0)
    return Motion(Figure(fit.offsets, fit.tips), fps, fit.placed[:, 0].copy(), rotations)
