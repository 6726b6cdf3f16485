"""Reader of Acclaim motion: a skeleton (ASF) and the angles of its bones in each frame (AMC).

Source: Acclaim's ASF/AMC specification (J. Lander, "Working with Motion Capture File Formats", Game Developer, January
1998). Each bone is a joint here, at the bone's beginning: `lfemur` is the hip. Files have no frame rate.
"""

from __future__ import annotations

import math
from array import array
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from bunraku.motion import rotation
from bunraku.motion.errors import UnreadableFile, quote_excerpt
from bunraku.motion.rotation import Array
from bunraku.motion.source_motion import EndSite, SampledMotion, chain_transforms

AMC_FPS = 120.0
"""Frame rate of the CMU database, where nearly all files are from."""
MAX_BONES = 1_000
MAX_JOINT_FRAMES = 4_000_000
"""Bound of bones times frames."""
ROOT = "root"
_DOF = {"tx": (0, False), "ty": (1, False), "tz": (2, False), "rx": (0, True), "ry": (1, True), "rz": (2, True)}
"""Axis of each degree of freedom, and whether it is a rotation."""


@dataclass(slots=True)
class Bone:
    """Bone of an ASF file: `vector` (3,) from its beginning to its end, `axis` (4,) the frame of its angles at rest."""

    name: str
    line: int
    vector: Array
    axis: Array
    dof: tuple[str, ...] = ()


@dataclass(slots=True)
class AcclaimSkeleton:
    """Bones of an ASF file, the root first, parents before their children; `radians` is the unit of its angles."""

    bones: list[Bone]
    parents: list[int]
    radians: float
    root_offset: Array = field(default_factory=lambda: np.zeros(3))


def parse_asf(data: bytes) -> AcclaimSkeleton:
    """Parse the skeleton of an ASF file. Raises `UnreadableFile`."""
    sections = _split_sections(data)
    radians = math.pi / 180.0
    for _, words in sections.get("units", ()):
        if words[0].lower() == "angle" and len(words) > 1 and words[1].lower().startswith("rad"):
            radians = 1.0
    root, root_offset = _parse_root(sections.get("root", ()), radians)
    bones = {ROOT: root}
    for bone in _parse_bones(sections.get("bonedata", ()), radians):
        if bone.name in bones:
            raise _broken(f"the bone {quote_excerpt(bone.name)} is there twice", bone.line)
        bones[bone.name] = bone
        if len(bones) > MAX_BONES:
            raise _broken(f"over {MAX_BONES:,} bones", bone.line)
    if len(bones) == 1:
        raise UnreadableFile("No skeleton", "the file has no bones", field=":bonedata", hint=_REMEDY)
    return _order_bones(bones, sections.get("hierarchy", ()), radians, root_offset)


def parse_amc(data: bytes, skeleton: AcclaimSkeleton) -> SampledMotion:
    """Parse the frames of an AMC file for `skeleton`. Raises `UnreadableFile`."""
    bones = skeleton.bones
    index = {bone.name: number for number, bone in enumerate(bones)}
    tracks = [array("d") for _ in bones]
    count, radians = 0, skeleton.radians
    for line, words in _lines(data):
        if words[0].startswith(":"):
            radians = {":radians": 1.0, ":degrees": math.pi / 180.0}.get(words[0].lower(), radians)
        elif len(words) == 1 and words[0].isdigit():
            count += 1
            if count * len(bones) > MAX_JOINT_FRAMES:
                raise UnreadableFile(
                    "Too much motion",
                    f"over {MAX_JOINT_FRAMES:,} positions of bones",
                    line=line,
                    hint="cut it into shorter clips",
                )
        elif count == 0:
            raise _broken("values before the number of a frame", line)
        else:
            number = index.get(words[0])
            if number is None:
                raise _broken(
                    f"the skeleton has no bone {quote_excerpt(words[0])}", line, "is this the ASF of this AMC?"
                )
            freedom = len(bones[number].dof)
            if len(words) - 1 != freedom:
                raise _broken(f"{words[0]} has {len(words) - 1} values, but {freedom} degrees of freedom", line)
            if len(tracks[number]) > (count - 1) * freedom:
                raise _broken(f"{words[0]} is there twice in a frame", line)
            # frames without the bone have it at rest
            tracks[number].extend([0.0] * ((count - 1) * freedom - len(tracks[number])))
            tracks[number].extend(_numbers(words[1:], line))
    if count == 0:
        raise UnreadableFile("No motion", "the file has no frames", hint=_REMEDY)
    angles = []
    for bone, track in zip(bones, tracks, strict=True):
        freedom = len(bone.dof)
        track.extend([0.0] * (count * freedom - len(track)))
        angles.append(np.array(track).reshape(count, freedom))
    return _pose_bones(skeleton, angles, count, radians)


