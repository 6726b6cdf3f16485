"""BVH as programs write it: one row per dialect."""

from __future__ import annotations

import re
from collections.abc import Callable

import numpy as np
import pytest

from bunraku.motion import rotation
from bunraku.motion.rotation import Array
from tests.motion.readers.dialects import FRAMES, PLAIN_BVH, Reads, Refused, check, plain_source
from tests.motion.readers.fbx_writer import ORDERS, to_degrees
from tests.motion.readers.sources import local_transforms
from tests.motion.synthetic_motion import bone_aligned, export_bvh, pose_with_arms, smooth_motion

DANCE = smooth_motion(frames=FRAMES)
HEAD, _, BODY = PLAIN_BVH.partition(b"MOTION")
HEADER, ROWS = re.split(rb"(?<=Frame Time: )\S+\n", BODY)[0], BODY.split(b"\n")[3 : 3 + FRAMES]
TIME = re.findall(rb"Frame Time: \S+", BODY)[0]
MOTION_LINE = HEAD.count(b"\n") + 1
FIRST_ROW = MOTION_LINE + 3
JOINTS = len(plain_source().names)


def swap(old: bytes, new: bytes, count: int = -1) -> bytes:
    """Return the plain file with a replacement."""
    assert old in PLAIN_BVH, old
    return PLAIN_BVH.replace(old, new, count)


def cut_behind(line: int) -> bytes:
    """Return the first lines of the plain file."""
    return b"\n".join(PLAIN_BVH.split(b"\n")[:line]) + b"\n"


def with_rows(change: Callable[[list[bytes]], list[bytes]]) -> bytes:
    """Return the plain file with other frames."""
    return HEAD + b"MOTION\nFrames: %d\n%s\n" % (FRAMES, TIME) + b"\n".join(change(list(ROWS))) + b"\n"


def with_values(change: Callable[[Array], Array]) -> bytes:
    """Return the plain file with other values (n, C) in its frames."""
    values = change(plain_source().frames.copy())
    return with_rows(lambda _: [b" ".join(b"%.6f" % value for value in row) for row in values])


def with_time(time: bytes) -> bytes:
    return swap(TIME, time)


def with_channels(order: str = "ZXY", moved: str = "root", scale: bool = False, positions_last: bool = False) -> bytes:
    """Return the dance with rotations in `order`, and positions of all joints: absolute, or zeros (`moved`)."""
    source = plain_source()
    offsets, turns = local_transforms(source)
    # the first channel of BVH is the outermost rotation, the first axis of FBX the innermost
    degrees = to_degrees(turns, order[::-1])
    text, columns = HEAD, []
    for joint, line in enumerate(re.findall(rb"CHANNELS [^\n]*", HEAD)):
        names, values = [], []
        if joint == 0 or moved != "root":
            given = offsets[:, joint] if joint == 0 or moved == "all" else 0.0 * offsets[:, joint]
            names += [f"{axis}position" for axis in "XYZ"]
            values += [given[:, axis] for axis in range(3)]
        turned = [degrees[:, joint, "XYZ".index(axis)] for axis in order]
        if positions_last:
            names, values = [f"{axis}rotation" for axis in order] + names, turned + values
        else:
            names, values = names + [f"{axis}rotation" for axis in order], values + turned
        if scale:
            names, values = names + [f"{axis}scale" for axis in "XYZ"], values + [np.ones(FRAMES)] * 3
        text = text.replace(line, b"channels %d %s" % (len(names), " ".join(names).encode()), 1)
        columns += values
    rows = [b" ".join(b"%.6f" % value for value in row) for row in np.transpose(columns)]
    return text + b"MOTION\nFrames: %d\n%s\n" % (FRAMES, TIME) + b"\n".join(rows) + b"\n"


def far_root(metres: float) -> bytes:
    def move(values: Array) -> Array:
        values[:, 0] += 100.0 * metres
        return values

    return with_values(move)


def spike(value: bytes, row: int = 4, column: int = 7) -> bytes:
    """Return the plain file with one broken value."""

    def change(rows: list[bytes]) -> list[bytes]:
        words = rows[row].split()
        words[column] = value
        rows[row] = b" ".join(words)
        return rows

    return with_rows(change)


