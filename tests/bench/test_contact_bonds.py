from __future__ import annotations

import pytest

from tests.bench.contact_bonds import Scene, measure_languages, measure_scene


@pytest.mark.parametrize("seed", range(4), ids=["own", "led", "taken", "two"])
def test_scene_is_within_the_bounds_and_replays_exactly(seed: int) -> None:
    figures = measure_scene(seed)
    assert figures.frames > 60
    assert figures.gap_mm <= 5.0
    assert figures.acceleration <= 80.0
    assert figures.join_ms <= 700.0
    assert figures.is_replayed


@pytest.mark.parametrize("seed", [2366, 3230])
def test_fast_way_along_the_border_is_within_the_acceleration(seed: int) -> None:
    assert measure_scene(seed).acceleration <= 80.0


def test_pair_whose_weights_change_at_once_is_within_the_acceleration() -> None:
    assert measure_scene(9334).acceleration <= 80.0


def test_scenes_of_one_seed_are_equal_and_of_two_differ() -> None:
    one, same, other = Scene(5), Scene(5), Scene(9)
    for scene in (one, same, other):
        scene.play()
    assert one.stage.overlays == same.stage.overlays
    assert one.stage.overlays != other.stage.overlays


def test_languages_agree_within_1e_9_metres() -> None:
    assert measure_languages(count=9) <= 1e-9
