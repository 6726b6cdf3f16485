from __future__ import annotations

import numpy as np
import pytest

from bunraku.props.texture import Texture, Wrap, linear_to_srgb, srgb_to_linear


def row(*values: float) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    """Return an image of one row with these values in all columns."""
    return np.repeat(np.array(values)[None, :, None], 4, axis=2)


@pytest.mark.parametrize(
    ("wrap", "expected"),
    [(Wrap.REPEAT, [0.3, 0.1, 0.2]), (Wrap.CLAMP, [0.1, 0.3, 0.3]), (Wrap.MIRROR, [0.1, 0.3, 0.2])],
)
def test_what_lies_beyond_the_border_follows_the_wrap(wrap: Wrap, expected: list[float]) -> None:
    texture = Texture(row(0.1, 0.2, 0.3), (wrap, wrap), is_smooth=False)
    at = np.array([[-0.5 / 3, 0.5], [3.5 / 3, 0.5], [4.5 / 3, 0.5]])
    assert texture.sample(at)[:, 0] == pytest.approx(expected)


def test_values_between_pixels_are_interpolated_only_if_smooth() -> None:
    at = np.array([[0.5, 0.5], [0.25, 0.5], [0.3, 0.5]])
    assert Texture(row(0.0, 1.0)).sample(at)[:, 2] == pytest.approx([0.5, 0.0, 0.1])
    assert set(Texture(row(0.0, 1.0), is_smooth=False).sample(at[1:])[:, 0]) == {0.0}


def test_rows_begin_at_the_top() -> None:
    pixels = np.zeros((2, 1, 4))
    pixels[0] = 1.0
    assert Texture(pixels, is_smooth=False).sample(np.array([[0.5, 0.2], [0.5, 0.8]]))[:, 0].tolist() == [1.0, 0.0]


def test_transfer_function_is_that_of_srgb_and_its_inverse() -> None:
    values = np.linspace(0.0, 1.0, 1001)
    assert srgb_to_linear(np.array([0.0, 0.5, 1.0])) == pytest.approx([0.0, 0.21404, 1.0], abs=1e-5)
    assert linear_to_srgb(srgb_to_linear(values)) == pytest.approx(values, abs=1e-6)
