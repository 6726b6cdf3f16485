from __future__ import annotations

import re
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from bunraku.marionette.bodies import BODIES
from bunraku.marionette.figures import FIGURES, HEIGHT, WIDTH, Figure, draw_figure, exact_arm, paper_arm, tip_path
from bunraku.marionette.proportions import Proportions

DOCS = Path(__file__).resolve().parents[2] / "docs"
NUMBER = re.compile(r"-?\d+\.\d+")
H_ANIM = BODIES[2].proportions


@pytest.mark.parametrize("name", FIGURES)
def test_committed_figures_equal_generated_figures(name: Figure) -> None:
    """Compare numbers to 0.2 pixels, since the last digit of a sine depends on the machine.

    `python -m tests.marionette.test_figures` writes the figures again.
    """
    generated, stored = draw_figure(H_ANIM, name), (DOCS / f"arm-{name}.svg").read_text(encoding="utf-8")
    assert NUMBER.sub("#", generated) == NUMBER.sub("#", stored)
    generated_numbers, stored_numbers = (
        [float(number) for number in NUMBER.findall(text)] for text in (generated, stored)
    )
    np.testing.assert_allclose(generated_numbers, stored_numbers, atol=0.2)


@pytest.mark.parametrize("name", FIGURES)
@pytest.mark.parametrize("identity", [*(body.proportions.identity for body in BODIES), "780-200-20-998-1-1"])
def test_figure_stays_within_its_frame(name: Figure, identity: str) -> None:
    image = ElementTree.fromstring(draw_figure(Proportions.parse(identity), name))
    for path in image.iter("{http://www.w3.org/2000/svg}path"):
        for x, y in (map(float, point.split(" ")) for point in path.attrib["d"][1:].split("L")):
            assert 0.0 < x < WIDTH
            assert 60.0 < y < HEIGHT


@pytest.mark.parametrize("name", FIGURES)
def test_tip_path_has_the_shape_of_the_figure(name: Figure) -> None:
    tips = tip_path(name, 200)
    assert tips.real.min() > 0.0
    assert np.abs(tips).max() < 1.0
    if name == "circle":
        assert np.ptp(np.abs(tips - tips[:-1].mean())) < 0.01
    else:
        assert np.ptp(tips.imag) == 0.0
    assert np.abs(exact_arm(H_ANIM, tips)[2] - tips).max() < 1e-14
    paper_error = np.abs(paper_arm(H_ANIM, tips)[2] - tips)
    assert 1e-5 < paper_error.max() < 0.003


if __name__ == "__main__":
    for figure in FIGURES:
        (DOCS / f"arm-{figure}.svg").write_text(draw_figure(H_ANIM, figure), encoding="utf-8", newline="\n")
