"""Train the shipped prior, and for the benchmarks one without each family of clips.

Usage: `python -m training.prior CORPUS`. Every round encodes the clips with the current prior, at all steps and several
block lengths, mirrored half of the time, and trains on the coefficients.
"""

from __future__ import annotations

import argparse
import zlib
from pathlib import Path

import numpy as np
import numpy.typing as npt

from bunraku.codec import prior
from bunraku.codec.block_encoder import MEAN_ERROR_REFINEMENT, BlockEncoder
from bunraku.codec.channel_layout import MOTION_LAYOUT
from bunraku.codec.coefficients import decode_coefficients, duration_level
from bunraku.codec.motion_track import MotionTrack, plan_motion_track
from bunraku.codec.prior import Prior
from bunraku.kernels import load_kernels
from bunraku.motion.skeleton import CHANNEL_COUNT
from training import corpus, network

SHIPPED_PRIOR_FILE = Path(prior.__file__).with_name("prior.json")
HELD_OUT_PRIORS_FOLDER = Path("tests/bench/priors")
STEP_INDICES = range(64, 204, 10)
BLOCK_LENGTHS_S = (0.5, 1.0, 1.0, 2.0)
MAX_CLIP_S = 36.0
"""Seconds of a clip that are used at each step, so that long clips do not outweigh the others."""

TrainingExamples = tuple[npt.NDArray[np.int16], npt.NDArray[np.int32]]


def read_examples(track: MotionTrack, data: bytes, current: Prior) -> TrainingExamples:
    """Return features and labels of the coefficients of a block."""
    header, q = decode_coefficients(current, data, track.block_frames, track.fps)
    numbers = np.array([header.frames, header.step, header.heading, q.shape[2], CHANNEL_COUNT], dtype=np.int64)
    level = duration_level(header.frames, track.fps)
    features, labels = load_kernels("codec").collect_examples(current, MOTION_LAYOUT, q, numbers, level)
    return features.astype(np.int16), labels.astype(np.int32)


def collect_examples(folder: Path, clip: str, current: Prior, round_number: int) -> TrainingExamples:
    """Return features and labels of the coefficients of a clip at every step."""
    # seeded by the name, so that the same clips give the same prior
    random = np.random.default_rng(zlib.crc32(clip.encode()) + round_number)
    features, labels = [], []
    motion = corpus.load_clip(folder, clip)
    for number, step in enumerate(STEP_INDICES):
        oriented = corpus.mirror_motion(motion) if (number + round_number) % 2 else motion
        track = plan_motion_track(oriented, float(random.choice(BLOCK_LENGTHS_S)))
        encoder = BlockEncoder(track, oriented, current)
        share = min(1.0, MAX_CLIP_S / motion.duration) * 0.6
        for index in range(track.block_count):
            if track.block_count > 3 and random.random() > share:
                continue
            data = encoder.encode_block(index, step, MEAN_ERROR_REFINEMENT).data
            block_features, block_labels = read_examples(track, data, current)
            features.append(block_features)
            labels.append(block_labels)
    return np.concatenate(features), np.concatenate(labels)


def main() -> None:
    """Run the command."""
    parser = argparse.ArgumentParser(prog="training.prior", description=__doc__)
    parser.add_argument("corpus", type=Path, help="folder with hanim19/*.npz and CORPUS.csv")
    parser.add_argument("--rounds", type=int, default=2, help="rounds of encoding and training")
    parser.add_argument("--steps", type=int, default=1000, help="steps of the optimiser in each round")
    arguments = parser.parse_args()
    licensed = corpus.licensed_clips(arguments.corpus)
    names = [name for name in corpus.list_clips(arguments.corpus) if name in licensed]
    families = sorted({corpus.clip_family(name) for name in names})
    # by the family that is held out; none for the shipped prior
    parameters = {family: network.initial_parameters() for family in ("", *families)}
    if SHIPPED_PRIOR_FILE.exists():
        current = prior.load_shipped_prior()
    else:
        current = network.quantise_prior(parameters[""], np.zeros((0, 5), dtype=np.int32))
    for round_number in range(arguments.rounds):
        examples = {name: collect_examples(arguments.corpus, name, current, round_number) for name in names}
        count = sum(len(labels) for _, labels in examples.values())
        print(f"round {round_number + 1}: {count:,} coefficients of {len(names)} clips")
        for held_out in ("", *families):
            used = [examples[name] for name in names if corpus.clip_family(name) != held_out]
            features, labels = (np.concatenate(arrays) for arrays in zip(*used, strict=True))
            print(f" {'without ' + held_out if held_out else 'all'}", flush=True)
            parameters[held_out] = network.train(features, labels, parameters[held_out], arguments.steps, print)
            trained = network.quantise_prior(parameters[held_out], labels)
            path = HELD_OUT_PRIORS_FOLDER / f"{held_out}.json" if held_out else SHIPPED_PRIOR_FILE
            path.parent.mkdir(exist_ok=True)
            path.write_text(prior.format_prior(trained), encoding="utf-8")
            if not held_out:
                current = trained


if __name__ == "__main__":
    main()
