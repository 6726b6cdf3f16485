from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bunraku.marionette.constants import ARM_LENGTH_RATIOS, ARM_MASS_RATIOS
from bunraku.marionette.proportions import Proportions, ProportionsError

links = st.floats(0.15, 0.6)
masses = st.floats(0.002, 0.1)


@given(st.tuples(links, links, links), st.tuples(masses, masses, masses), st.floats(0.01, 100.0))
def test_identity_is_independent_of_size(
    lengths: tuple[float, float, float], link_masses: tuple[float, float, float], size: float
) -> None:
    arm = Proportions.from_links(lengths, link_masses)
    assert sum(arm.parts[:3]) == sum(arm.parts[3:]) == 10_000
    for exact, rounded in zip((*arm.lengths, *arm.masses), arm.parts, strict=True):
        assert abs(exact * 10_000.0 - rounded) <= 1.0
    assert Proportions.parse(arm.identity) == arm.rounded()
    a, b, c = (length * size for length in lengths)
    assert (
        max(
            abs(x - y) for x, y in zip(Proportions.from_links((a, b, c), link_masses).lengths, arm.lengths, strict=True)
        )
        < 1e-12
    )


@given(st.integers(100, 780), st.data())
def test_parse_and_identity_are_inverse(upper: int, data: st.DataObject) -> None:
    forearm = data.draw(st.integers(100, 980 - upper))
    first = data.draw(st.integers(1, 998))
    second = data.draw(st.integers(1, 999 - first))
    identity = f"{upper}-{forearm}-{1000 - upper - forearm}-{first}-{second}-{1000 - first - second}"
    arm = Proportions.parse(identity)
    assert arm.identity == identity
    assert arm.rounded() == arm
    assert 0.1 <= arm.min_tip_distance < 1.0


@pytest.mark.parametrize(
    ("identity", "field"),
    [
        ("", "proportions"),
        ("393-351-256-560-320", "proportions"),
        ("0.4-0.4-0.2-1-1-1", "proportions"),
        ("393-351-256-560-320-٣٣", "proportions"),
        ("393-351-255-560-320-120", "L0"),
        ("393-351-256-560-320-121", "M0"),
        ("990-5-5-560-320-120", "L1"),
        ("393-351-256-1000-0-0", "M1"),
        ("393-351-256-5600-3200-1200", "M0"),
        ("3930-3510-2561-5600-3200-1200", "L0"),
        ("3930-5880-190-5600-3200-1200", "L2"),
    ],
)
def test_invalid_identity_raises_an_error_that_names_the_field(identity: str, field: str) -> None:
    with pytest.raises(ProportionsError) as refused:
        Proportions.parse(identity)
    assert refused.value.field == field
    assert refused.value.hint


@given(st.tuples(links, links, links))
def test_default_mass_of_a_link_is_proportional_to_its_length(lengths: tuple[float, float, float]) -> None:
    arm = Proportions.from_links(lengths)
    reference = Proportions.from_links(ARM_LENGTH_RATIOS, ARM_MASS_RATIOS)
    assert Proportions.from_links(ARM_LENGTH_RATIOS) == reference
    densities = [mass / length for mass, length in zip(arm.masses, arm.lengths, strict=True)]
    reference_densities = [mass / length for mass, length in zip(reference.masses, reference.lengths, strict=True)]
    for density, reference_density in zip(densities, reference_densities, strict=True):
        assert density / densities[0] == pytest.approx(reference_density / reference_densities[0], rel=1e-12)


def test_given_masses_override_the_defaults() -> None:
    assert Proportions.from_links((1.0, 1.0, 1.0), (2.0, 1.0, 1.0)).identity == "3334-3333-3333-5000-2500-2500"


def test_identity_is_in_thousandths_where_exact() -> None:
    assert Proportions.from_links((0.4, 0.35, 0.25), (0.5, 0.3, 0.2)).identity == "400-350-250-500-300-200"
    assert Proportions.parse("4000-3500-2500-5000-3000-2000").identity == "400-350-250-500-300-200"
    assert Proportions.parse("4001-3500-2499-5000-3000-2000").identity == "4001-3500-2499-5000-3000-2000"


def test_arm_without_a_hand_raises_proportions_error() -> None:
    with pytest.raises(ProportionsError, match="L2"):
        Proportions.from_links((0.3, 0.3, 0.0))
    with pytest.raises(ProportionsError, match="sum to zero"):
        Proportions.from_links((0.0, 0.0, 0.0))
