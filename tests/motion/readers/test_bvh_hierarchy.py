import pytest

from bunraku.motion.errors import UnreadableFile
from bunraku.motion.readers.bvh_hierarchy import MAX_DEPTH, MAX_JOINTS, parse_hierarchy
from tests.motion.readers.bvh_samples import HIERARCHY_TEXT, MOTION_LINE

HIERARCHY_WITH_MOTION = HIERARCHY_TEXT + b"MOTION\n"


@pytest.mark.parametrize("name", ["ns:Spine", "Bip01 L Thigh", "upper_arm.L", "Hüfte", "腰"])
def test_names_may_contain_colons_dots_spaces_and_any_letter(name: str) -> None:
    assert parse_hierarchy(HIERARCHY_WITH_MOTION.replace(b"Spine", name.encode())).names == ("Hips", name)


def test_latin_1_names() -> None:
    assert parse_hierarchy(HIERARCHY_WITH_MOTION.replace(b"Spine", "Hüfte".encode("latin-1"))).names[1] == "Hüfte"


@pytest.mark.parametrize("end", [b"End Site Spine_end", b"END SITE", b"EndSite"])
def test_end_sites_may_have_any_name(end: bytes) -> None:
    assert [site.parent for site in parse_hierarchy(HIERARCHY_WITH_MOTION.replace(b"End Site", end)).ends] == [1]


def test_an_end_site_may_be_missing() -> None:
    at = HIERARCHY_WITH_MOTION.index(b"    End Site")
    assert (
        parse_hierarchy(
            HIERARCHY_WITH_MOTION[:at] + HIERARCHY_WITH_MOTION[HIERARCHY_WITH_MOTION.index(b"  }\n}\n") :]
        ).ends
        == ()
    )


@pytest.mark.parametrize(
    ("channels", "read"),
    [
        (b"6 YROTATION xrotation Zrotation zposition Yposition XPOSITION", "Yr Xr Zr Zp Yp Xp"),
        (b"3 Xposition Yposition Zposition", "Xp Yp Zp"),
        (b"1 Yrotation", "Yr"),
        (b"0", ""),
    ],
)
def test_channels_of_any_number_order_and_case(channels: bytes, read: str) -> None:
    found = parse_hierarchy(HIERARCHY_WITH_MOTION.replace(b"3 Zrotation Xrotation Yrotation", channels)).channels[1]
    assert " ".join(channel[:2] for channel in found) == read


def test_duplicate_sibling_names_are_noted() -> None:
    tree = HIERARCHY_WITH_MOTION.replace(b"  }\n}\n", b"  }\n  JOINT Spine { OFFSET 1 0 0 CHANNELS 0 }\n}\n")
    hierarchy = parse_hierarchy(tree)
    assert hierarchy.names == ("Hips", "Spine", "Spine")
    assert hierarchy.notes == ("Several joints have the same name: Spine.",)


def test_joint_may_be_named_as_its_parent() -> None:
    hierarchy = parse_hierarchy(HIERARCHY_WITH_MOTION.replace(b"JOINT Spine", b"JOINT Hips"))
    assert (hierarchy.names, hierarchy.parents) == (("Hips", "Hips"), (-1, 0))
    assert hierarchy.notes == ("Several joints have the same name: Hips.",)


def test_scale_channels_are_read() -> None:
    given = b"CHANNELS 3 Zrotation"
    scaled = HIERARCHY_WITH_MOTION.replace(given, b"CHANNELS 6 Xscale Yscale Zscale Zrotation")
    assert given in HIERARCHY_WITH_MOTION
    assert parse_hierarchy(scaled).channels[1][:4] == ("Xscale", "Yscale", "Zscale", "Zrotation")


