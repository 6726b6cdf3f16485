/** Branch of a plum tree in blossom. It lies flat: nothing reaches further to the front than its blossoms. */
import { Vector3 } from "three";
import type { Finish } from "../puppet/finish";
import { capsule, tube } from "../puppet/surface";
import { PROP_FINISH } from "./prop-finish";
import { PropMesh } from "./prop-mesh";

const at = (x: number, y: number, z: number) => new Vector3(x, y, z);

const STEM = [
  at(0, -0.1, 0),
  at(0.003, 0.05, 0),
  at(-0.014, 0.2, -0.008),
  at(0.016, 0.34, 0.004),
  at(-0.006, 0.48, -0.012),
  at(0.03, 0.64, -0.02),
];
/** Radii of the stem by the share of its length. */
const STEM_RADII = [
  [0, 1e-4],
  [0.01, 0.0095],
  [0.5, 0.0075],
  [0.98, 0.003],
  [1, 1e-4],
];
const TWIGS = [
  [at(-0.012, 0.19, -0.007), at(-0.115, 0.34, -0.03)],
  [at(0.013, 0.31, 0.002), at(0.12, 0.44, -0.012)],
  [at(-0.004, 0.46, -0.011), at(-0.085, 0.6, -0.005)],
  [at(-0.085, 0.297, -0.024), at(-0.13, 0.28, -0.05)],
  [at(0.012, 0.56, -0.017), at(0.075, 0.63, -0.055)],
];
const [TWIG_RADIUS_M, TWIG_END_RADIUS_M] = [0.0048, 0.002];

/** Blossoms: position, direction, and radius in metres. */
const BLOSSOMS: readonly (readonly [Vector3, Vector3, number])[] = [
  [at(-0.118, 0.345, -0.03), at(-0.6, 0.7, 0.3), 0.026],
  [at(-0.075, 0.285, -0.014), at(-0.5, -0.3, 0.8), 0.024],
  [at(-0.135, 0.28, -0.052), at(-0.7, -0.2, -0.7), 0.022],
  [at(-0.045, 0.235, -0.022), at(0.2, 0.3, -0.95), 0.024],
  [at(0.124, 0.445, -0.012), at(0.7, 0.6, 0.3), 0.027],
  [at(0.075, 0.38, -0.004), at(0.5, -0.4, 0.7), 0.024],
  [at(0.06, 0.37, -0.014), at(0.1, 0.5, -0.9), 0.022],
  [at(0.02, 0.345, 0.004), at(0.2, 0.1, 0.9), 0.022],
  [at(-0.09, 0.606, -0.005), at(-0.5, 0.8, 0.2), 0.026],
  [at(-0.05, 0.535, -0.004), at(-0.6, 0.1, 0.7), 0.023],
  [at(-0.035, 0.5, -0.017), at(0.1, -0.3, -0.9), 0.024],
  [at(0.033, 0.645, -0.02), at(0.3, 0.9, 0.2), 0.025],
  [at(0.08, 0.634, -0.058), at(0.7, 0.4, -0.6), 0.023],
  [at(0.01, 0.55, -0.012), at(0.4, 0, 0.9), 0.022],
];
const BUDS = [
  at(-0.1, 0.32, -0.036),
  at(0.1, 0.415, -0.018),
  at(-0.068, 0.57, -0.014),
  at(0.05, 0.6, -0.045),
  at(-0.014, 0.27, 0.006),
  at(0.012, 0.42, 0.006),
  at(0.022, 0.6, -0.006),
];
const PETALS = 5;

export function createBranch(): PropMesh {
  const mesh = new PropMesh();
  const { bark, blossom, blossomHeart, bud } = PROP_FINISH;
  mesh.addSolid(tube(STEM, STEM_RADII, [1, 1, 1]), bark);
  for (const [from, to] of TWIGS) mesh.addSolid(capsule(from, to, TWIG_RADIUS_M, TWIG_END_RADIUS_M), bark);
  BLOSSOMS.forEach(([centre, direction, radius], number) => {
    const facing = direction.clone().normalize();
    const right = new Vector3(facing.y, -facing.x, 0).normalize();
    const up = facing.clone().cross(right);
    const point = (angle: number, distance: number, height: number) =>
      centre
        .clone()
        .addScaledVector(right, Math.cos(angle) * distance * radius)
        .addScaledVector(up, Math.sin(angle) * distance * radius)
        .addScaledVector(facing, height * radius);
    for (let petal = 0; petal < PETALS; petal++) {
      const angle = ((petal + 0.37 * number) * 2 * Math.PI) / PETALS;
      const half = 0.92 * (Math.PI / PETALS);
      const corners = [
        point(angle, 0, 0),
        point(angle - half, 0.78, 0.3),
        point(angle - 0.4 * half, 1.05, 0.42),
        point(angle + 0.4 * half, 1.05, 0.42),
        point(angle + half, 0.78, 0.3),
      ];
      mesh.addFace(corners, blossom, blossom);
    }
    addOctahedron(mesh, point(0, 0, 0.16), 0.2 * radius, blossomHeart);
  });
  for (const place of BUDS) addOctahedron(mesh, place, 0.009, bud);
  return mesh;
}

function addOctahedron(mesh: PropMesh, centre: Vector3, radius: number, finish: Finish): void {
  const corner = (axis: number, sign: number) =>
    centre.clone().setComponent(axis, centre.getComponent(axis) + sign * radius);
  for (const x of [1, -1])
    for (const y of [1, -1])
      for (const z of [1, -1]) {
        const corners = [corner(0, x), corner(1, y), corner(2, z)];
        mesh.addFace(x * y * z > 0 ? corners : corners.toReversed(), finish);
      }
}