def _pose_bones(skeleton: AcclaimSkeleton, tracks: Sequence[Array], count: int, radians: float) -> SampledMotion:
    """Return the bones' transforms from the values (`count`, degrees of freedom) of each."""
    bones = skeleton.bones
    offsets = np.zeros((count, len(bones), 3))
    turns = np.tile(rotation.IDENTITY, (count, len(bones), 1))
    for number, (bone, track) in enumerate(zip(bones, tracks, strict=True)):
        offset = bones[skeleton.parents[number]].vector if number else skeleton.root_offset
        offsets[:, number] = offset
        turn = np.tile(rotation.IDENTITY, (count, 1))
        for column, name in enumerate(bone.dof):
            if name not in _DOF:
                continue
            axis, is_rotation = _DOF[name]
            if is_rotation:
                turn = rotation.multiply(rotation.from_coordinate_axis(axis, radians * track[:, column]), turn)
            else:
                offsets[:, number, axis] += track[:, column]
        turns[:, number] = rotation.multiply(rotation.multiply(bone.axis, turn), rotation.conjugate(bone.axis))
    positions, orientations = chain_transforms(skeleton.parents, offsets, turns)
    rest_offsets = np.stack([bones[parent].vector if parent >= 0 else np.zeros(3) for parent in skeleton.parents])
    rest_turns = np.tile(rotation.IDENTITY, (len(bones), 1))
    rest_positions, rest_orientations = chain_transforms(skeleton.parents, rest_offsets, rest_turns)
    leaves = set(range(1, len(bones))) - set(skeleton.parents)
    return SampledMotion(
        names=tuple(bone.name for bone in bones),
        parents=tuple(skeleton.parents),
        ends=tuple(EndSite(number, bones[number].vector) for number in sorted(leaves)),
        fps=AMC_FPS,
        rest_positions=rest_positions,
        rest_orientations=rest_orientations,
        positions=positions,
        orientations=orientations,
        notes=(f"AMC files have no frame rate; {AMC_FPS:g} frames per second were assumed.",),
    )


def _lines(data: bytes) -> Iterator[tuple[int, list[str]]]:
    """Yield the number and words of each line that has words, without comments."""
    for number, line in enumerate(data.decode("latin-1").splitlines(), 1):
        words = line.partition("#")[0].split()
        if words:
            yield number, words


def _split_sections(data: bytes) -> dict[str, list[tuple[int, list[str]]]]:
    """Return the lines of each section by its name, in lower case and without colon."""
    sections: dict[str, list[tuple[int, list[str]]]] = {}
    lines: list[tuple[int, list[str]]] = []
    for number, words in _lines(data):
        if words[0].startswith(":"):
            lines = sections.setdefault(words[0][1:].lower(), [])
        else:
            lines.append((number, words))
    return sections


