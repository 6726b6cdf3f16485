"""Study of the limit: the bits that a much larger entropy model would take for the same coefficients.

Usage: `python -m training.limit_study TRAINING EVALUATION --without FAMILY ...`. For each family of EVALUATION's clips,
a perceptron of two hidden layers learns from the families of the folder TRAINING, except those that EVALUATION has too,
and from the other families of EVALUATION. The clips are encoded with the prior that saw nothing of their family. The
command prints the ideal code length of their coefficients under each model, relative to that prior: the network with
the contexts of the shipped model, with signed neighbours, with the previous block, and mixed with the prior and with
adaptive counters.
"""

from __future__ import annotations

import argparse
import zlib
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import numpy.typing as npt

from bunraku.codec import prior
from bunraku.codec.block_encoder import MEAN_ERROR_REFINEMENT, BlockEncoder
from bunraku.codec.coefficients import decode_coefficients
from bunraku.codec.motion_track import MotionTrack, plan_motion_track
from bunraku.codec.prior import FEATURE_COUNT, Prior
from bunraku.motion.skeleton import Motion
from training import corpus, large_network
from training.block_contexts import CONTEXT_COUNT, NEIGHBOUR_COUNT, CodedBlock, collect_contexts
from training.entropy_study import MEAN_ERRORS_MM, encode_near_mean_error, load_held_out_prior, sampled_motions
from training.large_network import Examples
from training.mixing import count_mixed_bits
from training.prior import BLOCK_LENGTHS_S, read_examples

INPUTS = {
    "contexts of the prior": FEATURE_COUNT,
    "and signed neighbours": FEATURE_COUNT + 2 * NEIGHBOUR_COUNT,
    "and the previous block": FEATURE_COUNT + CONTEXT_COUNT,
}
"""Inputs of each variant of the network: that many of the first ones."""
_STEP_RANGE = 84, 180
"""Steps of the blocks that are learned from: around those of the mean errors."""
_EVALUATED_S = 12.0
_RUN_BLOCKS = 4
"""Successive blocks at one step."""
_WEIGHT_RATES = 0.002, 0.008, 0.02


def collect_blocks(track: MotionTrack, blocks: list[bytes], current: Prior) -> Iterator[Examples]:
    """Generate the examples of successive blocks, each with the contexts of the one before."""
    previous: CodedBlock | None = None
    for data in blocks:
        header, q = decode_coefficients(current, data, track.block_frames, track.fps)
        coded = CodedBlock(q, header.step)
        features, labels = read_examples(track, data, current)
        yield large_network.prepare_examples(current, features, labels, collect_contexts(coded, previous))
        previous = coded


