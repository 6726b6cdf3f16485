"""WAV writer."""

from __future__ import annotations

import struct

import numpy as np

from bunraku.demo.instruments import SAMPLE_RATE_HZ
from bunraku.motion.rotation import Array


def write_wav(samples: Array) -> bytes:
    """Return a 16-bit WAV file of `samples` (n, channels) at 48 kHz; samples beyond -1..1 are clipped."""
    count, channels = samples.shape
    data = np.round(np.clip(samples, -1, 1) * 32_767).astype("<i2").tobytes()
    align = 2 * channels
    form = struct.pack("<4sIHHIIHH", b"fmt ", 16, 1, channels, SAMPLE_RATE_HZ, SAMPLE_RATE_HZ * align, align, 16)
    head = struct.pack("<4sI4s", b"RIFF", 4 + len(form) + 8 + count * align, b"WAVE")
    return head + form + struct.pack("<4sI", b"data", count * align) + data
