"""The sound a viewer holds, and the packets to be decoded from any instant on (SPEC.md, Audio block)."""

from __future__ import annotations

from dataclasses import dataclass

from bunraku.codec.audio import PACKET, SAMPLE_RATE, AudioTrack, Packet, unpack_audio
from bunraku.codec.errors import DamagedBlock
from bunraku.playout.blocks import Store


@dataclass(frozen=True, slots=True)
class AudioBlock:
    """A block of `frames` frames of the motion, and the packets that start in it."""

    frames: int
    packets: list[Packet]


class AudioStore(Store[AudioTrack, AudioBlock]):
    """Blocks of one audio track, of each the best rate that came."""

    def keep(self, index: int, rate: int, data: bytes) -> bool:
        """As `put`, of a block's bytes; raises `DamagedBlock` for what cannot be one of this track."""
        packets = unpack_audio(data)
        if packets and packets[-1].number >= self.track.packets:
            raise DamagedBlock(f"this audio has {self.track.packets} packets, and none of number {packets[-1].number}")
        return self.put(index, rate, AudioBlock(self.track.frames_in(index), packets))

    def packets_from(self, position: int) -> list[Packet]:
        """The packets that are here without a gap, from the one that is heard at motion time `position`, microseconds,
        to the end of the motion at most."""
        heard = (position * SAMPLE_RATE // 1_000_000 + self.track.pre_skip) // PACKET
        found: list[Packet] = []
        # a packet sounds on beyond its block's end, and a block may be shorter than it
        for index in range(self.track.block_of(heard), self.track.blocks):
            if index not in self._blocks:
                break
            for packet in self._blocks[index][1].packets:
                if packet.number == heard + len(found):
                    found.append(packet)
        return found
