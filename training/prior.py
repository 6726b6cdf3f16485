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

from bunraku.codec import entropy_coder, prior
from bunraku.codec.block_encoder import BlockEncoder
from bunraku.codec.coefficients import decode_coefficients, duration_level
from bunraku.codec.motion_track import plan_motion_track
from bunraku.codec.prior import FEATURE_COUNT, Prior
from training import corpus, network

SHIPPED_PRIOR_FILE = Path(prior.__file__).with_name("prior.json")
HELD_OUT_PRIORS_FOLDER = Path("tests/bench/priors")
STEP_INDICES = range(64, 204, 10)
BLOCK_LENGTHS_S = (0.5, 1.0, 1.0, 2.0)
MAX_CLIP_S = 36.0
"""Seconds of a clip that are learned from at each step, so that long ones do not outweigh the others."""

TrainingExamples = tuple[npt.NDArray[np.int16], npt.NDArray[np.int32]]


def collect_examples(folder: Path, clip: str, current: Prior, round_: int) -> TrainingExamples:
    """Features of every coefficient of a clip at every step."""
    # the same clips give the same prior
    random = np.random.default_rng(zlib.crc32(clip.encode()) + round_)
    features, where = [], []
    motion = corpus.load_clip(folder, clip)
    for number, step in enumerate(STEP_INDICES):
        turned = corpus.mirror_motion(motion) if (number + round_) % 2 else motion
        track = plan_motion_track(turned, float(random.choice(BLOCK_LENGTHS_S)))
        encoder = BlockEncoder(track, turned, current)
        share = min(1.0, MAX_CLIP_S / motion.duration) * 0.6
        for index in range(track.block_count):
            if track.block_count > 3 and random.random() > share:
                continue
            data = encoder.encode_block(index, step, "mean").data
            head, q = decode_coefficients(current, data, track.block_frames, track.fps)
            rows = q.size
            numbers = np.array([head.frames, head.step, head.heading, q.shape[2], 19], dtype=np.int64)
            f, w = np.zeros((rows, FEATURE_COUNT), dtype=np.int64), np.zeros((rows, 5), dtype=np.int64)
            entropy_coder.collect_examples(current, q, numbers, duration_level(head.frames, track.fps), f, w, 0)
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
    allowed = corpus.licensed_clips(asked.corpus)
    names = [name for name in corpus.list_clips(asked.corpus) if name in allowed]
    families = sorted({corpus.clip_family(name) for name in names})
    current, learned = (
        prior.load_shipped_prior() if SHIPPED_PRIOR_FILE.exists() else None,
        {f: network.initial_parameters() for f in ("", *families)},
    )
    if current is None:
        current = network.quantise_prior(learned[""], np.zeros((0, 5), dtype=np.int32))
    for round_ in range(asked.rounds):
        found = {name: collect_examples(asked.corpus, name, current, round_) for name in names}
        print(f"round {round_ + 1}: {sum(len(w) for _, w in found.values()):,} coefficients of {len(names)} clips")
        for held_out in ("", *families):
            seen = [found[name] for name in names if corpus.clip_family(name) != held_out]
            features, where = (np.concatenate(parts) for parts in zip(*seen, strict=True))
            print(f" {'without ' + held_out if held_out else 'all'}", flush=True)
            learned[held_out] = network.train(features, where, learned[held_out], asked.steps, print)
            made = network.quantise_prior(learned[held_out], where)
            path = HELD_OUT_PRIORS_FOLDER / f"{held_out}.json" if held_out else SHIPPED_PRIOR_FILE
            path.parent.mkdir(exist_ok=True)
            path.write_text(prior.format_prior(made), encoding="utf-8")
            if not held_out:
                current = made


if __name__ == "__main__":
    main()
