"""Study of the entropy model: bits on clips of performers that were not trained on, for any number of hidden units.

Usage: `python -m training.entropy_study TRAINING EVALUATION --hidden-units 16 --without FAMILY ...`. Every family of
performers of the folder TRAINING contributes as many blocks. The clips of EVALUATION are encoded with the prior that
saw nothing of their family. The command prints the bits of their magnitudes and signs, relative to that prior.
"""

from __future__ import annotations

import argparse
import json
import zlib
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from bunraku.codec import prior
from bunraku.codec.block_encoder import MEAN_ERROR_REFINEMENT, BlockEncoder, EncodedBlock
from bunraku.codec.motion_track import MotionTrack, plan_motion_track
from bunraku.codec.prior import Prior
from bunraku.codec.step_search import MAX_STEP, MIN_STEP
from bunraku.motion.skeleton import Motion
from training import corpus, network
from training.prior import BLOCK_LENGTHS_S, HELD_OUT_PRIORS_FOLDER, STEP_INDICES, TrainingExamples, read_examples

MEAN_ERRORS_MM = 5.0, 1.0
_EVALUATED_S = 12.0
_HIGH_FRAME_RATE = 90.0
_BLOCKS_PER_CLIP = 8
_MAX_PASSES = 6
"""Limit of the passes over the clips of a family, for families that are too short for their blocks."""


def sampled_motions(folder: Path, clips: list[str], random: np.random.Generator) -> Iterator[Motion]:
    """Generate the clips of a family in random order, half of them mirrored, at 24 to 60 frames per second."""
    for _ in range(_MAX_PASSES):
        for index in random.permutation(len(clips)):
            motion = corpus.load_clip(folder, clips[index])
            if motion.fps > _HIGH_FRAME_RATE:
                motion = corpus.reduce_frame_rate(motion, int(random.choice([2, 3, 4])))
            if motion.frame_count >= _BLOCKS_PER_CLIP:
                yield corpus.mirror_motion(motion) if random.random() < 0.5 else motion


def collect_family(folder: Path, family: str, clips: list[str], blocks: int, current: Prior) -> TrainingExamples:
    """Return the examples of about `blocks` blocks of a family, at random steps."""
    random = np.random.default_rng(zlib.crc32(family.encode()))
    per_clip = max(_BLOCKS_PER_CLIP, -(-blocks // len(clips)))
    examples: list[TrainingExamples] = []
    for motion in sampled_motions(folder, clips, random):
        if len(examples) >= blocks:
            break
        track = plan_motion_track(motion, float(random.choice(BLOCK_LENGTHS_S)))
        encoder = BlockEncoder(track, motion, current)
        for _ in range(min(per_clip, track.block_count * len(STEP_INDICES))):
            index, step = random.integers(track.block_count), random.integers(STEP_INDICES[0], STEP_INDICES[-1])
            encoded = encoder.encode_block(int(index), int(step), MEAN_ERROR_REFINEMENT)
            examples.append(read_examples(track, encoded.data, current))
    return _join(examples)


def encode_near_mean_error(motion: Motion, mean_error_mm: float, current: Prior) -> tuple[MotionTrack, list[bytes]]:
    """Encode all blocks at one step, with a mean error of about `mean_error_mm`."""
    track = plan_motion_track(motion, mean_error_mm=mean_error_mm)
    encoder = BlockEncoder(track, motion, current)
    step, blocks = int(16 * np.log2(mean_error_mm * 2e-3 / 2.0**-16)), list[EncodedBlock]()
    for _ in range(3):
        blocks = [encoder.encode_block(index, step, MEAN_ERROR_REFINEMENT) for index in range(track.block_count)]
        error = float(np.mean([block.errors_mm.mean() for block in blocks]))
        step = int(np.clip(step + round(17 * np.log2(mean_error_mm / max(error, 1e-3))), MIN_STEP, MAX_STEP))
    return track, [block.data for block in blocks]


def load_held_out_prior(clip: str) -> Prior:
    """Return the prior of the benchmarks that saw nothing of a clip's family."""
    path = HELD_OUT_PRIORS_FOLDER / f"{corpus.clip_family(clip)}.json"
    if not path.exists():
        return prior.load_shipped_prior()
    return prior.parse_prior(json.loads(path.read_text(encoding="utf-8")))


def _join(examples: list[TrainingExamples]) -> TrainingExamples:
    features, labels = zip(*examples, strict=True)
    return np.concatenate(features), np.concatenate(labels)


def _count_bits(examples: TrainingExamples, parameters: list[network.Array]) -> float:
    return network.count_magnitude_bits(*examples, parameters) + int((examples[1][:, 3] > 0).sum())


def main() -> None:
    """Run the command."""
    parser = argparse.ArgumentParser(prog="training.entropy_study", description=__doc__)
    parser.add_argument("training", type=Path, help="folder with hanim19/*.npz and CORPUS.csv with a column `family`")
    parser.add_argument("evaluation", type=Path, help="folder with hanim19/*.npz")
    parser.add_argument("--hidden-units", type=int, nargs="+", default=[8, 16, 24])
    parser.add_argument("--steps", type=int, default=1300)
    parser.add_argument("--blocks", type=int, default=120, help="blocks of each family")
    parser.add_argument("--without", nargs="*", default=[], help="families that EVALUATION has too")
    arguments = parser.parse_args()
    current = prior.load_shipped_prior()
    families = corpus.read_performers(arguments.training)
    used = sorted(set(families) - set(arguments.without))
    training = _join(
        [collect_family(arguments.training, name, families[name], arguments.blocks, current) for name in used]
    )
    print(f"{len(training[1]):,} coefficients of {len(used)} families", flush=True)
    evaluation: dict[tuple[float, str], tuple[TrainingExamples, float]] = {}
    for name in corpus.list_clips(arguments.evaluation):
        held_out = load_held_out_prior(name)
        motion = corpus.load_clip(arguments.evaluation, name)
        frames = slice(int(_EVALUATED_S * motion.fps))
        motion = Motion(motion.figure, motion.fps, motion.root[frames], motion.rotations[frames])
        for error in MEAN_ERRORS_MM:
            track, blocks = encode_near_mean_error(motion, error, held_out)
            examples = _join([read_examples(track, block, held_out) for block in blocks])
            evaluation[error, name] = examples, _count_bits(examples, network.to_parameters(held_out))
    for hidden_units in arguments.hidden_units:
        parameters = network.initial_parameters(hidden_units=hidden_units)
        parameters = network.train(*training, parameters, arguments.steps, print)
        for error in MEAN_ERRORS_MM:
            ratios = {
                name: _count_bits(examples, parameters) / bits
                for (of, name), (examples, bits) in evaluation.items()
                if of == error
            }
            mean = float(np.exp(np.mean(np.log(list(ratios.values())))))
            print(f"{hidden_units} hidden units, mean {error:g} mm: {mean:.4f} of the bits of the held-out prior")
            print("  " + ", ".join(f"{name} {ratio:.3f}" for name, ratio in ratios.items()), flush=True)


if __name__ == "__main__":
    main()
