import pytest

from bunraku.motion.errors import UnreadableFile
from bunraku.motion.readers.bvh import parse_bvh
from tests.motion.readers.bvh_samples import FIRST_FRAME_LINE, HIERARCHY_TEXT, ROWS, VALUES, motion_section

INCOMPLETE_ROW = b"1 2 3 4 5 6 7 8"


@pytest.mark.parametrize(
    ("data", "frames", "note"),
    [
        (motion_section(frames=b"Frames: 5"), 2, "The file says 5 frames, but 2 are there and were used."),
        (motion_section(frames=b"Frames: 1"), 2, "The file says 1 frames, but 2 are there and were used."),
        (motion_section(frames=b"Frames: all"), 2, "The number of frames is not a number: 'all'."),
        (motion_section(frames=b""), 2, "The number of frames is missing; 2 are there and were used."),
        (
            motion_section(*ROWS, INCOMPLETE_ROW, frames=b"Frames: 3"),
            2,
            "The last frame has 8 of 9 values; it was dropped.",
        ),
        (motion_section(time=b""), 2, "The frame time is missing; 30 frames/s assumed."),
        (motion_section(time=b"Frame Time:"), 2, "The frame time is missing; 30 frames/s assumed."),
        (motion_section(time=b"Frame Time: 0"), 2, "The frame time is not above zero; 30 frames/s assumed."),
    ],
)
def test_irregular_header_is_tolerated_and_noted(data: bytes, frames: int, note: str) -> None:
    if b"Frame Time:\n" in data:
        data = data.replace(b"Frame Time:\n1", b"Frame Time:\n\n1")
    bvh = parse_bvh(HIERARCHY_TEXT + data)
    assert bvh.frames.tolist() == VALUES[:frames]
    assert note in bvh.notes


@pytest.mark.parametrize(
    ("data", "title", "line"),
    [
        (motion_section(ROWS[0], ROWS[1].replace(b"-3", b"nan")), "Not a finite number", 1),
        (motion_section(ROWS[0], ROWS[1].replace(b"-3", b"-inf")), "Not a finite number", 1),
        (motion_section(ROWS[0].replace(b"9.5", b"1.#QNAN"), ROWS[1]), "Not a finite number", 0),
        (motion_section(ROWS[0].replace(b"9.5", b"-1.#IND00"), ROWS[1]), "Not a finite number", 0),
        (motion_section(ROWS[0], ROWS[1].replace(b"-3", b"1e999")), "Not a finite number", 1),
        (motion_section(ROWS[0], ROWS[1].replace(b"-3", b"x")), "Not a number", 1),
        (motion_section(*ROWS, b"HIERARCHY"), "Two motions in one file", 2),
        (motion_section(ROWS[0], INCOMPLETE_ROW, ROWS[1], ROWS[0]), "Wrong number of values", 1),
        (motion_section(INCOMPLETE_ROW, ROWS[1]), "Wrong number of values", 0),
        (motion_section(*[INCOMPLETE_ROW] * 9, frames=b"Frames: 9"), "Wrong number of values", 0),
        (motion_section(ROWS[0], ROWS[1] + b" 1"), "Wrong number of values", 1),
        (motion_section(b" ".join(ROWS) + b" 1"), "Wrong number of values", 0),
        (motion_section(b"1 2 3"), "No whole frame", None),
        (motion_section(b""), "No whole frame", None),
        (motion_section(time=b"Frame Time: nan"), "Not a number", -1),
        (motion_section(time=b"Frame Time: 1e-320"), "Frame time out of range", -1),
        (motion_section(time=b"Frame Time: 33.3"), "Frame time out of range", -1),
        (motion_section(frames=b"Frames: 2\n" * 100_000), "Not a number", None),
    ],
)
def test_errors_name_line_and_remedy(data: bytes, title: str, line: int | None) -> None:
    with pytest.raises(UnreadableFile) as caught:
        parse_bvh(HIERARCHY_TEXT + data)
    assert caught.value.title == title
    assert caught.value.hint
    if line is not None:
        assert caught.value.line == FIRST_FRAME_LINE + line


def test_long_word_is_rejected_with_a_short_message() -> None:
    with pytest.raises(UnreadableFile, match="Not a number") as caught:
        parse_bvh(HIERARCHY_TEXT + motion_section(b"x" * 20_000_000))
    assert len(str(caught.value)) < 300
