"""Contents of a watched stage: everything that a viewer has received of it, at any instant."""

from __future__ import annotations

from bunraku.codec.audio import AudioPacket, AudioTrack
from bunraku.codec.extension.props import shift_limb
from bunraku.codec.extension.track import Extension, ExtensionPart
from bunraku.codec.motion_track import MotionTrack
from bunraku.codec.scene import SceneTrack
from bunraku.motion.extension import BodyExtension, ExtendedPose, extend_pose
from bunraku.motion.face import EXPRESSION_INDEX, Face, face_expressions
from bunraku.motion.hands import Hands
from bunraku.motion.placement import Placement
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import world_transforms
from bunraku.playout import timeline
from bunraku.playout.audio_store import AudioBlockStore
from bunraku.playout.block_store import MotionBlockStore, Pose
from bunraku.playout.live_buffer import LiveBuffer
from bunraku.playout.overlay_buffer import OverlayBuffer
from bunraku.playout.track_set import TrackSet
from bunraku.wire.messages import CrowdPulls, Presence
from bunraku.wire.prop import Prop, PropState


class WatchedStage:
    """State of a stage as far as it was received. Instants are clock times in microseconds."""

    def __init__(self) -> None:
        self.timeline_history = timeline.TimelineHistory()
        self.presence: Presence | None = None
        self.crowd_pulls: dict[int, CrowdPulls] = {}
        """Newest number and sample of the crowd's pulls of each limb, by number; limbs that nobody pulls have none."""
        self.crowd_turns: set[int] = set()
        """Limbs of the policy `turns` that follow this viewer's pull now."""
        self.motion: str | None = None
        self._tracks: TrackSet | None = None
        self._overlays = OverlayBuffer()
        self._live: dict[int, LiveBuffer] = {}

    @property
    def track(self) -> MotionTrack | None:
        """Track of the first performer, None before its Description."""
        return self._blocks.track if self._blocks is not None else None

    @property
    def scenes(self) -> list[SceneTrack]:
        """Announced camera and light tracks."""
        return [store.track for store in self._tracks.scenes] if self._tracks is not None else []

    @property
    def _blocks(self) -> MotionBlockStore | None:
        return self._tracks.first_performer if self._tracks is not None else None

    @property
    def _audio(self) -> AudioBlockStore | None:
        return self._tracks.audio if self._tracks is not None else None

    @property
    def performers(self) -> list[MotionTrack | None]:
        """Tracks of the performers, None for one that cannot be decoded."""
        stores = self._tracks.performers if self._tracks is not None else []
        return [store.track if store is not None else None for store in stores]

    def pose_at(self, reference: int, performer: int = 0) -> Pose | None:
        """Return the merged pose of a performer at clock time `reference`, or None if its block is missing."""
        state, tracks = self.timeline_history.at(reference), self._tracks
        if state is None or tracks is None or state.motion != self.motion or performer >= len(tracks.performers):
            return None
        live, store = self._live.get(performer), tracks.performers[performer]
        pose = live.pose_at(reference) if live is not None else None
        if pose is None and store is not None:
            pose = store.pose_at(timeline.position_at(state, reference), state.loop, state.duration)
        if pose is None:
            return None
        root, rotations = tracks.placements[performer].apply(*pose)
        return root, self._overlays.apply(rotations, reference, performer)

    def extended_pose_at(self, reference: int, performer: int = 0) -> ExtendedPose | None:
        """Return the world positions and orientations of all joints of a performer, of the extension too.

        None if the motion has no extension of the performer, or a block is missing. The arrays have one instant.
        """
        tracks, pose = self._tracks, self.pose_at(reference, performer)
        motion = tracks.performers[performer] if pose is not None and tracks is not None else None
        found = self._extension_values(reference, performer, ExtensionPart.BODY)
        if pose is None or motion is None or found is None:
            return None
        extension, values = found
        assert isinstance(extension, BodyExtension)
        figure = motion.track.figure
        placed = world_transforms(figure, pose[0][None], pose[1][None])
        return extend_pose(figure, extension, *placed, values[None])

    def fingers_at(self, reference: int, performer: int = 0) -> tuple[Hands, Array] | None:
        """Return the fingers of a performer, and the rotation vectors (E, 3) of their joints, in radians.

        Each is in the frame of the joint before, at first of the wrist; `motion.hands.pose_hands` places the joints.
        None if the motion has no fingers of the performer, or a block is missing.
        """
        found = self._extension_values(reference, performer, ExtensionPart.FINGERS)
        if found is None:
            return None
        hands, values = found
        assert isinstance(hands, Hands)
        return hands, values

    def expressions_at(self, reference: int, performer: int = 0) -> dict[str, float]:
        """Return the weights of a performer's expressions: those of ARKit, the presets of VRM, and gaze in radians.

        Empty if the motion has no face of the performer, or a block is missing.
        """
        found = self._extension_values(reference, performer, ExtensionPart.FACE)
        if found is None:
            return {}
        face, values = found
        assert isinstance(face, Face)
        weights = face_expressions(face, values[None])[0]
        return {name: float(weights[EXPRESSION_INDEX[name]]) for name in face.names}

    def contacts_at(self, reference: int, performer: int = 0) -> tuple[bool, bool] | None:
        """Return whether a performer's left and right foot are planted in the motion at clock time `reference`.

        None if it is not known: the performer is live, the motion has no contacts of it, or a block is missing.
        """
        state, tracks = self.timeline_history.at(reference), self._tracks
        if state is None or tracks is None or state.motion != self.motion:
            return None
        live, store = self._live.get(performer), tracks.contacts.get(performer)
        if store is None or (live is not None and live.pose_at(reference) is not None):
            return None
        contacts = store.contacts_at(timeline.position_at(state, reference))
        return None if contacts is None else (bool(contacts[0]), bool(contacts[1]))

    def props_at(self, reference: int) -> list[Prop]:
        """Return the props of the session, in the order of their numbers, then those of the motion at `reference`."""
        entries = (self.presence.props if self.presence is not None else None) or []
        props = [Prop(entry["kind"], PropState(entry["limb"], Placement.parse(entry["place"]))) for entry in entries]
        state, tracks = self.timeline_history.at(reference), self._tracks
        if state is None or tracks is None or state.motion != self.motion:
            return props
        for store in tracks.props.values():
            shown = store.states_at(timeline.position_at(state, reference)) or ()
            states = (shift_limb(each, store.track.performer) for each in shown)
            props += [Prop(kind, each) for kind, each in zip(store.track.kinds, states, strict=False) if each]
        return props

    def _extension_values(self, reference: int, performer: int, part: ExtensionPart) -> tuple[Extension, Array] | None:
        """Return an extension and its values at `reference`; None if there is none, or a block is missing."""
        state, tracks = self.timeline_history.at(reference), self._tracks
        if state is None or tracks is None or state.motion != self.motion:
            return None
        live, store = self._live.get(performer), tracks.extensions.get((performer, part))
        if store is None or (live is not None and live.pose_at(reference) is not None):
            return None
        values = store.values_at(timeline.position_at(state, reference), state.loop, state.duration)
        return None if values is None else (store.track.extension, values)

    def extension_of(self, performer: int = 0) -> BodyExtension | None:
        """Return the extension of a performer, None if there is none."""
        store = self._tracks.extensions.get((performer, ExtensionPart.BODY)) if self._tracks is not None else None
        return store.track.extension if store is not None else None  # type: ignore[return-value]

    def scene_at(self, reference: int, scene: int = 0) -> Array | None:
        """Return the seven values (7,) of the camera or light `scenes[scene]` at `reference`, or None
        (proto/codec.md, 2.14)."""
        state = self.timeline_history.at(reference)
        if state is None or self._tracks is None or state.motion != self.motion or not 0 <= scene < len(self.scenes):
            return None
        store = self._tracks.scenes[scene]
        return store.values_at(timeline.position_at(state, reference), state.loop, state.duration)

    def camera_at(self, reference: int) -> Array | None:
        """Return `scene_at` of the motion's camera: the first one."""
        kinds = [track.kind for track in self.scenes]
        return self.scene_at(reference, kinds.index("camera")) if "camera" in kinds else None

    @property
    def audio(self) -> AudioTrack | None:
        """Audio track of the motion, None if there is none that can be decoded."""
        return self._audio.track if self._audio is not None else None

    def audio_buffered_us(self, reference: int) -> int:
        """Return the gapless audio buffered from clock time `reference` on, microseconds."""
        state = self.timeline_history.at(reference)
        if state is None or self._audio is None or state.motion != self.motion:
            return 0
        return self._audio.buffered_us(timeline.position_at(state, reference), state.loop)

    def packets_from(self, reference: int) -> list[AudioPacket]:
        """Return the gapless Opus packets from clock time `reference` to the end of the motion at most.

        `audio.first_sample` gives the start of each.
        """
        state = self.timeline_history.at(reference)
        if state is None or self._audio is None or state.motion != self.motion:
            return []
        return self._audio.packets_from(timeline.position_at(state, reference))

    def _bitrate_at(self, reference: int) -> float:
        """Return the bitrate of the level shown at `reference`, 0 if the block is missing."""
        state = self.timeline_history.at(reference)
        if state is None or self._tracks is None:
            return 0.0
        performer, kbps = self._tracks.first_performer, self._tracks.kbps
        level = performer.level(performer.track.block_at(timeline.position_at(state, reference)))
        return kbps[level] if 0 <= level < len(kbps) else 0.0
