"""Audio blocks that a viewer holds, and the packets to decode from any position (proto/codec.md, 2.15)."""

from __future__ import annotations

from dataclasses import dataclass

from bunraku.codec.audio import PACKET_SAMPLES, SAMPLE_RATE, AudioPacket, AudioTrack, unpack_audio_block
from bunraku.codec.errors import DamagedBlock
from bunraku.playout.block_store import TrackBlockStore


@dataclass(frozen=True, slots=True)
class AudioBlock:
    """Packets that start in a block of `frames` frames of the motion."""

    frames: int
    packets: list[AudioPacket]


class AudioBlockStore(TrackBlockStore[AudioTrack, AudioBlock]):
    """Blocks of one audio track, each at the highest level received."""

    def put_encoded(self, index: int, level: int, data: bytes) -> bool:
        """Parse a block and `put` it; raise `DamagedBlock` if it is not one of this track."""
        packets = unpack_audio_block(data)
        if packets and packets[-1].number >= self.track.packet_count:
            raise DamagedBlock(
                f"Block {index} of the audio track holds packet {packets[-1].number}, "
                f"but the track has {self.track.packet_count} packets only"
            )
        return self.put(index, level, AudioBlock(self.track.frames_in(index), packets))

    def packets_from(self, position: int) -> list[AudioPacket]:
        """Return the packets from motion time `position` (microseconds) to the first gap, or the end of the motion."""
        first = (position * SAMPLE_RATE // 1_000_000 + self.track.pre_skip) // PACKET_SAMPLES
        found: list[AudioPacket] = []
        # a packet may extend beyond its block, and a block may be shorter than a packet
        for index in range(self.track.block_of_packet(first), self.track.block_count):
            if index not in self._blocks:
                break
            for packet in self._blocks[index][1].packets:
                if packet.number == first + len(found):
                    found.append(packet)
        return found
