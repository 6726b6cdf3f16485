"""Zip archives of motion files, among them Acclaim's skeletons with their motions."""

from __future__ import annotations

import io
import posixpath
import struct
import zipfile
import zlib

from bunraku.motion.errors import UnreadableFile, quote_excerpt

ZIP_MAGIC = b"PK\x03\x04"
MAX_MEMBERS = 1_000
MAX_UNPACKED_BYTES = 64 << 20
"""Size of one unpacked file."""
MOTION_SUFFIXES = (".bvh", ".fbx", ".glb", ".gltf", ".vrma", ".vrm", ".amc", ".c3d")
SKELETON_SUFFIX = ".asf"
_ARCHIVE_ERRORS = (zipfile.BadZipFile, ValueError, NotImplementedError, RuntimeError, OSError, struct.error)
"""Errors of `zipfile` for broken archives."""


class Archive:
    """Motion files of a zip archive by their paths in it."""

    def __init__(self, data: bytes) -> None:
        try:
            self._zip = zipfile.ZipFile(io.BytesIO(data))
            members = self._zip.infolist()
        except _ARCHIVE_ERRORS as error:
            raise UnreadableFile("Broken archive", "the zip file cannot be opened", hint="pack it again") from error
        if len(members) > MAX_MEMBERS:
            raise UnreadableFile("Too many files", f"over {MAX_MEMBERS:,} of them", hint="pack fewer files")
        self._members = {member.filename: member for member in members if not member.filename.endswith("/")}

    def names(self, *suffixes: str) -> list[str]:
        """Return the paths of visible files with one of the suffixes, in alphabetical order."""
        return sorted(
            name
            for name in self._members
            if posixpath.splitext(name)[1].lower() in suffixes
            and not any(part.startswith((".", "__MACOSX")) for part in name.split("/"))
        )

    def size(self, name: str) -> int:
        """Return the unpacked size of a file in bytes, as the archive says it."""
        return self._members[name].file_size

    def read(self, name: str) -> bytes:
        """Return a file; raise `UnreadableFile` if it is broken, encrypted or too large."""
        member = self._members[name]
        if member.flag_bits & 1:
            raise UnreadableFile("Encrypted archive", "it has a password", field=name, hint="pack it without one")
        try:
            with self._zip.open(member) as file:
                data = file.read(MAX_UNPACKED_BYTES + 1)
        except (*_ARCHIVE_ERRORS, zlib.error, EOFError) as error:
            detail = "a file cannot be unpacked"
            raise UnreadableFile("Broken archive", detail, field=name, hint="pack it again") from error
        if len(data) > MAX_UNPACKED_BYTES:
            detail = f"a file has over {MAX_UNPACKED_BYTES >> 20} MiB"
            raise UnreadableFile("Too large", detail, field=name, hint="cut it into shorter clips")
        return data

    def find_skeleton(self, motion: str) -> str:
        """Return the ASF of an AMC: of the same name up to its last part (03_01.amc: 03.asf), or the only one."""
        skeletons = self.names(SKELETON_SUFFIX)
        stem = _stem(motion)
        fitting = [name for name in skeletons if stem.startswith(_stem(name))]
        if fitting:
            return max(fitting, key=lambda name: len(_stem(name)))
        if len(skeletons) != 1:
            raise UnreadableFile(
                "No skeleton",
                f"no ASF file is named as {quote_excerpt(motion)}" if skeletons else "there is no ASF file",
                field=motion,
                hint="pack the AMC with its ASF",
            )
        return skeletons[0]


def _stem(path: str) -> str:
    return posixpath.splitext(posixpath.basename(path))[0]
