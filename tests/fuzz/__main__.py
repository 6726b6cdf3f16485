"""Coverage-guided fuzzing in a separate process: `python -m tests.fuzz CORPUS COUNTS [options of libFuzzer]`.

The first byte of an input selects the target. The Python code of the packages is instrumented. Compiled code cannot be,
but its bounds are checked if NUMBA_BOUNDSCHECK=1. The file COUNTS holds an int64 for each target and outcome (rejected,
accepted). A failure ends the process with its traceback on stdout and the bytes of the input on stderr.
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
    # libFuzzer ends the process without returning to Python, so counts are written to the file immediately
    counts = np.memmap(file, np.int64, "w+", shape=(len(TARGETS), 2))
    for number, (target, data) in enumerate(load_seeds()):
        (Path(corpus) / f"{number:03}").write_bytes(bytes([target]) + data)

    def run_target(data: bytes) -> None:
        if data:
            number = data[0] % len(TARGETS)
            counts[number, int(TARGETS[number](data[1:]))] += 1

    atheris.Setup([sys.argv[0], corpus, *options], run_target)
    atheris.Fuzz()


if __name__ == "__main__":
    main()
