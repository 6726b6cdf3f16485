import pytest
from hypothesis import given
from hypothesis import strategies as st

from bunraku.wire.errors import MalformedMessage
from bunraku.wire.limbs import MAX_PERFORMERS
from bunraku.wire.live import AGE_UNIT_US, MAX_LIVE_FRAMES, MAX_ROOT_M, Live, LiveBlock, Sample

lives = st.builds(
    Live,
    due=st.integers(0, 2**53 - 1),
    frames=st.integers(1, MAX_LIVE_FRAMES),
    blocks=st.dictionaries(
        st.integers(0, MAX_PERFORMERS - 1),
        st.builds(LiveBlock, st.integers(0, 255).map(lambda age: age * AGE_UNIT_US), st.binary(max_size=300)),
    ),
)
coordinates = st.floats(-MAX_ROOT_M, MAX_ROOT_M, width=32)
samples = st.builds(
    Sample,
    sequence=st.integers(0, 2**32 - 1),
    sampled=st.integers(0, 2**53 - 1),
    root=st.tuples(coordinates, coordinates, coordinates),
    rotations=st.tuples(*[st.integers(-32_768, 32_767)] * 54),
)


@given(lives)
def test_live_round_trip(live: Live) -> None:
    packed = live.pack()
    assert Live.unpack(packed) == Live(live.due, live.frames, dict(sorted(live.blocks.items())))
    assert len(packed) <= 10 + sum(3 + len(block.data) for block in live.blocks.values())


@given(lives, st.data())
def test_live_cut_anywhere_is_rejected_or_shorter(live: Live, data: st.DataObject) -> None:
    packed = live.pack()
    end = data.draw(st.integers(1, len(packed)))
    if end < len(packed):
        with pytest.raises(MalformedMessage):
            Live.unpack(packed[:end])


@given(st.binary(max_size=80))
def test_any_bytes_are_a_live_message_or_rejected(data: bytes) -> None:
    try:
        live = Live.unpack(b"\x0f" + data)
    except MalformedMessage:
        return
    assert Live.unpack(live.pack()) == live


def test_bytes_after_the_last_block_are_rejected() -> None:
    with pytest.raises(MalformedMessage, match="1 bytes after its last block"):
        Live.unpack(Live(0, 2, {0: LiveBlock(0, b"ab")}).pack() + b"\0")


@given(samples)
def test_sample_round_trip(sample: Sample) -> None:
    packed = sample.pack()
    assert len(packed) == 136
    assert Sample.unpack(packed) == sample


@pytest.mark.parametrize("value", [float("nan"), float("inf"), -100.5])
def test_sample_of_a_position_beyond_the_bound_is_rejected(value: float) -> None:
    packed = Sample(1, 2, (0.0, value, 0.0), (0,) * 54).pack()
    with pytest.raises(MalformedMessage, match="not within 100 m"):
        Sample.unpack(packed)
    with pytest.raises(MalformedMessage, match="expected 136 bytes"):
        Sample.unpack(packed[:-1])
