from __future__ import annotations

import numpy as np
import pytest

from bunraku.motion.analysis import analyse
from bunraku.motion.extension import DRIVE_UNIT, LENGTH_UNIT_M, REST_UNIT_RAD
from bunraku.motion.readers.bvh import parse_bvh
from tests.motion.extended_source import extended_source
from tests.motion.synthetic_motion import export_bvh, smooth_motion


@pytest.mark.parametrize(("spine_count", "neck_count"), [(0, 0), (1, 1), (2, 1), (3, 2), (4, 1)])
def test_extended_figure_meets_the_joints_of_the_source(spine_count: int, neck_count: int) -> None:
    analysis = analyse(extended_source(spine_count=spine_count, neck_count=neck_count))
    assert analysis.extension is not None
    extension = analysis.extension.extension
    assert (extension.spine_count, extension.has_neck, extension.has_clavicles) == (spine_count, neck_count > 0, True)
    assert analysis.mean_fit_error_mm > 2
    assert analysis.extended_mean_error_mm < 1.5
    assert analysis.extended_max_error_mm < 15


def test_longer_spine_is_followed_by_four_joints() -> None:
    analysis = analyse(extended_source(spine_count=7))
    assert analysis.extension is not None
    assert analysis.extension.extension.names[:4] == ("vl5", "vl1", "vt10", "vt6")
    assert analysis.extended_mean_error_mm < analysis.mean_fit_error_mm / 3


def test_figure_that_is_in_place_has_no_extension() -> None:
    analysis = analyse(parse_bvh(export_bvh(smooth_motion())))
    assert analysis.extension is None
    assert analysis.extended_mean_error_mm == analysis.mean_fit_error_mm


def test_constants_are_those_that_a_description_holds() -> None:
    extended = analyse(extended_source()).extension
    assert extended is not None
    extension = extended.extension
    for numbers, unit in (
        (extension.offsets, LENGTH_UNIT_M),
        (extension.ends, LENGTH_UNIT_M),
        (extension.drive, DRIVE_UNIT),
        (extension.rest, REST_UNIT_RAD),
    ):
        np.testing.assert_allclose(numbers / unit, np.round(numbers / unit), atol=1e-6)
    assert np.abs(extension.drive).max() <= 127 * DRIVE_UNIT
