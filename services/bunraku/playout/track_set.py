"""Tracks of a stream that a viewer can play: performers and their extensions, audio, cameras and lights."""

from __future__ import annotations

import contextlib
from collections.abc import Sequence
from typing import Any

from bunraku.codec.audio import parse_audio_track
from bunraku.codec.errors import DamagedBlock
from bunraku.codec.extension.contact import parse_contact_track
from bunraku.codec.extension.props import parse_prop_track
from bunraku.codec.extension.track import EXTENSION_TYPE, ExtensionPart, parse_extension_track
from bunraku.codec.motion_track import parse_motion_track
from bunraku.codec.scene import parse_scene_track
from bunraku.motion.placement import STAGE_CENTRE, Placement
from bunraku.playout.audio_store import AudioBlockStore
from bunraku.playout.block_store import (
    ContactBlockStore,
    ExtensionBlockStore,
    MotionBlockStore,
    PropBlockStore,
    SceneBlockStore,
)
from bunraku.wire.limbs import MAX_PERFORMERS

AnyBlockStore = (
    MotionBlockStore | SceneBlockStore | AudioBlockStore | ExtensionBlockStore | ContactBlockStore | PropBlockStore
)


class TrackSet:
    """Block stores of one motion's tracks."""

    def __init__(self, descriptions: Sequence[dict[str, Any]]) -> None:
        """Create the stores for the tracks of a Description; tracks of an unknown type or codec are skipped.

        Raises `DamagedBlock` if there is no motion track that can be played.
        """
        number = next((n for n, track in enumerate(descriptions) if track.get("type") == "motion"), None)
        if number is None:
            types = ", ".join(str(track.get("type")) for track in descriptions) or "none"
            raise DamagedBlock(f"The stream has no motion track (types of its tracks: {types})")
        self.first_performer = MotionBlockStore(parse_motion_track(descriptions[number]))
        """Store of the first performer."""
        self.performers: list[MotionBlockStore | None] = []
        """Stores of the performers, in the Description's order; None for one that cannot be played."""
        self.placements: list[Placement] = []
        """Placements of the performers on the stage."""
        self.kbps = [float(level.get("kbps", 0.0)) for level in descriptions[number].get("rates", [])]
        """Bitrate of each level of the first performer, kbit/s."""
        self.scenes: list[SceneBlockStore] = []
        """Cameras and lights, in the Description's order."""
        self.extensions: dict[tuple[int, ExtensionPart], ExtensionBlockStore] = {}
        """Extensions by index and part of the performer."""
        self.contacts: dict[int, ContactBlockStore] = {}
        """Contacts of the feet by index of the performer."""
        self.props: dict[int, PropBlockStore] = {}
        """Props of the motion by index of the performer whose limbs come first."""
        self.audio: AudioBlockStore | None = None
        """Store of the first audio track that can be played, if any."""
        self.described_count = 0
        """Number of tracks that were described."""
        self._stores: dict[int, AnyBlockStore] = {number: self.first_performer}
        self.add(0, descriptions)
        if self.performers[0] is None:
            raise DamagedBlock(f"Track {number} has an invalid placement: {descriptions[number].get('place')!r}")

    def add(self, first: int, descriptions: Sequence[dict[str, Any]]) -> None:
        """Add the tracks from index `first` on that were not described yet.

        On a constrained link they are described after the first blocks.
        """
        for number, track in enumerate(descriptions, first):
            if number < self.described_count:
                continue
            with contextlib.suppress(DamagedBlock):
                if track.get("type") == "motion":
                    self._add_performer(number, track)
                elif track.get("type") in ("camera", "light"):
                    self._stores[number] = scene = SceneBlockStore(parse_scene_track(track))
                    self.scenes.append(scene)
                elif track.get("type") == EXTENSION_TYPE and track.get("part") == ExtensionPart.CONTACTS:
                    contacts = ContactBlockStore(parse_contact_track(track))
                    self._stores[number] = self.contacts.setdefault(contacts.track.performer, contacts)
                elif track.get("type") == EXTENSION_TYPE and track.get("part") == ExtensionPart.PROPS:
                    props = PropBlockStore(parse_prop_track(track))
                    self._stores[number] = self.props.setdefault(props.track.performer, props)
                elif track.get("type") == EXTENSION_TYPE:
                    extension = ExtensionBlockStore(parse_extension_track(track))
                    key = extension.track.performer, extension.track.part
                    self._stores[number] = self.extensions.setdefault(key, extension)
                elif track.get("type") == "audio" and self.audio is None:
                    self._stores[number] = self.audio = AudioBlockStore(
                        parse_audio_track(track, self.first_performer.track)
                    )
        self.described_count = max(self.described_count, first + len(descriptions))

    def _add_performer(self, number: int, track: dict[str, Any]) -> None:
        if len(self.performers) == MAX_PERFORMERS:
            return
        # a performer that cannot be played keeps its number, by which the limbs of the others are addressed
        self.performers.append(None)
        self.placements.append(STAGE_CENTRE)
        try:
            self.placements[-1] = Placement.parse(track.get("place", STAGE_CENTRE))
        except ValueError as error:
            raise DamagedBlock(f"Track {number} has an invalid placement: {error}") from None
        store = self._stores.get(number) or MotionBlockStore(parse_motion_track(track))
        assert isinstance(store, MotionBlockStore)
        self._stores[number] = self.performers[-1] = store

    def store(self, track: int) -> AnyBlockStore | None:
        """Return the store of the track with this index, None if it cannot be played."""
        return self._stores.get(track)
