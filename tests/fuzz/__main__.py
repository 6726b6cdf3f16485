"""The coverage-guided run: `python -m tests.fuzz CORPUS COUNTS [options of libFuzzer]`, in a process of its own.

The first byte of an input picks the target. The Python of the rooms is instrumented; compiled code cannot be, but has
its bounds checked where NUMBA_BOUNDSCHECK=1. The file COUNTS is an int64 for each target and outcome (refused, read). A
fault ends the process with its traceback on stdout and the input's bytes on stderr.
"""

from __future__ import annotations

import sys
from pathlib import Path

import atheris
import numpy as np

import bunraku.codec._kernels  # noqa: F401 - compiled code, imported before the instrumentation starts

INSTRUMENTED = [
    "bunraku.codec.audio",
    "bunraku.codec.coefficients",
    "bunraku.codec.skeleton_description",
    "bunraku.codec.motion_decoder",
    "bunraku.codec.integer_coder",
    "bunraku.codec.timing",
    "bunraku.codec.motion_track",
    "bunraku.codec.channel_weights",
    "bunraku.wire.messages",
    "tests.fuzz.targets",
]

with atheris.instrument_imports(include=INSTRUMENTED, enable_loader_override=False):
    from tests.fuzz.targets import TARGETS, load_seeds


def main() -> None:
    corpus, file, *options = sys.argv[1:]
    # libFuzzer ends the process without a word to Python: what is counted must be in the file at once
    counts = np.memmap(file, np.int64, "w+", shape=(len(TARGETS), 2))
    for number, (target, data) in enumerate(load_seeds()):
        (Path(corpus) / f"{number:03}").write_bytes(bytes([target]) + data)

    def feed(data: bytes) -> None:
        if data:
            number = data[0] % len(TARGETS)
            counts[number, int(TARGETS[number](data[1:]))] += 1

    atheris.Setup([sys.argv[0], corpus, *options], feed)
    atheris.Fuzz()


if __name__ == "__main__":
    main()
