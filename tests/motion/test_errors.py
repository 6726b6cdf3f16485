from bunraku.motion.errors import UnreadableFile, quote_excerpt


def test_message_contains_title_line_detail_and_hint() -> None:
    error = UnreadableFile("Two roots", "a second ROOT", line=7, field="b", hint="send one")
    assert str(error) == "Two roots: line 7: a second ROOT (send one)"
    assert (error.title, error.detail, error.line, error.field, error.hint) == (
        "Two roots",
        "a second ROOT",
        7,
        "b",
        "send one",
    )
    assert str(UnreadableFile("Empty file", "nothing")) == "Empty file: nothing"


def test_quoted_excerpt_is_short_and_printable() -> None:
    assert quote_excerpt(b"a\x00b\xff") == "'a\\x00b�'"
    assert quote_excerpt("x" * 50) == "'" + "x" * 40 + "…'"
