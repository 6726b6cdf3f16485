"""Compiled loop of send(2) that writes one message to many sockets.

For a message to six hundred viewers, calling the `write` method of each transport takes a third of the total time in
Python. This module is the only one of the package that imports numba; load it with `bunraku.kernels.load_kernels`.
Importing it raises ImportError or AttributeError on systems without POSIX sockets.
"""

from __future__ import annotations

import socket
from typing import Any

import numba
import numpy as np
from numba import types
from numpy.typing import NDArray

SEND_FLAGS = socket.MSG_DONTWAIT | getattr(socket, "MSG_NOSIGNAL", 0)

# referenced by name rather than by address, because compiled code is cached on disk
_libc_send: Any = types.ExternalFunction("send", types.intp(types.int32, types.voidptr, types.uintp, types.int32))


@numba.njit("int64(int32[::1], Array(uint8, 1, 'C', readonly=True), int32, int64[::1])", cache=True)
def multicast_send(
    file_descriptors: NDArray[np.int32], data: NDArray[np.uint8], flags: int, sent: NDArray[np.int64]
) -> int:
    """Send `data` once to each connected socket with the given flags of send(2).

    Write to `sent` the number of bytes that each socket accepted, -1 where it accepted none. Return the number of
    sockets that did not accept all bytes.
    """
    short = 0
    for index in range(file_descriptors.size):
        sent[index] = _libc_send(file_descriptors[index], data.ctypes.data, data.size, flags)
        short += sent[index] != data.size
    return short