def mirrored() -> bytes:
    """Return the dance with all x negated, as an export with a negative scale has it."""

    def flip(match: re.Match[bytes]) -> bytes:
        return b"OFFSET %.9f %s" % (-float(match[1]), match[2])

    def change(values: Array) -> Array:
        values[:, 0] *= -1.0
        # rotations about z and y change their sense, those about x do not
        values[:, 3::3] *= -1.0
        values[:, 5::3] *= -1.0
        return values

    return re.sub(rb"OFFSET (\S+) ([^\n]*)", flip, HEAD) + with_values(change)[len(HEAD) :]


def rename(names: dict[str, str]) -> bytes:
    """Return the plain file with other names of joints."""

    def change(match: re.Match[bytes]) -> bytes:
        name = match[2].decode()
        return match[1] + b" " + names.get(name, name).encode()

    return re.sub(rb"(ROOT|JOINT) (\S+)", change, PLAIN_BVH)


READ = [
    # the text
    Reads("CRLF", swap(b"\n", b"\r\n"), unit="cm"),
    Reads("CR", swap(b"\n", b"\r")),
    Reads("BOM and CRLF", b"\xef\xbb\xbf" + swap(b"\n", b"\r\n")),
    Reads("UTF-16 LE with BOM", b"\xff\xfe" + PLAIN_BVH.decode().encode("utf-16-le")),
    Reads("UTF-16 BE with BOM", b"\xfe\xff" + PLAIN_BVH.decode().encode("utf-16-be")),
    Reads("UTF-16 LE without BOM", PLAIN_BVH.decode().encode("utf-16-le")),
    Reads("UTF-16 BE without BOM", PLAIN_BVH.decode().encode("utf-16-be")),
    Reads("tabs", swap(b" ", b"\t")),
    Reads("lower case", PLAIN_BVH.lower()),
    Reads("upper case", PLAIN_BVH.upper()),
    Reads("blank lines and space at the ends of lines", swap(b"\n", b"  \t\n \n")),
    Reads("comments", swap(b"OFFSET", b"# a comment\n// another\nOFFSET")),
    Reads("without HIERARCHY", swap(b"HIERARCHY\n", b"")),
    Reads("DOS end of file", PLAIN_BVH + b"\x1a"),
    Reads("padded with zeros", PLAIN_BVH + bytes(512)),
    Reads("blank lines at the end", PLAIN_BVH + b"\n\n \n"),
    # the hierarchy
    Reads("named End Sites", swap(b"End Site", b"End Site tip")),
    Reads("EndSite", swap(b"End Site", b"EndSite")),
    Reads("no End Sites", re.sub(rb"End Site\n\{[^}]*\}\n", b"", PLAIN_BVH), apart_mm=5.0),
    Reads("End Sites without OFFSET", re.sub(rb"(End Site\n\{)[^}]*\}", rb"\1}", PLAIN_BVH), apart_mm=5.0),
    Reads("names with namespace", re.sub(rb"(ROOT|JOINT) ", rb"\1 Actor_01:", PLAIN_BVH)),
    Reads("quoted names", re.sub(rb"(ROOT|JOINT) (\S+)", rb'\1 "\2"', PLAIN_BVH)),
    Reads("names with spaces", re.sub(rb"(ROOT|JOINT) (\S+)", rb"\1 My Rig \2", PLAIN_BVH)),
    Reads("Latin-1 names", re.sub(rb"JOINT (\S+)", b"JOINT Kost\xfcm_\\1", PLAIN_BVH)),
    Reads("offsets with exponents", re.sub(rb"OFFSET (\S+)", lambda m: b"OFFSET %.9e" % float(m[1]), PLAIN_BVH)),
    Reads("offsets with decimal commas", re.sub(rb"OFFSET[^\n]*", lambda m: m[0].replace(b".", b","), PLAIN_BVH)),
    Reads(
        "two joints of one name",
        rename({"sacroiliac": "Bone", "vl5": "Bone"}),
        notes=("Several joints have the same name: Bone.",),
    ),
    # channels
    *(Reads(f"rotations {order}", with_channels(order)) for order in ORDERS),
    Reads("positions behind rotations", with_channels(positions_last=True)),
    Reads("positions of all joints", with_channels(moved="all")),
    Reads("positions of all joints from their offsets", with_channels(moved="none")),
    Reads("scales", with_channels(scale=True)),
    # the motion
    Reads("decimal commas", HEAD + BODY.replace(b".", b",").join([b"MOTION", b""])),
    Reads("separating commas", with_rows(lambda rows: [row.replace(b" ", b", ") for row in rows])),
    Reads("exponents", with_rows(lambda rows: [b" ".join(b"%.9E" % float(w) for w in r.split()) for r in rows])),
    Reads("signs", with_rows(lambda rows: [b" ".join(b"%+.6f" % float(w) for w in r.split()) for r in rows])),
    Reads("a value a line", with_rows(lambda rows: b" ".join(rows).split())),
    Reads("too many frames declared", swap(b"Frames: 20", b"Frames: 21"), notes=("says 21 frames, but 20",)),
    Reads("too few frames declared", swap(b"Frames: 20", b"Frames: 3"), notes=("says 3 frames, but 20",)),
    Reads("no space after colons", swap(b"Frames: 20", b"Frames:20").replace(b"Frame Time: ", b"Frame Time:")),
    Reads("space before colons", swap(b"Frames:", b"Frames :").replace(b"Frame Time:", b"Frame Time :")),
    Reads("frame time before frames", swap(b"Frames: 20\n" + TIME, TIME + b"\nFrames: 20")),
    Reads("frame time with comma", with_time(b"Frame Time: 0,0333333")),
    Reads("frame time without digit before the point", with_time(b"Frame Time: .0333333")),
    Reads("frame time with unit", with_time(b"Frame Time: 0.0333333 s")),
    Reads("frame time with exponent", with_time(b"Frame Time: 3.33333E-02")),
    Reads("frame time 0", with_time(b"Frame Time: 0"), notes=("not above zero; 30 frames/s",)),
    Reads("negative frame time", with_time(b"Frame Time: -0.04"), notes=("not above zero; 30 frames/s",)),
    Reads("no frame time", swap(TIME + b"\n", b""), notes=("frame time is missing; 30 frames/s",)),
    Reads("frame time of 120 Hz", with_time(b"Frame Time: 0.00833333"), fps=120.0, apart_mm=None),
    Reads("frame time of 59.94 Hz", with_time(b"Frame Time: 0.0166833"), fps=59.94006, apart_mm=None),
    Reads("one frame", with_rows(lambda rows: rows[:1]), frames=1, notes=("says 20 frames, but 1",)),
    Reads(
        "cut within the last frame",
        PLAIN_BVH[:-60],
        frames=FRAMES - 1,
        notes=("The last frame has",),
    ),
    # the body
    Reads("A-pose", export_bvh(DANCE, pose_with_arms(45.0))),
    Reads("T-pose", export_bvh(DANCE, pose_with_arms(90.0))),
    Reads(
        "bones along one axis", export_bvh(DANCE, bone_aligned(DANCE.figure)), apart_mm=30.0, notes=("along an axis",)
    ),
    Reads("metres", export_bvh(DANCE, units_per_metre=1.0), unit="m"),
    Reads("millimetres", export_bvh(DANCE, units_per_metre=1000.0), unit="mm"),
    Reads("inches", export_bvh(DANCE, units_per_metre=1.0 / 0.0254), unit="inch"),
    Reads(
        "unknown unit", export_bvh(DANCE, units_per_metre=7.0), unit="unknown", size=0.9527, notes=("unit is unknown",)
    ),
    Reads(
        "z up",
        export_bvh(DANCE, axes=rotation.from_coordinate_axis(0, np.radians(90.0))),
        notes=("The source's z axis is up",),
    ),
    Reads("mirrored", mirrored(), mirrored=True, notes=("Left and right were exchanged",)),
    Reads("far from the origin", far_root(5_000.0), apart_mm=None, notes=("from the middle of the stage",)),
]