def _parse_root(lines: Sequence[tuple[int, list[str]]], radians: float) -> tuple[Bone, Array]:
    bone, offset = Bone(ROOT, lines[0][0] if lines else 1, np.zeros(3), rotation.IDENTITY.copy()), np.zeros(3)
    order, angles = "XYZ", [0.0, 0.0, 0.0]
    for line, words in lines:
        match words[0].lower():
            case "order":
                bone.dof = tuple(word.lower() for word in words[1:])
            case "axis":
                order = words[1] if len(words) > 1 else order
            case "position":
                offset = np.array(_numbers(words[1:], line, 3))
            case "orientation":
                angles = _numbers(words[1:], line, 3)
    bone.axis = _axis_rotation(angles, order, radians, bone.line)
    return bone, offset


def _parse_bones(lines: Sequence[tuple[int, list[str]]], radians: float) -> Iterator[Bone]:
    bone: Bone | None = None
    direction, length = np.zeros(3), 0.0
    for line, words in lines:
        keyword = words[0].lower()
        if keyword == "begin":
            bone, direction, length = Bone("", line, np.zeros(3), rotation.IDENTITY.copy()), np.zeros(3), 0.0
        elif bone is None:
            raise _broken(f"{quote_excerpt(words[0])} is outside a bone", line)
        elif keyword == "end":
            if not bone.name:
                raise _broken("a bone has no name", bone.line)
            bone.vector = rotation.normalise(direction) * length
            yield bone
            bone = None
        elif keyword == "name":
            bone.name = " ".join(words[1:])
        elif keyword == "direction":
            direction = np.array(_numbers(words[1:], line, 3))
        elif keyword == "length":
            (length,) = _numbers(words[1:], line, 1)
        elif keyword == "axis":
            order = words[4] if len(words) > 4 else "XYZ"
            bone.axis = _axis_rotation(_numbers(words[1:4], line, 3), order, radians, line)
        elif keyword == "dof":
            bone.dof = tuple(word.lower() for word in words[1:])


def _axis_rotation(angles: Sequence[float], order: str, radians: float, line: int) -> Array:
    """Return the rotation (4,) of angles about x, y and z, applied in `order`, about fixed axes."""
    if sorted(order.upper()) != ["X", "Y", "Z"]:
        raise _broken(f"the order of axes is {quote_excerpt(order)}", line)
    turn = rotation.IDENTITY
    for name, angle in zip(order.upper(), angles, strict=True):
        turn = rotation.multiply(rotation.from_coordinate_axis("XYZ".index(name), np.array(radians * angle)), turn)
    return turn


def _order_bones(
    bones: dict[str, Bone], lines: Sequence[tuple[int, list[str]]], radians: float, root_offset: Array
) -> AcclaimSkeleton:
    """Return the bones below the root as the hierarchy says, parents first."""
    children: dict[str, list[str]] = {}
    parent_of: dict[str, str] = {}
    for line, words in lines:
        if words[0].lower() in ("begin", "end") and len(words) == 1:
            continue
        for name in words:
            if name not in bones:
                raise _broken(f"the hierarchy names a bone {quote_excerpt(name)} that is not there", line)
        for name in words[1:]:
            if name == ROOT or name in parent_of:
                raise _broken(f"{quote_excerpt(name)} has two parents", line)
            parent_of[name] = words[0]
            children.setdefault(words[0], []).append(name)
    order, parents = [ROOT], [-1]
    for number, name in enumerate(order):
        for child in children.get(name, ()):
            order.append(child)
            parents.append(number)
    return AcclaimSkeleton([bones[name] for name in order], parents, radians, root_offset)


_REMEDY = "export it again; the skeleton (ASF) and the motion (AMC) belong together"


def _broken(detail: str, line: int, hint: str = _REMEDY) -> UnreadableFile:
    return UnreadableFile("Broken Acclaim file", detail, line=line, hint=hint)


def _numbers(words: Sequence[str], line: int, count: int | None = None) -> list[float]:
    """Return the finite numbers of a line; their number is `count`, if it is given."""
    try:
        numbers = [float(word) for word in words]
    except ValueError:
        numbers = [math.nan]
    if not all(map(math.isfinite, numbers)) or (count is not None and len(numbers) != count):
        raise _broken(f"{quote_excerpt(' '.join(words))} is not {count or 'numbers'}", line)
    return numbers
