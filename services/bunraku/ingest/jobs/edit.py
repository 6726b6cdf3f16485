"""Job that makes a new motion of a part of a stored one: cut, mirrored, or closed to a loop.

The highest bitrate level is decoded and the result is encoded again. The errors of the new ladder are relative to that
decoded motion, whose own error is at most the bound of its highest level.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from bunraku.codec.audio import SAMPLE_RATE, AudioTrack, EncodedAudio, cut_audio
from bunraku.codec.container import PerformerTracks, StoredMotion, pack_motion
from bunraku.codec.extension.contact import EncodedContacts
from bunraku.codec.extension.encoder import EncodedExtension, encode_extension
from bunraku.codec.extension.props import EncodedProps, PropTrack, ShownState, decode_prop_block, encode_props
from bunraku.codec.extension.track import Extension, ExtensionTrack, decode_extension_block
from bunraku.codec.motion_decoder import decode_motion_block
from bunraku.codec.motion_encoder import EncodedMotion
from bunraku.codec.scene import (
    MAX_FIELD_OF_VIEW_RAD,
    MAX_SCENE_VALUE,
    MIN_FIELD_OF_VIEW_RAD,
    SceneSamples,
    SceneTrack,
)
from bunraku.codec.scene_decoder import decode_scene_block
from bunraku.codec.scene_encoder import EncodedScene, encode_scene
from bunraku.codec.timing import Timing
from bunraku.ingest.jobs.encoding import FIRST_BLOCK_S, describe_encoding, encode_foot_contacts, encode_motions
from bunraku.ingest.result import JobRejection, JobResult
from bunraku.motion.extension import BodyExtension
from bunraku.motion.face import Face
from bunraku.motion.hands import Hands
from bunraku.motion.mirror import (
    mirror_body,
    mirror_face,
    mirror_hands,
    mirror_heading,
    mirror_motion,
    mirror_placement,
    mirror_vectors,
)
from bunraku.motion.rotation import Array
from bunraku.motion.seamless_loop import BLEND_S, close_loop, close_value_loop
from bunraku.motion.skeleton import Motion
from bunraku.wire.messages import Data
from bunraku.wire.prop import PropState


def edit_motion(
    motion_id: str,
    stored: StoredMotion,
    first: int,
    end: int,
    mirror: bool,
    loop: bool,
    on_progress: Callable[[float], None] = lambda _: None,
) -> JobResult | JobRejection:
    """Return frames `first` to `end` - 1 of the first performer, and that time of all other tracks, as a new motion.

    `mirror` exchanges left and right, `loop` closes the part (`seamless_loop`). `on_progress` receives the encoded
    share, 0..1.
    """
    fps = stored.first_track.fps
    start_s, duration_s = first / fps, (end - first) / fps
    motions = [cut_performer(performer, start_s, duration_s, loop) for performer in stored.performers]
    if mirror:
        motions = [mirror_motion(motion) for motion in motions]
    encoded = [
        _place(each, performer, mirror)
        for performer, each in zip(stored.performers, encode_motions(motions, on_progress), strict=True)
    ]
    scenes: list[EncodedScene] = []
    extensions: list[EncodedExtension | EncodedContacts | EncodedProps] = []
    audio: EncodedAudio | None = None
    for number, track in enumerate(stored.tracks):
        if isinstance(track, SceneTrack):
            scene = cut_scene(track, stored.blocks(number)[-1], start_s, duration_s)
            scenes.append(encode_scene(_mirror_scene(scene) if mirror else scene, first_seconds=FIRST_BLOCK_S))
        elif isinstance(track, ExtensionTrack):
            values = cut_extension(track, stored.blocks(number)[-1], start_s, duration_s, loop)
            extension, values = _mirror_extension(track.extension, values) if mirror else (track.extension, values)
            motion = encoded[track.performer]
            errors_mm = [level.mean_error_mm for level in motion.ladder]
            extensions.append(encode_extension(extension, values, motion.track, errors_mm, track.performer))
        elif isinstance(track, PropTrack):
            states = cut_props(track, stored.blocks(number)[0], start_s, duration_s)
            if mirror:
                states = [[_mirror_prop(state) for state in each] for each in states]
            extensions.append(encode_props(track.kinds, states, encoded[track.performer].track, track.performer))
        elif isinstance(track, AudioTrack):
            audio = cut_audio(track, stored.blocks(number), encoded[0].track, round(start_s * SAMPLE_RATE))
    extensions += encode_foot_contacts(motions, encoded)
    description: dict[str, Any] = {
        **describe_encoding(motions[0], encoded[0]),
        "ladders": [each.describe()["rates"] for each in encoded],
        "tracks": [*(["motion"] * len(encoded)), *(scene.track.kind for scene in scenes)],
        "made_from": stored.id,
    }
    if audio is not None:
        rates = audio.describe()["rates"]
        description["tracks"].append("audio")
        description["audio"] = {"seconds": audio.track.samples / SAMPLE_RATE, "rates": rates}
    description["tracks"] += [each.track.kind for each in extensions]
    packed = pack_motion(motion_id, encoded[0], scenes, encoded[1:], extensions, audio)
    return JobResult(packed, description)


def cut_performer(performer: PerformerTracks, start_s: float, duration_s: float, loop: bool) -> Motion:
    """Return a part of a performer's motion from its highest bitrate level; after its end the performer stands still.

    Frames are sampled from `start_s` on, which may be between two frames of this performer.
    """
    track, fps = performer.track, performer.track.fps
    instants, earlier, count = _instants_of(track, start_s, duration_s, loop)
    root, rotations = sample_poses(performer, instants)
    motion = Motion(track.figure, fps, root, rotations)
    return close_loop(motion, earlier, earlier + count) if loop else motion


def cut_extension(track: ExtensionTrack, blocks: list[bytes], start_s: float, duration_s: float, loop: bool) -> Array:
    """Return the values (n, E, 3) of a part of an extension, from the blocks of its highest level."""
    instants, earlier, count = _instants_of(track, start_s, duration_s, loop)
    values = np.concatenate(
        [
            decode_extension_block(track, blocks[index]).values_at(within)
            for index, within in _split_into_blocks(track, instants)
        ]
    )
    return close_value_loop(values, earlier, earlier + count, track.fps) if loop else values


def cut_props(track: PropTrack, blocks: list[bytes], start_s: float, duration_s: float) -> list[list[ShownState]]:
    """Return the states of a part of the props, `states[prop][frame]`."""
    instants, _, _ = _instants_of(track, start_s, duration_s, loop=False)
    states: list[list[ShownState]] = [[] for _ in track.kinds]
    for index, within in _split_into_blocks(track, instants):
        block = decode_prop_block(blocks[index], len(track.kinds), track.frames_in(index))
        frames = np.clip(np.floor(within + 1e-6), 0, block.frames - 1).astype(int)
        for each, shown in zip(states, block.states, strict=True):
            each += [shown[frame] for frame in frames]
    return states


def _mirror_prop(state: ShownState) -> ShownState:
    if state is None:
        return None
    # the hands of a performer have numbers 4 k and 4 k + 1
    return PropState(None if state.limb is None else state.limb ^ 1, mirror_placement(state.place))


def _mirror_extension(extension: Extension, values: Array) -> tuple[Extension, Array]:
    match extension:
        case BodyExtension():
            return mirror_body(extension, values)
        case Hands():
            return mirror_hands(extension, values)
        case Face():
            return mirror_face(extension, values)


def _instants_of(timing: Timing, start_s: float, duration_s: float, loop: bool) -> tuple[Array, int, int]:
    """Return the instants of a part in frames, the number of those before it, and its number of frames."""
    count = max(round(duration_s * timing.fps), 1)
    first_instant = start_s * timing.fps
    # a loop needs the frames before the part, and the one after it
    earlier = min(round(BLEND_S * timing.fps), int(first_instant + 1e-6)) if loop else 0
    later = 1 if loop and first_instant + count <= timing.frames - 1 + 1e-6 else 0
    instants = first_instant + np.arange(-earlier, count + later)
    return np.clip(instants, 0.0, timing.frames - 1.0), earlier, count


def sample_poses(performer: PerformerTracks, instants: Array) -> tuple[Array, Array]:
    """Return root positions (n, 3) and rotations (n, 18, 4) at ascending instants (n,), in frames of the performer."""
    packets = performer.packets[-1]

    def sample_block(index: int, within: Array) -> tuple[Array, Array]:
        return decode_motion_block(performer.track, Data.unpack(packets[index]).block).pose_at(within)

    parts = [sample_block(*part) for part in _split_into_blocks(performer.track, instants)]
    root, rotations = zip(*parts, strict=True)
    return np.concatenate(root), np.concatenate(rotations)


def cut_scene(track: SceneTrack, blocks: list[bytes], start_s: float, duration_s: float) -> SceneSamples:
    """Return a part of a camera or light, from the blocks of its highest level; after its end it stands still."""
    instants = start_s * track.fps + np.arange(max(round(duration_s * track.fps), 1))
    instants = np.clip(instants, 0.0, track.frames - 1.0)
    parts = _split_into_blocks(track, instants)
    values = np.concatenate([decode_scene_block(track, blocks[index]).values_at(within) for index, within in parts])
    # a decoded value may exceed a limit by its error
    values = np.clip(values, -MAX_SCENE_VALUE, MAX_SCENE_VALUE)
    if track.kind == "camera":
        values[:, 6] = np.clip(values[:, 6], MIN_FIELD_OF_VIEW_RAD, MAX_FIELD_OF_VIEW_RAD)
    return SceneSamples(track.kind, track.fps, values)


def _split_into_blocks(timing: Timing, instants: Array) -> list[tuple[int, Array]]:
    """Return the blocks that contain ascending instants (n,), and the instants in frames from the block's first."""
    first_frames = np.array([timing.first_frame(index) for index in range(timing.block_count)])
    # an instant between two blocks belongs to the nearer one
    indices = np.clip(np.searchsorted(first_frames, instants + 0.5, side="right") - 1, 0, timing.block_count - 1)
    return [(index, instants[indices == index] - first_frames[index]) for index in np.unique(indices).tolist()]


def _mirror_scene(scene: SceneSamples) -> SceneSamples:
    values = scene.values.copy()
    values[:, :3] = mirror_vectors(values[:, :3])
    if scene.kind == "camera":
        values[:, 3:6] = mirror_vectors(values[:, 3:6])
    return replace(scene, values=values)


def _place(encoded: EncodedMotion, performer: PerformerTracks, mirror: bool) -> EncodedMotion:
    """Return an encoded part with the front and place of the whole motion."""
    if not mirror:
        return replace(encoded, front=performer.front, placement=performer.placement)
    return replace(encoded, front=mirror_heading(performer.front), placement=mirror_placement(performer.placement))
