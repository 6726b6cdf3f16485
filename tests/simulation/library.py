"""Encoded motions that all simulations of a process share: encoding them takes a second."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any

import msgpack

from bunraku.codec.container import StoredMotion, pack_motion, unpack_motion
from bunraku.codec.motion_decoder import MotionBlock, decode_motion_block
from bunraku.codec.motion_encoder import encode_motion
from bunraku.codec.motion_track import MotionTrack, parse_motion_track
from bunraku.ingest.job_process import JobKind
from bunraku.ingest.result import JobResult
from bunraku.marionette.solver.limb_solver import LimbSolver
from bunraku.session.limb_solver import load_compiled_solver
from bunraku.session.pose_cache import shared_block_store
from bunraku.session.stage import load_bend_tables
from bunraku.storage.motion_id import derive_motion_id
from bunraku.wire.messages import Data
from tests.vectors.blocks import random_motion

STORED_MOTIONS = ("one", "two", "three")
"""Motions that exist from the start."""
SOURCE_FILES = tuple(f"motion file {number}".encode() for number in range(3))
"""Files that are uploaded."""


@dataclass(frozen=True)
class Library:
    """Motions by id, packed and unpacked, with all blocks decoded."""

    packed: dict[str, bytes]
    motions: dict[str, StoredMotion]
    blocks: dict[bytes, MotionBlock]
    """Decoded blocks by their bytes."""
    tracks: dict[bytes, MotionTrack]
    """Tracks by their packed descriptions."""
    encoded: Any
    """An encoded motion, the result of every recording."""
    solver: LimbSolver
    kept: tuple[object, ...]

    def unpack(self, motion_id: str, packed: bytes) -> StoredMotion:
        """Return what `unpack_motion` returns."""
        known = self.motions.get(motion_id)
        return known if known is not None else unpack_motion(motion_id, packed)

    def decode(self, track: MotionTrack, block: bytes) -> MotionBlock:
        """Return what `decode_motion_block` returns."""
        known = self.blocks.get(block)
        return known if known is not None else decode_motion_block(track, block)

    def parse_track(self, description: dict[str, Any]) -> MotionTrack:
        """Return what `parse_motion_track` returns."""
        key = msgpack.packb(description)
        if key not in self.tracks:
            self.tracks[key] = parse_motion_track(description)
        return self.tracks[key]

    def job_result(self, kind: JobKind, motion_id: str) -> JobResult:
        """Return the result of a job that ingests a file or a recording."""
        if kind is JobKind.RECORDING:
            return JobResult(pack_motion(motion_id, self.encoded), {"kept_from": STORED_MOTIONS[0]})
        return JobResult(self.packed[motion_id], {"kind": kind.value})


def source_motion_id(source: bytes) -> str:
    """Return the id of the motion that a file becomes."""
    return derive_motion_id(hashlib.sha256(source).digest())


@cache
def load_library() -> Library:
    """Encode the motions."""
    packed: dict[str, bytes] = {}
    motions: dict[str, StoredMotion] = {}
    blocks: dict[bytes, MotionBlock] = {}
    kept: list[object] = []
    encoded = None
    for seed, motion_id in enumerate((*STORED_MOTIONS, *map(source_motion_id, SOURCE_FILES))):
        encoded = encode_motion(random_motion(1.4 + 0.3 * seed, 30.0, seed), error_bounds_mm=(30.0, 5.0), grade="live")
        packed[motion_id] = pack_motion(motion_id, encoded)
        motions[motion_id] = motion = unpack_motion(motion_id, packed[motion_id])
        load_bend_tables(motion)
        for performer in motion.performers:
            store = shared_block_store(performer.track)
            kept.append(store)
            for level in performer.packets:
                for packet in map(Data.unpack, level):
                    block = blocks[packet.block] = decode_motion_block(performer.track, packet.block)
                    store.put(packet.index, packet.rate, block)
    return Library(packed, motions, blocks, {}, encoded, load_compiled_solver(), tuple(kept))


Patches = dict[str, Callable[..., Any]]


def library_patches(library: Library) -> Patches:
    """Return replacements of pure functions by their known results, by the name that is to be patched."""
    return {
        "bunraku.storage.motion_store.unpack_motion": library.unpack,
        "bunraku.client.viewer.decode_motion_block": library.decode,
        "bunraku.playout.track_set.parse_motion_track": library.parse_track,
    }