REFUSED = [
    Refused("empty", b"", "Empty file", words="export"),
    Refused("only spaces", b" \r\n\t", "Empty file"),
    Refused("HTML", b"<!DOCTYPE html>\n<html></html>", "Not a BVH file", line=1, words="HIERARCHY"),
    Refused("half of UTF-16", b"\xff\xfe" + PLAIN_BVH.decode().encode("utf-16-le")[:-1], "Broken text", words="UTF-8"),
    Refused("two roots", swap(b"MOTION", b"ROOT b\n{\n}\nMOTION"), "Two roots", line=MOTION_LINE, field="b"),
    Refused("two files in one", (PLAIN_BVH + b"\n") * 2, "Two motions in one file", line=FIRST_ROW + FRAMES),
    Refused(
        "nested too deep",
        b"HIERARCHY\nROOT a {\n" + b"JOINT b {\n" * 300,
        "Too deep",
        line=258,
    ),
    *(
        Refused(f"cut behind line {line}", cut_behind(line), title, line=at, field=field, words="cut short")
        for line, title, at, field in (
            (49, "No motion", 50, None),
            (50, "Missing brace", 50, "Site"),
            (51, "No motion", 52, None),
        )
    ),
    Refused("cut within an offset", PLAIN_BVH[:60], "Not a number", line=4, field="OFFSET", words="cut short"),
    Refused(
        "offset of four numbers",
        swap(b"OFFSET 0.000", b"OFFSET 0 0.000", 1),
        "Unknown word",
        line=4,
        words="'0.000000000'",
    ),
    Refused(
        "offset of infinity", swap(b"OFFSET 0.000000000", b"OFFSET inf", 1), "Not a number", line=4, field="OFFSET"
    ),
    Refused(
        "unknown channel",
        swap(b"Zrotation", b"Wrotation", 1),
        "Wrong number of channels",
        line=5,
        field="humanoid_root",
    ),
    Refused("no channels", re.sub(rb"CHANNELS[^\n]*", b"CHANNELS 0", PLAIN_BVH), "No channels", words="rotations"),
    Refused("empty motion", HEAD + b"MOTION\n", "No whole frame", line=MOTION_LINE),
    Refused("no frames", HEAD + b"MOTION\nFrames: 0\n" + TIME + b"\n", "No whole frame", line=MOTION_LINE + 2),
    Refused(
        "missing value",
        with_rows(lambda r: [*r[:4], r[4][:-6].rsplit(b" ", 1)[0], *r[5:]]),
        "Wrong number of values",
        line=FIRST_ROW + 4,
    ),
    Refused(
        "extra value", with_rows(lambda r: [*r[:4], r[4] + b" 1", *r[5:]]), "Wrong number of values", line=FIRST_ROW + 4
    ),
    Refused("NaN", spike(b"-nan(ind)"), "Not a finite number", line=FIRST_ROW + 4),
    Refused("infinity", spike(b"1.#INF"), "Not a finite number", line=FIRST_ROW + 4),
    Refused("overflow", spike(b"1e400"), "Not a finite number", line=FIRST_ROW + 4),
    Refused("a minus of Unicode", spike("\N{MINUS SIGN}3.5".encode()), "Not a number", line=FIRST_ROW + 4),
    Refused("text behind the frames", PLAIN_BVH + b"\nexported by X\n", "Not a number", line=FIRST_ROW + FRAMES),
    Refused(
        "rate instead of time",
        with_time(b"Frame Time: 30"),
        "Frame time out of range",
        line=FIRST_ROW - 1,
        field="Frame Time",
    ),
    Refused("frame time NaN", with_time(b"Frame Time: nan"), "Not a number", line=FIRST_ROW - 1, field="Frame Time"),
    Refused("root at 1e300", spike(b"1e300", column=1), "Value out of range", field="humanoid_root", words="frame 5"),
    Refused("angle of 1e300", spike(b"1e300"), "Value out of range", field="sacroiliac", words="frame 5"),
    Refused(
        "offset of 1e300", swap(b"OFFSET 9.610000000", b"OFFSET 1e300", 1), "Not a number", line=12, field="OFFSET"
    ),
    Refused(
        "all offsets 0", re.sub(rb"OFFSET[^\n]*", b"OFFSET 0 0 0", PLAIN_BVH), "A leg without length", field="l_knee"
    ),
    Refused(
        "thigh of length 0",
        re.sub(rb"OFFSET 0.0+ -42[^\n]*", b"OFFSET 0 0 0", PLAIN_BVH),
        "A leg without length",
        field="l_knee",
    ),
]


@pytest.mark.parametrize("case", READ, ids=str)
def test_dialect_is_read(case: Reads) -> None:
    check(case)


@pytest.mark.parametrize("case", REFUSED, ids=str)
def test_fault_is_named_with_its_place_and_a_hint(case: Refused) -> None:
    check(case)
