from __future__ import annotations

import json
import unicodedata

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from bunraku.runtime.display_text import MAX_COMBINING_MARKS, clean_document, clean_text, escape_text

ANY_TEXT = st.text(st.characters(codec=None, categories=None), max_size=80)
HOSTILE = (
    [chr(code) for code in (*range(0x20), *range(0x7F, 0xA0))]
    + [chr(code) for code in (0x00AD, 0x061C, 0x180E, 0x200B, 0x200E, 0x200F, *range(0x2028, 0x202F))]
    + [chr(code) for code in (*range(0x2060, 0x2070), 0x115F, 0x1160, 0x3164, 0xFFA0, 0xFEFF, *range(0xFFF0, 0xFFFC))]
    + [chr(code) for code in (0xD800, 0xDFFF, 0xE000, 0xFDD0, 0xFFFE, 0x1FFFF, *range(0xE0000, 0xE0080), 0xE0200)]
)


@pytest.mark.parametrize("char", HOSTILE, ids=lambda char: f"U+{ord(char):04X}")
def test_unsafe_character_is_removed_from_names_and_escaped_in_output(char: str) -> None:
    cleaned = clean_text(f"a{char}b")
    assert cleaned.replace(" ", "").startswith("a")
    assert char == " " or char not in cleaned
    assert char == " " or char not in escape_text(f"a{char}b")
    assert json.loads(f'"{escape_text(f"a{char}b")}"') == f"a{char}b"


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("\x1b[31mred\x1b[0m", "red"),
        ("\x1b]8;;http://evil.example\x07link\x1b]8;;\x1b\\", "link"),
        ("\x1b]0;title\x07dance\x9b2J\x9d0;x\x9c", "dance"),
        ("\x1bPqpicture\x1b\\a\x1b(Bb\x1bc", "ab"),
        ("\x1b", ""),
        ("dance\u202egpj.exe", "dancegpj.exe"),
        ("\u2066isolated\u2069 and \u200emarked", "isolated and marked"),
        (" one\n\ttwo\u2028three\r\n ", "one two three"),
        ("a\u200db\u200cc", "abc"),
        ("\u0301\u0301a", "a"),
        ("Z" + "\u0334" * 40, "Z" + "\u0334" * MAX_COMBINING_MARKS),
        ("か\u3099", "が"),
        ("\u200b\u2060\ufeff\x00", ""),
    ],
)
def test_name_is_reduced_to_what_can_be_seen(text: str, expected: str) -> None:
    assert clean_text(text) == expected


@pytest.mark.parametrize(
    "text",
    [
        "人形浄瑠璃　文楽",
        "葛\U000e0100城の踊り",
        "ﾊﾝｶｸ ㌔ ｶﾞ 々〆ヶ",
        "👨\u200d👩\u200d👧\u200d👦",
        "🏳\ufe0f\u200d🌈 ❤\ufe0f\u200d🔥 👁\ufe0f\u200d🗨\ufe0f",
        "👩🏽\u200d🚀 👍🏿 1\ufe0f\u20e3 🇯🇵",
        "🏴\U000e0067\U000e0062\U000e0073\U000e0063\U000e0074\U000e007f",
        "🙂\u200d↔\ufe0f",
        "Đặng Thị Hồng",
        "نمی\u200cخواهم",
        "ශ්\u200dරී ලංකා",
        "שָׁלוֹם",
        "don't “quote” <b>&amp; 50 % \\o/",
    ],
)
def test_names_in_living_scripts_and_emoji_stay_intact(text: str) -> None:
    text = unicodedata.normalize("NFC", text)
    assert clean_text(text) == text
    assert escape_text(text) == text


def test_tags_are_kept_only_in_known_flags() -> None:
    tags = "".join(chr(0xE0000 + ord(letter)) for letter in "hidden")
    assert clean_text(f"🏴{tags}\U000e007f") == "🏴"
    assert clean_text(f"name{tags}") == "name"


def test_truncation_does_not_split_a_character() -> None:
    family = "👨\u200d👩\u200d👧"
    assert clean_text("x" * 38 + family, 40) == "x" * 38
    assert clean_text("x" * 39 + "👍🏽", 40) == "x" * 39
    assert clean_text("x" * 39 + "葛\U000e0100", 40) == "x" * 39
    assert clean_text("踊" * 50, 40) == "踊" * 40


@given(ANY_TEXT)
@example("0 \u200e 0")
def test_cleaned_text_is_normal_bounded_encodable_and_stable(text: str) -> None:
    cleaned = clean_text(text, 40)
    assert len(cleaned) <= 40
    assert len(cleaned.encode()) <= 160
    assert unicodedata.is_normalized("NFC", cleaned)
    assert cleaned == cleaned.strip()
    assert not {unicodedata.category(char) for char in cleaned} & {"Cc", "Cs", "Co", "Zl", "Zp"}
    assert clean_text(cleaned, 40) == cleaned


@given(ANY_TEXT)
def test_escaped_json_stays_valid_and_equal(text: str) -> None:
    document = json.dumps({"name": text, "items": [text]}, ensure_ascii=False, indent=2)
    escaped = escape_text(document, keep="\n")
    assert json.loads(escaped) == json.loads(document)
    escaped.encode()


def test_document_is_cleaned_in_depth() -> None:
    document = {"joints": {"hip": "Hi\x1b[2Jps"}, "guessed": ["a\nb", {"c": "\u202ed"}], "fps": 30.0, "loop": None}
    assert clean_document(document, 50) == {
        "joints": {"hip": "Hips"},
        "guessed": ["a b", {"c": "d"}],
        "fps": 30.0,
        "loop": None,
    }


def test_long_runs_of_marks_take_linear_time() -> None:
    assert clean_text("e" + "\u0301\u0323" * 200_000) == unicodedata.normalize("NFC", "e\u0301\u0323\u0301\u0323")
    assert clean_text("\x1b]" * 200_000) == ""
