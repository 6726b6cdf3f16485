from random import Random

from hypothesis import given
from hypothesis import strategies as st

from bunraku.wire.limbs import MAX_LIMBS
from bunraku.wire.messages import unpack
from bunraku.wire.overlay import Overlay, drop_earlier_frames

TIME = st.integers(0, (1 << 53) - 1)
LIMB = st.integers(0, MAX_LIMBS - 1)


def _random_frames(limbs: set[int], count: int, random: Random) -> list[dict[int, tuple[int, ...]]]:
    return [{limb: tuple(random.randint(-32768, 32767) for _ in range(9)) for limb in limbs} for _ in range(count)]


@given(st.integers(0, 0xFFFF), TIME, st.sets(LIMB), st.integers(1, 16), st.randoms(use_true_random=False))
def test_packed_overlay_unpacks_to_the_same_frames(
    sequence: int, due: int, limbs: set[int], count: int, random: Random
) -> None:
    frames = _random_frames(limbs, count, random)
    message = Overlay(sequence, due, frames[-1], tuple(frames[:-1]))
    assert unpack(message.pack()) == message
    assert message.pack()[0] == (5 if all(limb < 4 for limb in limbs) else 14)


@given(st.integers(0, 0xFFFF), TIME, st.sets(LIMB), st.integers(0, 5), st.randoms(use_true_random=False))
def test_drop_earlier_frames_keeps_the_last_frame(
    sequence: int, due: int, limbs: set[int], earlier: int, random: Random
) -> None:
    frames = _random_frames(limbs, earlier + 1, random)
    message = Overlay(sequence, due, frames[-1], tuple(frames[:-1]))
    assert unpack(drop_earlier_frames(message.pack())) == Overlay(sequence, due, frames[-1])
