"""Isolation of worker processes, which read files of strangers.

A worker has neither secrets nor the rights of the server: an environment of an allow-list, no inherited files, no
capabilities, limits on memory, CPU time, open and written files, and, where the platform supports it, access only to
its own input, no network and no other processes. It ends when the server ends in any way.
"""

from __future__ import annotations

import atexit
import contextlib
import ctypes
import logging
import math
import multiprocessing.util
import os
import resource
import signal
import stat
import struct
import subprocess
import sys
import threading
from collections.abc import Collection, Iterator, Sequence
from contextlib import contextmanager
from functools import cache
from multiprocessing import forkserver
from pathlib import Path
from typing import Any

from bunraku.runtime import landlock, seccomp
from bunraku.runtime.compile_cache import PACKAGE_FOLDER
from bunraku.runtime.temporary_folder import temporary_folder

ALLOWED_VARIABLES = frozenset(
    {
        *("PATH", "HOME", "LANG", "LANGUAGE", "LC_ALL", "LC_CTYPE", "TZ", "TMPDIR", "VIRTUAL_ENV"),
        *("LD_LIBRARY_PATH", "DYLD_LIBRARY_PATH", "PYTHONPATH", "PYTHONHOME", "PYTHONNOUSERSITE", "PYTHONWARNINGS"),
        *("PYTHONDONTWRITEBYTECODE", "PYTHONUNBUFFERED", "PYTHONUTF8", "PYTHONHASHSEED", "PYTHONMALLOC"),
        *("NUMBA_CACHE_DIR", "NUMBA_NUM_THREADS", "NUMBA_CPU_NAME", "NUMBA_CPU_FEATURES", "NUMBA_THREADING_LAYER"),
        *("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"),
    }
)
"""Environment variables that workers get."""
MAX_OPEN_FILES = 64
MAX_WRITTEN_BYTES = 1 << 20
"""Bytes that a worker may add to a file that it has inherited, such as the log."""
CPU_MARGIN_S = 10
"""CPU time of a worker beyond its time limit on all processors, in seconds: it is normally ended by the server."""

_SYSTEM_FOLDERS = ("/usr", "/lib", "/lib64", "/etc/ld.so.cache", "/etc/localtime", "/sys/devices/system/cpu")
"""Files that the C library may read at any time, shared libraries above all."""
_PR_SET_PDEATHSIG, _PR_SET_NO_NEW_PRIVS = 1, 38
_CAPABILITY_VERSION = 0x20080522

_start_lock = threading.Lock()
_is_prepared = False
_log = logging.getLogger(__name__)


def start_worker_server() -> None:
    """Start the process from which workers are forked, unless it runs. Call it before each start of a worker.

    The process has only the variables of `ALLOWED_VARIABLES`, and its socket is in a folder that is swept after a kill.
    """
    with _start_lock:
        _prepare_server()
        _deny_new_privileges()
        with _restricted_environment():
            forkserver.ensure_running()


def enter_sandbox(result_descriptor: int, readable: Collection[Path], max_memory_bytes: int, timeout_s: float) -> None:
    """Give up all rights that a worker does not need. Call it first in the worker process; it cannot be undone.

    Only `result_descriptor` and the standard streams stay open, and only `readable` and the program's own files can be
    read. What the platform does not support is left out.
    """
    _close_inherited_files(result_descriptor)
    _limit_resources(max_memory_bytes, timeout_s)
    if sys.platform != "linux":
        return
    libc = _libc()
    parent = os.getppid()
    libc.prctl(_PR_SET_PDEATHSIG, signal.SIGKILL, 0, 0, 0)
    if os.getppid() != parent:
        os._exit(1)
    # effective, permitted and inheritable capabilities: none
    libc.capset(struct.pack("=Ii", _CAPABILITY_VERSION, 0), bytes(24))
    _deny_new_privileges()
    landlock.restrict_files([*_program_files(), *readable], [Path("/dev/null")])
    seccomp.deny_system_calls()


