"""The tracks of a stream that are known here: the dance, and the sound, the cameras and the lights beside it."""

from __future__ import annotations

import contextlib
from collections.abc import Sequence
from typing import Any

from bunraku.codec.audio import read_audio
from bunraku.codec.errors import DamagedBlock
from bunraku.codec.scene import read_scene
from bunraku.codec.track import read_track
from bunraku.motion.place import MIDDLE, Place
from bunraku.playout.blocks import BlockStore, SceneStore
from bunraku.playout.sounds import AudioStore
from bunraku.wire.limbs import MOST_PERFORMERS

TrackStore = BlockStore | SceneStore | AudioStore


class Tracks:
    """Of one motion."""

    def __init__(self, described: Sequence[dict[str, Any]]) -> None:
        """`described` are the tracks of a Description; those of a type or codec that is not known here are skipped.
        Raises `DamagedBlock` where there is no motion among them that can be played here."""
        number = next((n for n, track in enumerate(described) if track.get("type") == "motion"), None)
        if number is None:
            kinds = ", ".join(str(track.get("type")) for track in described) or "nothing"
            raise DamagedBlock(f"the stream has no motion track in it, only {kinds}: there is no dance to show")
        self.dance = BlockStore(read_track(described[number]))
        """The first performer's."""
        self.performers: list[BlockStore | None] = []
        """The dances of the performers, in the Description's order; None of one that cannot be played here."""
        self.places: list[Place] = []
        """Where they dance."""
        self.kbps = [float(rate.get("kbps", 0.0)) for rate in described[number].get("rates", [])]
        """What each rate of the dance costs, kbit/s."""
        self.scenes: list[SceneStore] = []
        """Cameras and lights, in the Description's order."""
        self.sound: AudioStore | None = None
        """None where there is none that can be heard here: the first of the Description."""
        self.told = 0
        """How many tracks were told of."""
        self._stores: dict[int, TrackStore] = {number: self.dance}
        self.add(0, described)
        if self.performers[0] is None:
            raise DamagedBlock(f"of track {number}: {described[number].get('place')!r} is no place to dance at")

    def add(self, first: int, described: Sequence[dict[str, Any]]) -> None:
        """Take in the tracks from number `first` on that were not told of yet: a narrow line may bring them after the
        first blocks."""
        for number, track in enumerate(described, first):
            if number < self.told:
                continue
            with contextlib.suppress(DamagedBlock):
                if track.get("type") == "motion":
                    self._perform(number, track)
                elif track.get("type") in ("camera", "light"):
                    self._stores[number] = scene = SceneStore(read_scene(track))
                    self.scenes.append(scene)
                elif track.get("type") == "audio" and self.sound is None:
                    self._stores[number] = self.sound = AudioStore(read_audio(track, self.dance.track))
        self.told = max(self.told, first + len(described))

    def _perform(self, number: int, track: dict[str, Any]) -> None:
        if len(self.performers) == MOST_PERFORMERS:
            return
        # whoever cannot be shown keeps the number, and the limbs by which the others are called
        self.performers.append(None)
        self.places.append(MIDDLE)
        try:
            self.places[-1] = Place.read(track.get("place", MIDDLE))
        except ValueError as error:
            raise DamagedBlock(f"of track {number}: {error}") from None
        store = self._stores.get(number) or BlockStore(read_track(track))
        assert isinstance(store, BlockStore)
        self._stores[number] = self.performers[-1] = store

    def store(self, track: int) -> TrackStore | None:
        """What keeps the blocks of the track of this number, None where it is not known here."""
        return self._stores.get(track)