def collect_family(folder: Path, family: str, clips: list[str], count: int, current: Prior) -> list[Examples]:
    """Return the examples of about `count` blocks of a family, in runs at random steps."""
    random = np.random.default_rng(zlib.crc32(family.encode()))
    examples: list[Examples] = []
    for motion in sampled_motions(folder, clips, random):
        track = plan_motion_track(motion, float(random.choice(BLOCK_LENGTHS_S)))
        encoder = BlockEncoder(track, motion, current)
        for _ in range(max(1, count // (_RUN_BLOCKS * len(clips)))):
            if len(examples) >= count:
                return examples
            first, step = int(random.integers(track.block_count)), int(random.integers(*_STEP_RANGE))
            run = range(first, min(first + _RUN_BLOCKS, track.block_count))
            blocks = [encoder.encode_block(index, step, MEAN_ERROR_REFINEMENT).data for index in run]
            examples += collect_blocks(track, blocks, current)
    return examples


def encode_evaluated(folder: Path, clip: str, mean_error_mm: float) -> list[Examples]:
    """Return the examples of the first seconds of a clip, block by block, with its held-out prior."""
    held_out, motion = load_held_out_prior(clip), corpus.load_clip(folder, clip)
    frames = slice(int(_EVALUATED_S * motion.fps))
    motion = Motion(motion.figure, motion.fps, motion.root[frames], motion.rotations[frames])
    track, blocks = encode_near_mean_error(motion, mean_error_mm, held_out)
    return list(collect_blocks(track, blocks, held_out))


def measure(blocks: list[Examples], parameters: list[large_network.Float32]) -> dict[str, float]:
    """Return the bits of some blocks by model: of the prior, the network, its signs alone left out, and mixtures."""
    examples = large_network.join(blocks)
    starts: npt.NDArray[np.int64] = np.cumsum([0, *(len(block.labels) for block in blocks[:-1])])
    corrections = large_network.correct(examples, parameters)
    before = large_network.count_bits(examples, np.zeros_like(corrections))
    after = large_network.count_bits(examples, corrections)
    figures = {"prior": sum(before), "network": sum(after), "signs of the prior": after.magnitudes + before.signs}
    for rate in _WEIGHT_RATES:
        figures[f"mixed, rate {rate:g}"] = count_mixed_bits(examples, corrections, starts, rate) + after.signs
    return figures


def _group_by_family(clips: list[str]) -> dict[str, list[str]]:
    """Return the clips by the family that the benchmarks hold out."""
    return {
        family: [name for name in clips if corpus.clip_family(name) == family]
        for family in sorted(set(map(corpus.clip_family, clips)))
    }


def _without(families: dict[str, list[str]], excluded: list[str]) -> dict[str, list[str]]:
    return {family: families[family] for family in sorted(set(families) - set(excluded))}


def _print_table(error: float, figures: dict[str, dict[str, float]]) -> None:
    """Print the ratios of one mean error: the geometric means over the clips, then each clip."""
    for model in next(iter(figures.values())):
        ratios = {name: bits[model] / bits["prior"] for name, bits in figures.items()}
        mean = float(np.exp(np.mean(np.log(list(ratios.values())))))
        print(f"    mean {error:g} mm, {model}: {mean:.4f}")
        if model == "network":
            print("      " + ", ".join(f"{name} {ratio:.3f}" for name, ratio in ratios.items()), flush=True)


def main() -> None:
    """Run the command."""
    parser = argparse.ArgumentParser(prog="training.limit_study", description=__doc__)
    parser.add_argument("training", type=Path, help="folder with hanim19/*.npz and CORPUS.csv with a column `family`")
    parser.add_argument("evaluation", type=Path, help="folder with hanim19/*.npz and CORPUS.csv")
    parser.add_argument("--hidden-units", type=int, default=128)
    parser.add_argument("--steps", type=int, default=1600)
    parser.add_argument("--blocks", type=int, default=80, help="blocks of each family")
    parser.add_argument("--without", nargs="*", default=[], help="families that EVALUATION has too")
    arguments = parser.parse_args()
    current = prior.load_shipped_prior()
    clips, licensed = corpus.list_clips(arguments.evaluation), corpus.licensed_clips(arguments.evaluation)
    learned = {
        (folder, family): large_network.join(collect_family(folder, family, names, arguments.blocks, current))
        for folder, families in (
            (arguments.training, _without(corpus.read_performers(arguments.training), arguments.without)),
            (arguments.evaluation, _group_by_family([name for name in clips if name in licensed])),
        )
        for family, names in families.items()
    }
    evaluation = {
        error: {name: encode_evaluated(arguments.evaluation, name, error) for name in clips} for error in MEAN_ERRORS_MM
    }
    for variant, inputs in INPUTS.items():
        figures: dict[float, dict[str, dict[str, float]]] = {error: {} for error in MEAN_ERRORS_MM}
        for held_out, names in _group_by_family(clips).items():
            training = large_network.join(
                [examples for key, examples in learned.items() if key != (arguments.evaluation, held_out)]
            )
            parameters = large_network.initial_parameters(inputs, arguments.hidden_units)
            print(f"{variant}, without {held_out}: {sum(p.size for p in parameters):,} parameters", flush=True)
            parameters = large_network.train(training, parameters, arguments.steps, print)
            for error in MEAN_ERRORS_MM:
                figures[error] |= {name: measure(evaluation[error][name], parameters) for name in names}
        for error in MEAN_ERRORS_MM:
            _print_table(error, figures[error])


if __name__ == "__main__":
    main()
