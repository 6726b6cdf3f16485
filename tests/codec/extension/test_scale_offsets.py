from __future__ import annotations

import numpy as np
import pytest

from bunraku.codec.errors import DamagedBlock
from bunraku.codec.extension.scale_offsets import check_scale_offsets, to_scales


def test_offsets_fill_whole_channels() -> None:
    np.testing.assert_array_equal(to_scales(np.array([1, -2, 0, 7]), 2), [[128, -256, 0], [896, 0, 0]])


@pytest.mark.parametrize("offset", [-9, 8])
def test_offset_out_of_range_is_refused(offset: int) -> None:
    with pytest.raises(DamagedBlock, match=r"expected -8\.\.7"):
        check_scale_offsets(np.array([0, offset]))
    assert len(check_scale_offsets(np.array([-8, 7]))) == 2
