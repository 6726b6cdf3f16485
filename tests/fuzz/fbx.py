"""Broken FBX files in a process of their own: `python -m tests.fuzz.fbx SEED COUNT` prints how many were rejected and
accepted. A failure ends the process."""

from __future__ import annotations

import random
import sys

from tests.fuzz.corruption import corrupt
from tests.fuzz.reader_targets import fbx, load_fbx_seeds

MAX_EDITS = 8
DIGITS = b"0123456789.,-"
"""Bytes that leave most of a file readable."""


def main() -> None:
    seed, count = map(int, sys.argv[1:])
    chance, seeds, counts = random.Random(seed), load_fbx_seeds(), [0, 0]
    for _ in range(count):
        whole = chance.choice(seeds)
        values = DIGITS if chance.random() < 0.7 else range(256)
        edits = [(chance.randrange(len(whole)), chance.choice(values)) for _ in range(chance.randrange(MAX_EDITS))]
        kept = chance.choice((1.0, 1.0, 1.0, chance.random()))
        tail = chance.randbytes(chance.choice((0, 0, 0, 4)))
        counts[fbx(corrupt(whole, edits, kept, tail))] += 1
    print(*counts)


if __name__ == "__main__":
    main()
