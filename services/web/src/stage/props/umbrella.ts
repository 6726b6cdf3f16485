/** Wagasa, an umbrella of bamboo and oiled paper with the white ring of a snake's eye. */
import { Vector3 } from "three";
import { UMBRELLA } from "../../motion/props";
import type { Finish } from "../puppet/finish";
import { lathe, ring } from "../puppet/surface";
import { PROP_FINISH } from "./prop-finish";
import { PropMesh } from "./prop-mesh";

const RIBS = 24;
/** Height of the canopy's middle above the grip. */
const APEX_M = 0.775;
/** Share of the slope that grows with the distance from the middle. */
const CURVATURE = 0.18;
/** The paper between two ribs hangs lower, and its edge is cut a little shorter. */
const SAG_M = 0.011;
const VALLEY_SHARE = 0.988;
/** Radii of the bands of the canopy as shares of the rim's, and the radius at which the ribs' supports end. */
const BAND_SHARES = [0.04, 0.46, 0.7, 1];
const SUPPORT_SHARE = 0.5;
/** Height of the ring that slides on the shaft, where the supports begin. */
const RUNNER_M = 0.46;
const PAPER_THICKNESS_M = 0.003;
const UP = new Vector3(0, 1, 0);

export function createUmbrella(): PropMesh {
  const mesh = new PropMesh();
  addCanopy(mesh);
  addRibs(mesh);
  const { handleLength, handleRadius } = UMBRELLA;
  const { lacquer, bamboo, darkBamboo, gold } = PROP_FINISH;
  const addLathe = (from: number, to: number, radii: readonly (readonly number[])[], finish: Finish) => {
    const length = to - from;
    const profile = radii.map(([height, radius]) => [(height - from) / length, radius / length]);
    mesh.addSolid(
      lathe(new Vector3(0, from, 0), new Vector3(0, to, 0), profile, { columns: 8, rows: "profile" }),
      finish,
    );
  };
  const handleTop = 0.07;
  addLathe(
    -handleLength,
    handleTop,
    [
      [-handleLength, 1e-4],
      [-handleLength + 1e-4, handleRadius],
      [handleTop - 1e-4, handleRadius],
      [handleTop, 1e-4],
    ],
    lacquer,
  );
  addLathe(
    handleTop,
    APEX_M,
    [
      [handleTop, 0.009],
      [RUNNER_M - 0.02, 0.009],
      [APEX_M - 0.01, 0.008],
      [APEX_M, 1e-4],
    ],
    bamboo,
  );
  addLathe(
    RUNNER_M - 0.025,
    RUNNER_M + 0.02,
    [
      [RUNNER_M - 0.025, 1e-4],
      [RUNNER_M - 0.02, 0.016],
      [RUNNER_M + 0.015, 0.018],
      [RUNNER_M + 0.02, 1e-4],
    ],
    darkBamboo,
  );
  addLathe(
    APEX_M - 0.012,
    APEX_M + 0.045,
    [
      [APEX_M - 0.012, 0.032],
      [APEX_M + 0.006, 0.027],
      [APEX_M + 0.018, 0.012],
      [APEX_M + 0.038, 0.009],
      [APEX_M + 0.045, 1e-4],
    ],
    lacquer,
  );
  mesh.addSolid(ring(new Vector3(0, handleTop, 0), UP, handleRadius, 0.003), gold);
  return mesh;
}

/** Add both sides of the paper. It is folded at each rib. */
function addCanopy(mesh: PropMesh): void {
  const { vermilion, vermilionInside, paper } = PROP_FINISH;
  const inside = [vermilionInside, paper, vermilionInside];
  [vermilion, paper, vermilion].forEach((finish, band) => {
    const [from, to] = [BAND_SHARES[band], BAND_SHARES[band + 1]];
    for (let column = 0; column < 2 * RIBS; column++) {
      const corners = (drop: number) =>
        [
          [column, from],
          [column, to],
          [column + 1, to],
          [column + 1, from],
        ].map(([at, share]) => canopyPoint(at, share, drop * (1 - share)));
      mesh.addFace(corners(0), finish);
      mesh.addFace(corners(PAPER_THICKNESS_M).toReversed(), inside[band]);
    }
  });
}

/** Add a rib below each fold of the paper, and the support that spreads it. */
function addRibs(mesh: PropMesh): void {
  const { darkBamboo } = PROP_FINISH;
  for (let rib = 0; rib < RIBS; rib++) {
    const column = 2 * rib;
    const across = canopyPoint(column + RIBS / 2, 1, 0)
      .setY(0)
      .normalize();
    const support = canopyPoint(column, SUPPORT_SHARE, 0.012);
    const runner = canopyPoint(column, 0, 0).setY(0);
    runner.copy(support).setY(0).setLength(0.014).setY(RUNNER_M);
    addWedge(mesh, canopyPoint(column, 0.05, PAPER_THICKNESS_M), canopyPoint(column, 0.98, 0), across, 0.006);
    addWedge(mesh, runner, support, across, 0.004);
  }

  /** Add a stick of triangular section, open at the top. */
  function addWedge(to: PropMesh, start: Vector3, end: Vector3, across: Vector3, width: number): void {
    const side = across.clone().multiplyScalar(width / 2);
    const drop = new Vector3(0, -width, 0);
    const [startDrop, endDrop] = [start.clone().add(drop), end.clone().addScaledVector(drop, 0.4)];
    for (const sign of [1, -1]) {
      const corners = [
        start.clone().addScaledVector(side, sign),
        end.clone().addScaledVector(side, sign),
        endDrop,
        startDrop,
      ];
      to.addFace(sign > 0 ? corners : corners.toReversed(), darkBamboo);
    }
  }
}

/** Return a point of the canopy, `drop` metres below it: even columns are ribs, the first in front. */
function canopyPoint(column: number, share: number, drop: number): Vector3 {
  const { rimHeight, rimRadius } = UMBRELLA;
  const isRib = column % 2 === 0;
  const angle = (column * Math.PI) / RIBS;
  const radius = rimRadius * share * (isRib ? 1 : VALLEY_SHARE);
  const fall = (1 - CURVATURE) * share + CURVATURE * share * share;
  const sag = isRib ? 0 : SAG_M * share;
  // The edge of the paper goes straight from rib to rib.
  const height = APEX_M - (APEX_M - rimHeight) * fall - sag * (1 - share) - drop;
  return new Vector3(Math.sin(angle) * radius, height, Math.cos(angle) * radius);
}
