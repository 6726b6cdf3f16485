import json
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bunraku.motion import rotation
from bunraku.motion.skeleton import JOINT_COUNT, JOINTS
from bunraku.playout.performance import sample_pose
from bunraku.runtime.problem import ProblemError
from bunraku.session.live.sample_json import MAX_SAMPLE_BYTES, parse_sample
from bunraku.wire.live import MAX_ROOT_M, Sample

coordinates = st.floats(-MAX_ROOT_M, MAX_ROOT_M, width=32)
quaternions = st.lists(st.floats(-2, 2), min_size=4, max_size=4).filter(lambda q: np.linalg.norm(q) > 0.01)


@given(
    st.tuples(coordinates, coordinates, coordinates),
    st.dictionaries(st.sampled_from(JOINTS), quaternions),
    st.none() | st.integers(0, 2**53 - 1),
)
def test_sample_has_the_pose_of_the_message(
    root: tuple[float, float, float], rotations: dict[str, list[float]], time: int | None
) -> None:
    message: dict[str, Any] = {"root": list(root), "rotations": rotations} | ({} if time is None else {"time": time})
    sample = parse_sample(json.dumps(message).encode(), 77)
    assert Sample.unpack(sample.pack()) == sample
    assert sample.sampled == (77 if time is None else time)
    found_root, found = sample_pose(sample)
    assert found_root == pytest.approx(np.array(root), abs=1e-5)
    expected = np.tile(rotation.IDENTITY, (JOINT_COUNT, 1))
    for name, quaternion in rotations.items():
        expected[JOINTS.index(name)] = np.array(quaternion) / np.linalg.norm(quaternion)
    assert np.abs(np.sum(found * expected, axis=-1)) == pytest.approx(np.ones(JOINT_COUNT), abs=1e-6)


def test_longest_useful_message_fits() -> None:
    rotations = {name: [-0.12345678901234567e-10] * 4 for name in JOINTS}
    message = {"time": 2**53 - 1, "root": [-1.2345678901234567e-10] * 3, "rotations": rotations}
    assert len(json.dumps(message, indent=1)) < MAX_SAMPLE_BYTES


@pytest.mark.parametrize(
    ("message", "field"),
    [
        (b"", None),
        (b"\xff\xfe", None),
        (b"[" * 4_000, None),
        (b"[1]", ""),
        (b'"text"', ""),
        (b"{}", "root"),
        (b'{"root": [0, 1]}', "root"),
        (b'{"root": [0, 1, NaN]}', "root"),
        (b'{"root": [0, 1, 1e400]}', "root"),
        (b'{"root": [0, 1, 101]}', "root"),
        (b'{"root": [0, 1, 0], "time": -1}', "time"),
        (b'{"root": [0, 1, 0], "time": 1.5}', "time"),
        (b'{"root": [0, 1, 0], "more": 1}', "more"),
        (b'{"root": [0, 1, 0], "rotations": {"l_wing": [1, 0, 0, 0]}}', "rotations"),
        (b'{"root": [0, 1, 0], "rotations": {"vl5": [0, 0, 0, 0]}}', "rotations"),
        (b'{"root": [0, 1, 0], "rotations": {"vl5": [1, 0, 0]}}', "rotations"),
        (b'{"root": [0, 1, 0], "rotations": {"vl5": [1e300, Infinity, 0, 0]}}', "rotations"),
    ],
)
def test_malformed_message_is_rejected_with_its_field(message: bytes, field: str | None) -> None:
    with pytest.raises(ProblemError) as rejected:
        parse_sample(message, 0)
    assert rejected.value.status in (400, 413, 422)
    if field:
        assert str(rejected.value.extra["field"]).startswith(field)


@given(st.binary(max_size=200))
def test_any_bytes_are_a_sample_or_rejected(message: bytes) -> None:
    try:
        parse_sample(message, 0)
    except ProblemError:
        return
