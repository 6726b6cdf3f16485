"""Restriction of a process to a few files, by Linux's Landlock (kernel 5.13 or newer, landlock(7)).

The three system calls have the same numbers on all architectures, and no wrappers in the C library. The Python bindings
on PyPI are either unreleased or recent work of one person, hence the calls by `ctypes`.
"""

from __future__ import annotations

import ctypes
import os
import struct
import sys
from collections.abc import Iterable
from functools import cache
from pathlib import Path

_CREATE_RULESET, _ADD_RULE, _RESTRICT_SELF = 444, 445, 446
_CREATE_RULESET_VERSION = 1
_RULE_PATH_BENEATH = 1

_WRITE_FILE, _READ_FILE, _READ_DIR, _TRUNCATE = 1 << 1, 1 << 2, 1 << 3, 1 << 14
_FILE_RIGHTS_BY_ABI = {1: 13, 2: 14, 3: 15, 5: 16}
"""Number of file rights that exist from an ABI version on."""
_TCP_RIGHTS = 0b11
"""Bind and connect, from ABI version 4 on."""
_SCOPES = 0b11
"""Abstract UNIX sockets and signals to processes outside, from ABI version 6 on."""


def abi_version() -> int:
    """Return the version of Landlock that this system supports, 0 for none."""
    if sys.platform != "linux":
        return 0
    version = _libc().syscall(_CREATE_RULESET, None, ctypes.c_size_t(0), ctypes.c_uint(_CREATE_RULESET_VERSION))
    return max(int(version), 0)


def restrict_files(readable: Iterable[Path], writable: Iterable[Path] = ()) -> bool:
    """Deny this thread, and those that it creates, all files except `readable` and `writable` and those below them.

    TCP connections, and signals and abstract sockets of other processes are denied, too, where the version supports it.
    The process must have set no-new-privs. Paths that do not exist are ignored. Return whether the restriction is in
    force.
    """
    version = abi_version()
    if version < 1:
        return False
    file_rights = (1 << max(count for since, count in _FILE_RIGHTS_BY_ABI.items() if since <= version)) - 1
    attributes = struct.pack("=QQQ", file_rights, _TCP_RIGHTS if version >= 4 else 0, _SCOPES if version >= 6 else 0)
    # older kernels know shorter structures
    size = 24 if version >= 6 else 16 if version >= 4 else 8
    libc = _libc()
    ruleset = libc.syscall(_CREATE_RULESET, attributes, ctypes.c_size_t(size), ctypes.c_uint(0))
    if ruleset < 0:
        return False
    try:
        for path in readable:
            _allow(ruleset, path, _READ_FILE | _READ_DIR)
        for path in writable:
            _allow(ruleset, path, (_READ_FILE | _READ_DIR | _WRITE_FILE | _TRUNCATE) & file_rights)
        return bool(libc.syscall(_RESTRICT_SELF, ctypes.c_int(ruleset), ctypes.c_uint(0)) == 0)
    finally:
        os.close(ruleset)


def _allow(ruleset: int, path: Path, rights: int) -> None:
    try:
        descriptor = os.open(path, os.O_PATH | os.O_CLOEXEC)
    except OSError:
        return
    try:
        if not path.is_dir():
            rights &= ~_READ_DIR
        rule = struct.pack("=Qi", rights, descriptor)
        _libc().syscall(_ADD_RULE, ctypes.c_int(ruleset), ctypes.c_int(_RULE_PATH_BENEATH), rule, ctypes.c_uint(0))
    finally:
        os.close(descriptor)


@cache
def _libc() -> ctypes.CDLL:
    return ctypes.CDLL(None, use_errno=True)
