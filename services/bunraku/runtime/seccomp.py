"""Denial of system calls that a computation does not need, by a seccomp filter (seccomp(2)).

The filter denies network, other processes, programs, attributes of files and the administration of the system. It is
a list of denied calls: an allow-list would depend on the versions of numba, FFmpeg and the C library. The bindings of
libseccomp on PyPI need its shared library, or are unmaintained, and the filter is a few dozen instructions of classic
BPF.
"""

from __future__ import annotations

import ctypes
import errno
import os
import platform
import struct
import sys
from typing import NamedTuple

_PR_SET_SECCOMP = 22
_SECCOMP_MODE_FILTER = 2

# classic BPF: operations on the accumulator (linux/bpf_common.h)
_LOAD, _JUMP_EQUAL, _JUMP_GREATER_OR_EQUAL, _JUMP_BITS, _RETURN = 0x20, 0x15, 0x35, 0x45, 0x06
# offsets in struct seccomp_data
_NUMBER_OFFSET, _ARCHITECTURE_OFFSET, _FIRST_ARGUMENT_OFFSET = 0, 4, 16
_ALLOW, _KILL, _ERROR = 0x7FFF0000, 0x80000000, 0x00050000

_X32_CALLS = 0x40000000
"""Numbers from here on are calls of the x32 ABI, another way to make the same calls."""
_CLONE_THREAD = 0x00010000


class _Calls(NamedTuple):
    """Numbers of system calls on one architecture."""

    architecture: int
    """AUDIT_ARCH_... of the kernel."""
    clone: int
    to_process: tuple[int, ...]
    """Calls that are allowed if their first argument is this process: kill, tgkill, rt_sigqueueinfo."""
    own_limits: int
    """prlimit64, allowed if its first argument is 0."""
    denied: tuple[int, ...]


_SHARED_DENIED = (424, 425, 426, 427, 434, 438, 440, 452)
"""pidfd_send_signal, io_uring_setup/enter/register, pidfd_open, pidfd_getfd, process_madvise, fchmodat2."""
_CLONE3 = 435

_CALLS = {
    "x86_64": _Calls(
        0xC000003E,
        56,
        (62, 234, 129),
        302,
        (
            *(41, 42, 43, 44, 49, 50, 53, 288),  # socket connect accept sendto bind listen socketpair accept4
            *(57, 58, 59, 322, 200, 297),  # fork vfork execve execveat tkill rt_tgsigqueueinfo
            *(101, 310, 311, 298, 321, 323),  # ptrace process_vm_readv/writev perf_event_open bpf userfaultfd
            *(29, 30, 64, 68, 240),  # shmget shmat semget msgget mq_open
            *(248, 249, 250),  # add_key request_key keyctl
            *(155, 161, 165, 166, 272, 308, 304),  # pivot_root chroot mount umount2 unshare setns open_by_handle_at
            *(135, 167, 169, 170, 175, 176, 246, 313, 320),  # personality swapon reboot sethostname modules kexec
            *(90, 91, 92, 93, 94, 260, 268),  # chmod fchmod chown fchown lchown fchownat fchmodat
            *(132, 235, 261, 280, 188, 189, 190, 197, 198, 199),  # utime utimes futimesat utimensat set/removexattr
        ),
    ),
    "aarch64": _Calls(
        0xC00000B7,
        220,
        (129, 131, 138),
        261,
        (
            *(198, 203, 202, 206, 200, 201, 199, 242),
            *(221, 281, 130, 240),
            *(117, 270, 271, 241, 280, 282),
            *(194, 196, 190, 186, 180),
            *(217, 218, 219),
            *(41, 51, 40, 39, 97, 268, 265),
            *(92, 224, 142, 161, 105, 106, 104, 273, 294),
            *(52, 53, 54, 55),
            *(88, 5, 6, 7, 14, 15, 16),
        ),
    ),
}


class _Program(ctypes.Structure):
    _fields_ = (("length", ctypes.c_ushort), ("instructions", ctypes.c_char_p))


def is_supported() -> bool:
    """Return whether there is a filter for this platform."""
    return sys.platform == "linux" and platform.machine() in _CALLS and sys.maxsize > 1 << 32


def deny_system_calls() -> bool:
    """Deny this thread, and those that it creates, calls beyond computation and files; they fail with EPERM.

    The process can still create threads, but no processes. It must have set no-new-privs. Return whether the filter is
    in force.
    """
    if not is_supported():
        return False
    instructions = b"".join(_build_filter(_CALLS[platform.machine()], os.getpid()))
    program = _Program(len(instructions) // 8, instructions)
    libc = ctypes.CDLL(None, use_errno=True)
    return bool(libc.prctl(_PR_SET_SECCOMP, ctypes.c_ulong(_SECCOMP_MODE_FILTER), ctypes.byref(program), 0, 0) == 0)


def _build_filter(calls: _Calls, process_id: int) -> list[bytes]:
    allow, deny = _instruction(_RETURN, _ALLOW), _instruction(_RETURN, _ERROR | errno.EPERM)

    def when_argument(number: int, test: int, operand: int) -> list[bytes]:
        """Allow a call if its first argument passes a test, else deny it."""
        return [
            _instruction(_JUMP_EQUAL, number, 0, 4),
            _instruction(_LOAD, _FIRST_ARGUMENT_OFFSET),
            _instruction(test, operand, 0, 1),
            allow,
            deny,
        ]

    program = [
        _instruction(_LOAD, _ARCHITECTURE_OFFSET),
        _instruction(_JUMP_EQUAL, calls.architecture, 1, 0),
        _instruction(_RETURN, _KILL),
        _instruction(_LOAD, _NUMBER_OFFSET),
        _instruction(_JUMP_GREATER_OR_EQUAL, _X32_CALLS, 0, 1),
        deny,
        # the flags of clone3 are in memory, which a filter cannot read; the C library then uses clone
        _instruction(_JUMP_EQUAL, _CLONE3, 0, 1),
        _instruction(_RETURN, _ERROR | errno.ENOSYS),
        *when_argument(calls.clone, _JUMP_BITS, _CLONE_THREAD),
        *when_argument(calls.own_limits, _JUMP_EQUAL, 0),
    ]
    for number in calls.to_process:
        program += when_argument(number, _JUMP_EQUAL, process_id)
    for number in (*calls.denied, *_SHARED_DENIED):
        program += [_instruction(_JUMP_EQUAL, number, 0, 1), deny]
    return [*program, allow]


def _instruction(operation: int, operand: int, when_true: int = 0, when_false: int = 0) -> bytes:
    return struct.pack("=HBBI", operation, when_true, when_false, operand)
