"""The same bytes to many sockets, in one compiled loop of send(2).

Of a message to six hundred viewers Python's share, a call of each transport's `write`, is a third of the whole. It is a
module of its own as it takes seconds to import (numba), and is done without until then.
"""

from __future__ import annotations

import socket
from typing import Any

import numba
import numpy as np
from numba import types
from numpy.typing import NDArray

SEND_FLAGS = socket.MSG_DONTWAIT | getattr(socket, "MSG_NOSIGNAL", 0)

# by its name, not its address: what is compiled is kept on disk
_libc_send: Any = types.ExternalFunction("send", types.intp(types.int32, types.voidptr, types.uintp, types.int32))


@numba.njit("int64(int32[::1], Array(uint8, 1, 'C', readonly=True), int32, int64[::1])", cache=True)
def multicast_send(
    file_descriptors: NDArray[np.int32], data: NDArray[np.uint8], flags: int, sent: NDArray[np.int64]
) -> int:
    """Send `data` once to each of the connected `sockets`, file descriptors, with the flags of send(2); how many took
    less than all. How many bytes each took, -1 where it could take none, is written to `sent`."""
    short = 0
    for place in range(file_descriptors.size):
        sent[place] = _libc_send(file_descriptors[place], data.ctypes.data, data.size, flags)
        short += sent[place] != data.size
    return short