@pytest.mark.parametrize(
    ("old", "new", "title", "line", "field"),
    [
        (b"HIERARCHY", b"<?xml", "Not a BVH file", 1, None),
        (b"JOINT Spine", b"ROOT Spine", "Two roots", 6, "Spine"),
        (b"}\nMOTION", b"}\nROOT b\n{\n}\nMOTION", "Two roots", 16, "b"),
        (b"}\nMOTION", b"}\n}\nMOTION", "Unbalanced braces", 16, None),
        (b"  }\n}\nMOTION", b"  }\nMOTION", "Unbalanced braces", 15, "Hips"),
        (b"  }\n}\nMOTION", b"  }\n}\nJOINT b\n{\n}\nMOTION", "Joint in the wrong place", 16, "b"),
        (b"OFFSET 0 20 0", b"JOINT b\n{\n}", "Joint in the wrong place", 12, "b"),
        (b"OFFSET 0 20 0", b"End Site\n{\n}", "End Site in the wrong place", 12, None),
        (b"OFFSET 0 20 0", b"CHANNELS 0", "CHANNELS in the wrong place", 12, None),
        (b"OFFSET 0 20 0", b"OFFSET 0 nan 0", "Not a number", 12, "OFFSET"),
        (b"OFFSET 0 20 0", b"OFFSET 0 1e999 0", "Not a number", 12, "OFFSET"),
        (b"OFFSET 0 20 0", b"OFFSET 0 20", "Not a number", 12, "OFFSET"),
        (b"OFFSET 0 20 0", b"OFFSET 0 20 0\nOFFSET 0 20 0", "OFFSET twice", 13, "OFFSET"),
        (b"CHANNELS 6", b"CHANNELS 3", "Wrong number of channels", 5, "Hips"),
        (b"CHANNELS 3", b"CHANNELS 6", "Wrong number of channels", 9, "Spine"),
        (b"CHANNELS 3", b"CHANNELS three", "Not a number", 9, "CHANNELS"),
        (b"CHANNELS 3", b"CHANNELS 0\nCHANNELS 3", "CHANNELS twice", 10, "CHANNELS"),
        (b"CHANNELS 3 Zrotation", b"CHANNELS 3 Xrotation", "Channel named twice", 9, "Spine"),
        (b"JOINT Spine\n  {", b"JOINT Spine\n", "Missing brace", 6, "Spine"),
        (b"JOINT Spine", b"BONE Spine", "Unknown word", 6, None),
        (b"Spine", b"x" * 201, "Name too long", 6, None),
        (b"MOTION", b"", "No motion", 17, None),
    ],
)
def test_errors_name_line_and_remedy(old: bytes, new: bytes, title: str, line: int, field: str | None) -> None:
    assert old in HIERARCHY_WITH_MOTION
    with pytest.raises(UnreadableFile) as caught:
        parse_hierarchy(HIERARCHY_WITH_MOTION.replace(old, new, 1))
    assert (caught.value.title, caught.value.line, caught.value.field) == (title, line, field)
    assert caught.value.hint


def test_a_million_joints_wide_or_deep_are_rejected() -> None:
    with pytest.raises(UnreadableFile, match="Too many joints") as caught:
        parse_hierarchy(b"HIERARCHY\nROOT a {\n" + b"JOINT b { }\n" * 1_000_000)
    assert caught.value.line == 2 + MAX_JOINTS
    with pytest.raises(UnreadableFile, match="Too deep") as caught:
        parse_hierarchy(b"HIERARCHY\nROOT a {\n" + b"".join(b"JOINT b%d {\n" % i for i in range(1_000_000)))
    assert caught.value.line == 2 + MAX_DEPTH
    with pytest.raises(UnreadableFile, match="Too many End Sites"):
        parse_hierarchy(b"HIERARCHY\nROOT a {\n" + b"End Site { }\n" * 1_000_000)


def test_long_runs_of_comments_are_skipped() -> None:
    hierarchy = parse_hierarchy(HIERARCHY_WITH_MOTION.replace(b"MOTION", b"\n# x" * 1_000_000 + b"\nMOTION"))
    assert hierarchy.motion_line == MOTION_LINE + 1_000_001
