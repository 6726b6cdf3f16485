"""Reading of a motion file by its content, whatever it is called."""

from __future__ import annotations

import contextlib
import posixpath
import re
from dataclasses import replace

from bunraku.motion.errors import UnreadableFile
from bunraku.motion.readers.acclaim import parse_amc, parse_asf
from bunraku.motion.readers.archive import MOTION_SUFFIXES, ZIP_MAGIC, Archive
from bunraku.motion.readers.bvh import Bvh, parse_bvh
from bunraku.motion.readers.fbx import list_fbx_takes, parse_fbx
from bunraku.motion.readers.gltf import list_gltf_takes, parse_gltf
from bunraku.motion.readers.gltf_file import GLB_MAGIC
from bunraku.motion.readers.node_motion import NodeMotion
from bunraku.motion.readers.takes import TakeList, choose_take, describe_choice, name_takes
from bunraku.motion.source_motion import SampledMotion

AnyMotion = Bvh | NodeMotion | SampledMotion

FBX_MAGIC = b"Kaydara FBX Binary"
C3D_PARAMETERS, C3D_MAGIC = range(2, 64), 0x50
"""First bytes of a C3D file: the block of its parameters, and a constant."""
START_BYTES = 4096
"""Bytes at the beginning of a file that show what it is."""
_ASCII_FBX = re.compile(rb"^\s*(;\s*FBX|FBXHeaderExtension\s*:)", re.MULTILINE)
_AMC = re.compile(rb"^\s*(:FULLY-SPECIFIED|:DEGREES|:RADIANS|#!OML:ASF)", re.MULTILINE | re.IGNORECASE)
_ASF = re.compile(rb"^\s*:(bonedata|hierarchy|units|version|root)\b", re.MULTILINE | re.IGNORECASE)


def read_motion(data: bytes, take: str | None = None) -> AnyMotion:
    """Parse a motion file: BVH, FBX, glTF, VRM, VRMA, or a zip archive of such files or of ASF and AMC.

    `take` chooses an animation of a file, or a file of an archive, by its name: `FILE/ANIMATION` is an animation of a
    file of an archive. Raises `UnreadableFile`.
    """
    start = data[:START_BYTES]
    if start.startswith(ZIP_MAGIC):
        return _read_archive(Archive(data), take)
    if _is_gltf(start):
        return parse_gltf(data, take)
    if _is_fbx(start):
        return parse_fbx(data, take)
    if len(start) > 1 and start[0] in C3D_PARAMETERS and start[1] == C3D_MAGIC:
        raise UnreadableFile(
            "Markers, not joints",
            "C3D files have the positions of markers",
            hint="solve a skeleton in the capture software, and export it as FBX or BVH",
        )
    if _AMC.search(start):
        raise UnreadableFile(
            "Motion without skeleton", "an AMC file has no skeleton", hint="send it with its ASF file, in a zip archive"
        )
    if _ASF.search(start):
        raise UnreadableFile(
            "Skeleton without motion", "an ASF file has no motion", hint="send it with its AMC file, in a zip archive"
        )
    return parse_bvh(data)


def list_takes(data: bytes, limit: int, opens_files: bool = True) -> TakeList:
    """Return the first `limit` takes of a motion file; none if the file is one motion.

    Without `opens_files`, no reader of a format is called: each file of an archive is one take, and another file one
    motion. Raises `UnreadableFile` if the file cannot be opened. A take that is listed may be unreadable.
    """
    if data.startswith(ZIP_MAGIC):
        names = _list_archive(Archive(data), limit if opens_files else 0)
    else:
        names = _list_animations(data) if opens_files else []
    return TakeList(names[:limit], len(names)) if len(names) > 1 else TakeList([], 0)


def _list_archive(archive: Archive, limit: int) -> list[str]:
    """Return the takes of an archive: the animations of files that have several, and other files.

    A file that begins beyond the first `limit` takes is one, as it is not opened.
    """
    names: list[str] = []
    for label, path in _label_files(archive).items():
        animations: list[str] = []
        if len(names) < limit and not path.lower().endswith(".amc"):
            with contextlib.suppress(UnreadableFile):
                animations = _list_animations(archive.read(path))
        names += [f"{label}/{name}" for name in animations] if len(animations) > 1 else [label]
    return names


def _list_animations(data: bytes) -> list[str]:
    start = data[:START_BYTES]
    return list_gltf_takes(data) if _is_gltf(start) else list_fbx_takes(data) if _is_fbx(start) else []


def _read_archive(archive: Archive, take: str | None) -> AnyMotion:
    """Read one motion of an archive: the one called `take`, by path or file name, or the largest."""
    labels = _label_files(archive)
    names, paths = list(labels), list(labels.values())
    inner: str | None = None
    if take is not None and take not in labels:
        for name in names:
            if take.startswith(f"{name}/"):
                take, inner = name, take[len(name) + 1 :]
                break
    chosen = choose_take(names, [archive.size(path) for path in paths], take)
    path = paths[chosen]
    if path.lower().endswith(".amc"):
        motion: AnyMotion = parse_amc(archive.read(path), parse_asf(archive.read(archive.find_skeleton(path))))
    else:
        data = archive.read(path)
        if data.startswith(ZIP_MAGIC):
            raise UnreadableFile("Archive in an archive", "it is not opened", field=path, hint="unpack it first")
        motion = read_motion(data, inner)
    return replace(motion, notes=(*motion.notes, *describe_choice(names, chosen)))


def _label_files(archive: Archive) -> dict[str, str]:
    """Return the paths of an archive's motion files by their file names, or by paths if these are not unique."""
    paths = archive.names(*MOTION_SUFFIXES)
    if not paths:
        raise UnreadableFile(
            "No motion",
            "the archive has no motion file",
            hint="pack BVH, FBX, GLB or VRMA files, or AMC files with their ASF",
        )
    names = [posixpath.basename(path) for path in paths]
    return dict(zip(name_takes(names if len(set(names)) == len(names) else paths), paths, strict=True))


def _is_gltf(start: bytes) -> bool:
    return start.startswith(GLB_MAGIC) or start.lstrip(b"\xef\xbb\xbf \t\r\n").startswith(b"{")


def _is_fbx(start: bytes) -> bool:
    return start.startswith(FBX_MAGIC) or _ASCII_FBX.search(start) is not None
