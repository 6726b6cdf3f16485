"""The tracks of a stream that are known here: the dance, and the sound, the cameras and the lights beside it."""

from __future__ import annotations

import contextlib
from collections.abc import Sequence
from typing import Any

from bunraku.codec.audio import parse_audio_track
from bunraku.codec.errors import DamagedBlock
from bunraku.codec.motion_track import parse_motion_track
from bunraku.codec.scene import parse_scene_track
from bunraku.motion.placement import STAGE_CENTRE, Placement
from bunraku.playout.audio_store import AudioBlockStore
from bunraku.playout.block_store import MotionBlockStore, SceneBlockStore
from bunraku.wire.limbs import MAX_PERFORMERS

AnyBlockStore = MotionBlockStore | SceneBlockStore | AudioBlockStore


class TrackSet:
    """Of one motion."""

    def __init__(self, descriptions: Sequence[dict[str, Any]]) -> None:
        """`described` are the tracks of a Description; those of a type or codec that is not known here are skipped.
        Raises `DamagedBlock` where there is no motion among them that can be played here."""
        number = next((n for n, track in enumerate(descriptions) if track.get("type") == "motion"), None)
        if number is None:
            kinds = ", ".join(str(track.get("type")) for track in descriptions) or "nothing"
            raise DamagedBlock(f"the stream has no motion track in it, only {kinds}: there is no dance to show")
        self.first_performer = MotionBlockStore(parse_motion_track(descriptions[number]))
        """The first performer's."""
        self.performers: list[MotionBlockStore | None] = []
        """The dances of the performers, in the Description's order; None of one that cannot be played here."""
        self.placements: list[Placement] = []
        """Where they dance."""
        self.kbps = [float(rate.get("kbps", 0.0)) for rate in descriptions[number].get("rates", [])]
        """What each rate of the dance costs, kbit/s."""
        self.scenes: list[SceneBlockStore] = []
        """Cameras and lights, in the Description's order."""
        self.audio: AudioBlockStore | None = None
        """None where there is none that can be heard here: the first of the Description."""
        self.described_count = 0
        """How many tracks were told of."""
        self._stores: dict[int, AnyBlockStore] = {number: self.first_performer}
        self.add(0, descriptions)
        if self.performers[0] is None:
            raise DamagedBlock(f"of track {number}: {descriptions[number].get('place')!r} is no place to dance at")

    def add(self, first: int, descriptions: Sequence[dict[str, Any]]) -> None:
        """Take in the tracks from number `first` on that were not told of yet: a narrow line may bring them after the
        first blocks."""
        for number, track in enumerate(descriptions, first):
            if number < self.described_count:
                continue
            with contextlib.suppress(DamagedBlock):
                if track.get("type") == "motion":
                    self._add_performer(number, track)
                elif track.get("type") in ("camera", "light"):
                    self._stores[number] = scene = SceneBlockStore(parse_scene_track(track))
                    self.scenes.append(scene)
                elif track.get("type") == "audio" and self.audio is None:
                    self._stores[number] = self.audio = AudioBlockStore(
                        parse_audio_track(track, self.first_performer.track)
                    )
        self.described_count = max(self.described_count, first + len(descriptions))

    def _add_performer(self, number: int, track: dict[str, Any]) -> None:
        if len(self.performers) == MAX_PERFORMERS:
            return
        # whoever cannot be shown keeps the number, and the limbs by which the others are called
        self.performers.append(None)
        self.placements.append(STAGE_CENTRE)
        try:
            self.placements[-1] = Placement.parse(track.get("place", STAGE_CENTRE))
        except ValueError as error:
            raise DamagedBlock(f"of track {number}: {error}") from None
        store = self._stores.get(number) or MotionBlockStore(parse_motion_track(track))
        assert isinstance(store, MotionBlockStore)
        self._stores[number] = self.performers[-1] = store

    def store(self, track: int) -> AnyBlockStore | None:
        """What keeps the blocks of the track of this number, None where it is not known here."""
        return self._stores.get(track)
