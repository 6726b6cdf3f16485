"""Marionettes of one stage: limb l of performer k has the number 4 k + l (paper 5)."""

from __future__ import annotations

from collections.abc import Sequence

from bunraku.marionette.bond.bonded_arm import BondedArm
from bunraku.marionette.bond.bonds import Bonds
from bunraku.marionette.merge import Marionette
from bunraku.marionette.ownership import INITIAL_EPOCHS, LIMBS_PER_PERFORMER, Ownership
from bunraku.marionette.solver.limb_solver import PYTHON_SOLVER, LimbSolver
from bunraku.marionette.solver.vector import JointRotations, Vector
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import Figure
from bunraku.wire.limbs import MAX_PERFORMERS

StagedPose = tuple[Array, Array]
"""Root position (3,) in metres and joint rotations (18, 4) of one performer, placed on the stage."""
OverlayJoints = dict[int, JointRotations]
"""Local rotations of the joints of each controlled limb, by the limb's number."""


class Marionettes:
    """One to four marionettes; each is independent of the others, except for bonded hands.

    Puppeteers act on `ownership`. The marionettes compute the overlay that follows from it. `now` is clock time in
    integer µs and must not run backwards.
    """

    def __init__(
        self,
        figures: Sequence[Figure],
        epochs: Sequence[int] = INITIAL_EPOCHS,
        solver: LimbSolver = PYTHON_SOLVER,
    ) -> None:
        """`epochs` are those of the last grants on this stage. Raises as `set_figures` does."""
        self.ownership = Ownership(0, epochs)
        self._solver = solver
        self.bonds = Bonds(self.ownership)
        self._marionettes: list[Marionette] = []
        self._wake_count = 0
        self._replace_figures(figures)

    def __len__(self) -> int:
        """Number of limbs."""
        return len(self.ownership)

    def set_figures(self, figures: Sequence[Figure]) -> list[tuple[int, str]]:
        """Change the performers to those of a motion; return the held limbs that disappear, and their holders.

        Limbs of the performers that remain stay held. Each new arm takes a tenth of a second, as in
        `Marionette.set_figure`. Raises, without effect, `ProportionsError` for a figure whose arms are too short, and
        ValueError for no figure or more than four.
        """
        return self._replace_figures(figures)

    def use_solver(self, solver: LimbSolver) -> None:
        """Use another solver from the next frame on."""
        self._solver = solver
        for marionette in self._marionettes:
            marionette.use_solver(solver)

    @property
    def needs_full_rate(self) -> bool:
        """True if any marionette needs every frame."""
        return any(marionette.needs_full_rate for marionette in self._marionettes)

    def observe_poses(self, poses: Sequence[StagedPose], now: int) -> None:
        """Observe the pose of each performer before the first overlay."""
        self._reset_after_rest()
        for marionette, (_, rotations) in zip(self._marionettes, poses, strict=False):
            marionette.observe_pose(rotations, now)

    def compute_overlay(self, poses: Sequence[StagedPose], now: int) -> OverlayJoints:
        """Return the overlay of the pose of each performer."""
        self._reset_after_rest()
        for marionette, (_, rotations) in zip(self._marionettes, poses, strict=False):
            marionette.begin_frame(rotations, now)
        places = self.bonds.compute_places(self._bonded_arm, [root for root, _ in poses], now)
        overlay: OverlayJoints = {}
        for performer, marionette in enumerate(self._marionettes[: len(poses)]):
            if (joint_overlay := marionette.finish_frame(now, places)) is not None:
                overlay |= {
                    LIMBS_PER_PERFORMER * performer + limb: joints
                    for limb, joints in zip(joint_overlay.limbs, joint_overlay.joints, strict=True)
                }
        return overlay

    def _replace_figures(self, figures: Sequence[Figure]) -> list[tuple[int, str]]:
        if not 1 <= len(figures) <= MAX_PERFORMERS:
            raise ValueError(f"a stage has 1 to {MAX_PERFORMERS} performers, not {len(figures)}")
        count = len(self._marionettes)
        # creating all of them first raises before anything changes
        created = [
            Marionette(figure, self.ownership, performer, self._solver) for performer, figure in enumerate(figures)
        ]
        for marionette, figure in zip(self._marionettes, figures, strict=False):
            marionette.set_figure(figure)
        self.bonds.reset()
        self._marionettes = [*self._marionettes[: len(figures)], *created[count:]]
        return self.ownership.set_limb_count(LIMBS_PER_PERFORMER * len(figures))

    def _bonded_arm(self, limb: int, root: Vector) -> BondedArm:
        return self._marionettes[limb // LIMBS_PER_PERFORMER].bonded_arm(limb, root)

    def _reset_after_rest(self) -> None:
        """Reset the state at rest, so that the same commands give the same overlays whatever came before."""
        if self._wake_count != self.ownership.wake_count:
            self._wake_count = self.ownership.wake_count
            self.bonds.reset()
            for marionette in self._marionettes:
                marionette.reset()
