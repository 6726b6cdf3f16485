"""The sound a viewer holds, and the packets to be decoded from any instant on (SPEC.md, Audio block)."""

from __future__ import annotations

from dataclasses import dataclass

from bunraku.codec.audio import PACKET_SAMPLES, SAMPLE_RATE, AudioPacket, AudioTrack, unpack_audio_block
from bunraku.codec.errors import DamagedBlock
from bunraku.playout.block_store import TrackBlockStore


@dataclass(frozen=True, slots=True)
class AudioBlock:
    """A block of `frames` frames of the motion, and the packets that start in it."""

    frames: int
    packets: list[AudioPacket]


class AudioBlockStore(TrackBlockStore[AudioTrack, AudioBlock]):
    """Blocks of one audio track, of each the best rate that came."""

    def put_encoded(self, index: int, level: int, data: bytes) -> bool:
        """As `put`, of a block's bytes; raises `DamagedBlock` for what cannot be one of this track."""
        packets = unpack_audio_block(data)
        if packets and packets[-1].number >= self.track.packet_count:
            raise DamagedBlock(
                f"this audio has {self.track.packet_count} packets, and none of number {packets[-1].number}"
            )
        return self.put(index, level, AudioBlock(self.track.frames_in(index), packets))

    def packets_from(self, position: int) -> list[AudioPacket]:
        """The packets that are here without a gap, from the one that is heard at motion time `position`, microseconds,
        to the end of the motion at most."""
        heard = (position * SAMPLE_RATE // 1_000_000 + self.track.pre_skip) // PACKET_SAMPLES
        found: list[AudioPacket] = []
        # a packet sounds on beyond its block's end, and a block may be shorter than it
        for index in range(self.track.block_of_packet(heard), self.track.block_count):
            if index not in self._blocks:
                break
            for packet in self._blocks[index][1].packets:
                if packet.number == heard + len(found):
                    found.append(packet)
        return found