def _deny_new_privileges() -> None:
    """Let programs that this thread or its children start gain no privileges (prctl(2), PR_SET_NO_NEW_PRIVS)."""
    if sys.platform == "linux":
        _libc().prctl(_PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0)


@cache
def _libc() -> ctypes.CDLL:
    """Return the C library; each object of it is a reference cycle that waits for a garbage collection."""
    return ctypes.CDLL(None, use_errno=True)


def _prepare_server() -> None:
    global _is_prepared
    if _is_prepared:
        return
    _is_prepared = True
    missing = []
    if not landlock.abi_version():
        missing.append("Landlock")
    if not seccomp.is_supported():
        missing.append("seccomp")
    if missing:
        _log.warning("Uploads are read without %s, which this system does not support", " and ".join(missing))
    stack = contextlib.ExitStack()
    folder = stack.enter_context(temporary_folder("workers"))
    atexit.register(stack.close)
    # the default is a separate folder, which stays after a kill
    multiprocessing.current_process()._config.setdefault("tempdir", str(folder))  # type: ignore[attr-defined]


@contextmanager
def _restricted_environment() -> Iterator[None]:
    """Let processes that multiprocessing starts get only the variables of `ALLOWED_VARIABLES`.

    They get an environment of their own, as that of the server cannot change safely while other threads use it.
    """
    spawn = multiprocessing.util.spawnv_passfds
    multiprocessing.util.spawnv_passfds = _spawn_restricted
    try:
        yield
    finally:
        multiprocessing.util.spawnv_passfds = spawn


def _spawn_restricted(path: bytes, args: Sequence[Any], passfds: Sequence[int]) -> int:
    """Start a program as `multiprocessing.util.spawnv_passfds` does, and return its process id."""
    environment = {name: value for name, value in os.environ.items() if name in ALLOWED_VARIABLES}
    process = subprocess.Popen(args, executable=path, env=environment, pass_fds=tuple(map(int, passfds)))
    # the caller waits for its end
    process.returncode = 0
    return process.pid


def _close_inherited_files(kept: int) -> None:
    """Close all files except `kept` and the standard streams, among them the one that keeps the worker server alive."""
    last = resource.getrlimit(resource.RLIMIT_NOFILE)[1]
    end = 1 << 20 if last == resource.RLIM_INFINITY else last
    os.closerange(3, kept)
    os.closerange(kept + 1, end)


def _limit_resources(max_memory_bytes: int, timeout_s: float) -> None:
    status = os.fstat(2)
    written = MAX_WRITTEN_BYTES + (status.st_size if stat.S_ISREG(status.st_mode) else 0)
    for limit, value in (
        (resource.RLIMIT_AS, max_memory_bytes),
        (resource.RLIMIT_CPU, max(math.ceil(timeout_s * (os.cpu_count() or 1)) + CPU_MARGIN_S, 1)),
        (resource.RLIMIT_NOFILE, MAX_OPEN_FILES),
        (resource.RLIMIT_FSIZE, written),
        (resource.RLIMIT_CORE, 0),
    ):
        hard = resource.getrlimit(limit)[1]
        lowered = value if hard == resource.RLIM_INFINITY else min(value, hard)
        # macOS does not support all of them
        with contextlib.suppress(ValueError, OSError):
            resource.setrlimit(limit, (lowered, lowered))


def _program_files() -> Iterator[Path]:
    """Yield the folders of Python, of its packages and of the compiled kernels."""
    yield from map(Path, _SYSTEM_FOLDERS)
    yield from map(Path, {sys.prefix, sys.base_prefix, sys.exec_prefix})
    yield from (Path(entry) for entry in sys.path if Path(entry).name in ("site-packages", "dist-packages"))
    yield PACKAGE_FOLDER
    if configured := os.environ.get("NUMBA_CACHE_DIR"):
        yield Path(configured)
