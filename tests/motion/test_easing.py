import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bunraku.motion import easing
from bunraku.motion.easing import EasedMove, EasingFunction

EASES = [easing.minimum_jerk, easing.ease_out, easing.ease_in]


@pytest.mark.parametrize("ease", EASES)
def test_easing_rises_from_0_to_1_at_rest_at_both_ends(ease: EasingFunction) -> None:
    u = np.linspace(-0.5, 1.5, 2001)
    eased = ease(u)
    assert np.all(eased[u <= 0.0] == 0.0)
    assert np.allclose(eased[u >= 1.0], 1.0, rtol=0, atol=1e-12)
    assert np.all(np.diff(eased) >= -1e-12)
    assert np.max(np.abs(np.diff(eased, 2))) / 0.001**2 < 21.0


def test_ease_out_starts_sooner_and_ends_softer_than_minimum_jerk() -> None:
    early, late = np.array([0.2]), np.array([0.8])
    assert easing.ease_out(early)[0] > easing.minimum_jerk(early)[0] + 0.1
    assert 1.0 - easing.ease_out(late)[0] < 0.2 * (1.0 - easing.minimum_jerk(late)[0])


@given(st.lists(st.tuples(st.floats(0, 10), st.floats(0.1, 5), st.floats(-3, 3)), max_size=6), st.floats(-2, 2))
def test_track_starts_at_start_and_ends_after_all_moves(moves: list[tuple[float, float, float]], start: float) -> None:
    made = [EasedMove(begin, duration, np.array([delta, -delta])) for begin, duration, delta in moves]
    track = easing.superpose(np.array([0.0, 20.0]), np.array([start, 1.0]), made)
    total = sum(delta for _, _, delta in moves)
    assert np.allclose(track, [[start, 1.0], [start + total, 1.0 - total]], rtol=0, atol=1e-9)


def test_overlapping_moves_do_not_stop_at_the_key() -> None:
    time = np.linspace(0.0, 2.0, 401)
    one, two = EasedMove(0.0, 1.0, np.array([1.0])), EasedMove(0.6, 1.0, np.array([1.0]))
    speed = np.gradient(easing.superpose(time, np.zeros(1), [one, two])[:, 0], time)
    assert speed[(time > 0.4) & (time < 1.2)].min() > 0.5


def test_bump_peaks_at_1_and_is_zero_outside() -> None:
    assert np.allclose(easing.bump(np.array([0.0, 1.0, 1.5, 3.0, 4.0]), 1.0, 1.5, 3.0), [0, 0, 1, 0, 0])


@given(st.floats(-3, 3), st.floats(-3, 3), st.floats(0.2, 4))
def test_hermite_follows_a_parabola_exactly(a: float, b: float, span: float) -> None:
    time = np.linspace(0.0, span, 50)
    ends = np.array([0.0, span])
    spline = easing.hermite(time, ends, a * ends + b * ends**2, a + 2.0 * b * ends)
    assert np.allclose(spline, a * time + b * time**2, rtol=0, atol=1e-9)


def test_hermite_is_constant_outside_its_knots() -> None:
    spline = easing.hermite(np.array([-1.0, 5.0]), np.array([0.0, 1.0, 2.0]), np.array([3.0, 0.0, 4.0]), np.ones(3))
    assert np.allclose(spline, [3.0, 4.0])
