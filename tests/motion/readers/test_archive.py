from __future__ import annotations

import io
import zipfile
from unittest import mock

import pytest

from bunraku.motion.errors import UnreadableFile
from bunraku.motion.readers import archive
from bunraku.motion.readers.archive import Archive
from tests.motion.readers.sources import write_zip


def test_visible_files_are_listed_by_suffix() -> None:
    packed = Archive(
        write_zip({"b.BVH": b"1", "a/c.bvh": b"22", ".hidden.bvh": b"", "__MACOSX/a.bvh": b"", "d.asf": b""})
    )
    assert packed.names(".bvh") == ["a/c.bvh", "b.BVH"]
    assert (packed.size("a/c.bvh"), packed.read("a/c.bvh")) == (2, b"22")


def test_bomb_is_refused_before_it_is_unpacked() -> None:
    packed = Archive(write_zip({"a.bvh": bytes(10_000)}))
    with mock.patch.object(archive, "MAX_UNPACKED_BYTES", 9_999), pytest.raises(UnreadableFile, match="Too large"):
        packed.read("a.bvh")


def test_file_that_lies_about_its_size_is_refused() -> None:
    data = write_zip({"a.bvh": bytes(10_000)})
    lying = data.replace((10_000).to_bytes(4, "little"), (5).to_bytes(4, "little"))
    assert lying != data
    with pytest.raises(UnreadableFile, match="Broken archive"):
        Archive(lying).read("a.bvh")


def test_too_many_files_are_refused() -> None:
    with pytest.raises(UnreadableFile, match="Too many files"):
        Archive(write_zip({f"{number}.bvh": b"" for number in range(1_001)}))


def test_encrypted_archive_is_refused() -> None:
    data = bytearray(write_zip({"a.bvh": b"secret"}))
    for header, flags in ((b"PK\x03\x04", 6), (b"PK\x01\x02", 8)):
        data[data.index(header) + flags] |= 1
    with pytest.raises(UnreadableFile, match="Encrypted archive"):
        Archive(bytes(data)).read("a.bvh")


@pytest.mark.parametrize("cut", [10, 40, -30])
def test_broken_archives_are_refused(cut: int) -> None:
    with pytest.raises(UnreadableFile):
        Archive(write_zip({"a.bvh": bytes(1000)})[:cut]).read("a.bvh")


def test_unknown_compression_is_refused() -> None:
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_STORED) as made:
        made.writestr("a.bvh", b"x")
    data = packed.getvalue()
    for header, method in ((b"PK\x03\x04", 8), (b"PK\x01\x02", 10)):
        at = data.index(header) + method
        data = data[:at] + (99).to_bytes(2, "little") + data[at + 2 :]
    with pytest.raises(UnreadableFile):
        Archive(data).read("a.bvh")


@pytest.mark.parametrize(
    ("skeletons", "found"),
    [(["03.asf", "04.asf"], "03.asf"), (["x.asf"], "x.asf"), (["0.asf", "03.asf", "03_01.asf"], "03_01.asf")],
)
def test_skeleton_of_a_motion_is_found_by_name(skeletons: list[str], found: str) -> None:
    packed = Archive(write_zip(dict.fromkeys([*skeletons, "03_01.amc"], b"")))
    assert packed.find_skeleton("03_01.amc") == found


@pytest.mark.parametrize("skeletons", [[], ["x.asf", "y.asf"]])
def test_missing_skeleton_is_said(skeletons: list[str]) -> None:
    packed = Archive(write_zip(dict.fromkeys([*skeletons, "03_01.amc"], b"")))
    with pytest.raises(UnreadableFile, match="No skeleton") as caught:
        packed.find_skeleton("03_01.amc")
    assert caught.value.field == "03_01.amc"
