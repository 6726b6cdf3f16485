"""Job that records a session: replays its log over the played motion and encodes the result."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from bunraku.codec.container import StoredMotion, pack_motion
from bunraku.codec.extension.contact import EncodedContacts
from bunraku.codec.extension.encoder import EncodedExtension, encode_extension
from bunraku.codec.extension.props import EncodedProps, ShownState, encode_props
from bunraku.codec.motion_encoder import EncodedMotion
from bunraku.codec.scene import SceneSamples
from bunraku.codec.scene_encoder import encode_scene
from bunraku.codec.timing import Timing
from bunraku.ingest.jobs.encoding import FIRST_BLOCK_S, describe_encoding, encode_foot_contacts, encode_motions
from bunraku.ingest.jobs.replay import MissingMotion, SessionReplay, extensions_of, props_of
from bunraku.ingest.result import NOTHING_TO_KEEP, JobRejection, JobResult
from bunraku.messaging.recording_request import RECORDING_FPS, RecordingRequest
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import Motion
from bunraku.playout.session_log import CorruptSessionLog, SessionLog
from bunraku.wire.limbs import LIMBS
from bunraku.wire.prop import MAX_PROPS, PropState


def encode_recording(
    motion_id: str,
    request: RecordingRequest,
    packed_log: bytes,
    motions: dict[str, StoredMotion],
    on_progress: Callable[[float], None] = lambda _: None,
) -> JobResult | JobRejection:
    """Replay a session log as requested and encode what viewers saw.

    `motions` are the motions that the session played, by id. If the session changed its motion in the interval, the
    recording begins at the last change. `on_progress` receives the encoded share, 0..1.
    """
    session = SessionReplay(SessionLog.unpack(packed_log), motions)
    times = [request.begin + round(frame * 1e6 / RECORDING_FPS) for frame in range(request.frame_count)]
    states = [session.timeline_at(time) for time in times]
    last_state = states[-1]
    if last_state is None:
        return JobRejection(NOTHING_TO_KEEP, "the session played no motion in this interval", field="seconds")
    is_other_motion = [state is None or state.motion != last_state.motion for state in states]
    times = times[1 + max((frame for frame, is_other in enumerate(is_other_motion) if is_other), default=-1) :]
    try:
        # each of these times has a timeline and thus poses
        poses = [pose for pose in session.replay_poses(times) if pose is not None]
    except (MissingMotion, CorruptSessionLog) as error:
        return JobRejection("Cannot be replayed", str(error))
    played = motions[last_state.motion]
    recorded = [
        Motion(performer.track.figure, float(RECORDING_FPS), *(np.stack(part) for part in zip(*each, strict=True)))
        for performer, each in zip(played.performers, zip(*poses, strict=True), strict=True)
    ]
    try:
        scenes = (
            [encode_scene(sample_camera(request.camera_keyframes, times), first_seconds=FIRST_BLOCK_S)]
            if request.camera
            else []
        )
    except ValueError as error:
        return JobRejection("Invalid camera", str(error), field="camera")
    # the front of the played motion: control of a hand does not turn the performer
    encoded, *others = [
        replace(each, front=performer.front, placement=performer.placement)
        for performer, each in zip(played.performers, encode_motions(recorded, on_progress), strict=True)
    ]
    extensions: list[EncodedExtension | EncodedContacts | EncodedProps] = [
        *_record_extensions(session, played, times, [encoded, *others]),
        *encode_foot_contacts(recorded, [encoded, *others]),
        *_record_props(session, played, times, encoded.track),
    ]
    return JobResult(
        pack_motion(motion_id, encoded, scenes, others, extensions),
        {
            **describe_encoding(recorded[0], encoded),
            "tracks": [
                *(["motion"] * len(recorded)),
                *(scene.track.kind for scene in scenes),
                *(each.track.kind for each in extensions),
            ],
            **({"performers": len(recorded)} if others else {}),
            "kept_from": played.id,
        },
    )


def _record_extensions(
    session: SessionReplay, played: StoredMotion, times: Sequence[int], recorded: Sequence[EncodedMotion]
) -> list[EncodedExtension]:
    """Encode the extensions of the played motion as they were shown; `recorded` are its performers."""
    states = [session.timeline_at(time) for time in times]
    encoded = []
    for extension in extensions_of(played):
        performer = extension.track.performer
        shown = [
            extension.values_at(state, time) for state, time in zip(states, times, strict=True) if state is not None
        ]
        motion = recorded[performer]
        mean_errors_mm = [level.mean_error_mm for level in motion.ladder]
        values = np.stack(shown)
        encoded.append(encode_extension(extension.track.extension, values, motion.track, mean_errors_mm, performer))
    return encoded


def _record_props(
    session: SessionReplay, played: StoredMotion, times: Sequence[int], timing: Timing
) -> list[EncodedProps]:
    """Encode the props of the session, and those of the played motion as far as there is room for them."""
    limb_count = len(LIMBS) * len(played.performers)
    own: dict[tuple[int, str], list[ShownState]] = {}
    stored: dict[tuple[int, int], list[ShownState]] = {}
    tracks = props_of(played)
    for frame, time in enumerate(times):
        state = session.timeline_at(time)
        assert state is not None
        for number, prop in session.session_props_at(time).items():
            # another kind of the same number is another prop
            own.setdefault((number, prop.kind), _new_states(times))[frame] = _as_shown(prop.state, limb_count)
        for index, track in enumerate(tracks):
            for number, shown in enumerate(track.states_at(state, time)):
                stored.setdefault((index, number), _new_states(times))[frame] = shown
    kinds = [kind for _, kind in own] + [tracks[index].track.kinds[number] for index, number in stored]
    if not kinds:
        return []
    return [encode_props(kinds[:MAX_PROPS], [*own.values(), *stored.values()][:MAX_PROPS], timing)]


def _new_states(times: Sequence[int]) -> list[ShownState]:
    return [None] * len(times)


def _as_shown(state: PropState, limb_count: int) -> PropState:
    """Return the state of a prop; one in a hand that is not on the stage lies where it lay before."""
    return state if state.limb is None or state.limb < limb_count else state._replace(limb=None)


def sample_camera(keys: Array, times: Sequence[int]) -> SceneSamples:
    """Sample a camera with keyframes (n, 8) at clock `times`: linear in between, constant before and after them.

    Raise ValueError for invalid values.
    """
    values = np.stack([np.interp(np.array(times, dtype=np.float64), keys[:, 0], column) for column in keys.T[1:]], 1)
    return SceneSamples("camera", float(RECORDING_FPS), values)
