"""Arms of three bodies from the literature, for measurements."""

from __future__ import annotations

from dataclasses import dataclass

from bunraku.marionette.constants import ARM_LENGTH_RATIOS, ARM_MASS_RATIOS
from bunraku.marionette.proportions import Proportions


@dataclass(frozen=True, slots=True)
class Body:
    """Name and `proportions` of an arm, and the `source` of its lengths and masses."""

    name: str
    proportions: Proportions
    source: str


BODIES = (
    Body(
        "Winter",
        Proportions.from_links(ARM_LENGTH_RATIOS, ARM_MASS_RATIOS),
        "D. A. Winter, Biomechanics and Motor Control of Human Movement: lengths as parts of the height, figure 4.1 "
        "(Drillis and Contini 1966), masses as parts of the body's, table 4.1",
    ),
    Body(
        "de Leva",
        Proportions.from_links((0.2817, 0.2689, 0.1879), (0.0271, 0.0162, 0.0061)),
        "P. de Leva, Adjustments to Zatsiorsky-Seluyanov's segment inertia parameters, J. Biomechanics 29 (1996), "
        "table 4, men: shoulder, elbow and wrist centres in metres, the hand to the tip of the third finger",
    ),
    Body(
        "H-Anim",
        # between the joint centres (0.2029, 1.4376, -0.0387), (0.2014, 1.1357, -0.0682), (0.1984, 0.8663, -0.0583) and
        # the finger tip (0.2056, 0.6743, -0.0482)
        Proportions.from_links((0.303342, 0.269599, 0.192400)),
        "H-Anim specification, joint centres of the LOA-1 example figure, in metres; masses by length, as Winter's",
    ),
)
"""Winter, de Leva and the H-Anim example figure."""
