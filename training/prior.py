"""`python -m training.prior CORPUS`: the shipped prior, and for the bench one for each family that has not seen it.

Every round encodes the clips with the prior so far, at all steps and several block lengths, left and right exchanged
half of the time, and learns from the coefficients.
"""

from __future__ import annotations

import argparse
import zlib
from pathlib import Path

import numpy as np
import numpy.typing as npt

from bunraku.codec import kernels, prior
from bunraku.codec.coefficients import decode, length_level
from bunraku.codec.prior import FEATURES, Prior
from bunraku.codec.search import BlockEncoder
from bunraku.codec.track import plan
from training import corpus, network

SHIPPED = Path(prior.__file__).with_name("prior.json")
HELD_OUT = Path("tests/bench/priors")
STEPS = range(64, 204, 10)
LENGTHS = (0.5, 1.0, 1.0, 2.0)
LONG = 36.0
"""Seconds of a clip that are learned from at each step, so that long ones do not outweigh the others."""

Examples = tuple[npt.NDArray[np.int16], npt.NDArray[np.int32]]


def examples(folder: Path, name: str, current: Prior, round_: int) -> Examples:
    """Features of every coefficient of a clip at every step."""
    # the same clips give the same prior
    random = np.random.default_rng(zlib.crc32(name.encode()) + round_)
    features, where = [], []
    motion = corpus.load(folder, name)
    for number, step in enumerate(STEPS):
        turned = corpus.mirrored(motion) if (number + round_) % 2 else motion
        track = plan(turned, float(random.choice(LENGTHS)))
        encoder = BlockEncoder(track, turned, current)
        share = min(1.0, LONG / motion.duration) * 0.6
        for index in range(track.blocks):
            if track.blocks > 3 and random.random() > share:
                continue
            data = encoder.block(index, step, "mean").data
            head, q = decode(current, data, track.block_frames, track.fps)
            rows = q.size
            numbers = np.array([head.frames, head.step, head.heading, q.shape[2], 19], dtype=np.int64)
            f, w = np.zeros((rows, FEATURES), dtype=np.int64), np.zeros((rows, 5), dtype=np.int64)
            kernels.examples(current, q, numbers, length_level(head.frames, track.fps), f, w, 0)
            features.append(f.astype(np.int16))
            where.append(w.astype(np.int32))
    return np.concatenate(features), np.concatenate(where)


def main() -> None:
    """The command."""
    parser = argparse.ArgumentParser(prog="training.prior", description=__doc__)
    parser.add_argument("corpus", type=Path)
    parser.add_argument("--rounds", type=int, default=2)
    parser.add_argument("--steps", type=int, default=1000)
    asked = parser.parse_args()
    allowed = corpus.licensed(asked.corpus)
    names = [name for name in corpus.names(asked.corpus) if name in allowed]
    families = sorted({corpus.family(name) for name in names})
    current, learned = prior.shipped() if SHIPPED.exists() else None, {f: network.start() for f in ("", *families)}
    if current is None:
        current = network.quantised(learned[""], np.zeros((0, 5), dtype=np.int32))
    for round_ in range(asked.rounds):
        found = {name: examples(asked.corpus, name, current, round_) for name in names}
        print(f"round {round_ + 1}: {sum(len(w) for _, w in found.values()):,} coefficients of {len(names)} clips")
        for held_out in ("", *families):
            seen = [found[name] for name in names if corpus.family(name) != held_out]
            features, where = (np.concatenate(parts) for parts in zip(*seen, strict=True))
            print(f" {'without ' + held_out if held_out else 'all'}", flush=True)
            learned[held_out] = network.train(features, where, learned[held_out], asked.steps, print)
            made = network.quantised(learned[held_out], where)
            path = HELD_OUT / f"{held_out}.json" if held_out else SHIPPED
            path.parent.mkdir(exist_ok=True)
            path.write_text(prior.dump(made), encoding="utf-8")
            if not held_out:
                current = made


if __name__ == "__main__":
    main()
