/** The puppeteers' crossbars of turned wood, with a gold hook that the thread hangs from, as one instanced mesh. */
import {
  BufferGeometry,
  Color,
  Euler,
  Float32BufferAttribute,
  InstancedMesh,
  Matrix4,
  MeshStandardMaterial,
  Quaternion,
  Vector3,
} from "three";
import { MAX_LIMBS } from "../../wire/limbs";
import { lathe, ring, type Surface } from "../puppet/surface";

const MAX_BARS = MAX_LIMBS;
/** A turned rod: (position, radius) in fractions of its length. */
const ROD_PROFILE = [
  [0, 0.0001],
  [0.004, 0.0152],
  [0.03, 0.0247],
  [0.06, 0.019],
  [0.09, 0.0228],
  [0.3, 0.0323],
  [0.5, 0.038],
  [0.7, 0.0323],
  [0.91, 0.0228],
  [0.94, 0.019],
  [0.97, 0.0247],
  [0.996, 0.0152],
  [1, 0.0001],
];

export interface ControlBar {
  position: Vector3;
  /** Rotation about the view direction, in radians. */
  roll: number;
  size: number;
}

/** Distance of the hook below the bar's centre, in metres. */
export const HOOK_OFFSET_M = 0.028;

function createGeometry(): BufferGeometry {
  const detail = { columns: 10, rows: "profile" } as const;
  const crossRod = lathe(new Vector3(-0.15, 0, 0), new Vector3(0.15, 0, 0), ROD_PROFILE, detail);
  const mainRod = lathe(new Vector3(0, 0.008, -0.1), new Vector3(0, 0.008, 0.1), ROD_PROFILE, detail);
  const binding = ring(new Vector3(0, 0.012, 0), new Vector3(0, 1, 0), 0.017, 0.0032);
  const hook = ring(new Vector3(0, -0.018, 0), new Vector3(0, 0, 1), 0.01, 0.0022);
  const parts: [Surface, string][] = [
    [crossRod, "#b98653"],
    [mainRod, "#8b5a33"],
    [binding, "#d2a656"],
    [hook, "#d2a656"],
  ];
  const [positions, normals, colours, indices]: number[][] = [[], [], [], []];
  for (const [surface, hex] of parts) {
    const part = surface("full");
    const first = positions.length / 3;
    const { r, g, b } = new Color(hex);
    positions.push(...part.positions);
    // These surfaces are wound inwards.
    normals.push(...part.normals.map((x) => -x));
    for (let i = 0; i < part.positions.length; i += 3) colours.push(r, g, b);
    for (let i = 0; i < part.indices.length; i += 3)
      indices.push(part.indices[i + 1] + first, part.indices[i] + first, part.indices[i + 2] + first);
  }
  const all = new BufferGeometry();
  all.setAttribute("position", new Float32BufferAttribute(positions, 3));
  all.setAttribute("normal", new Float32BufferAttribute(normals, 3));
  all.setAttribute("color", new Float32BufferAttribute(colours, 3));
  all.setIndex(indices);
  return all;
}

export class ControlBars {
  readonly mesh: InstancedMesh;
  readonly #matrix = new Matrix4();
  readonly #rotation = new Quaternion();

  constructor() {
    const material = new MeshStandardMaterial({
      vertexColors: true,
      roughness: 0.42,
      metalness: 0.05,
      envMapIntensity: 1.8,
    });
    material.emissive.set("#3a2412");
    material.emissiveIntensity = 0.55;
    this.mesh = new InstancedMesh(createGeometry(), material, MAX_BARS);
    this.mesh.name = "bars";
    this.mesh.count = 0;
    this.mesh.frustumCulled = false;
  }

  set(bars: readonly ControlBar[]): void {
    this.mesh.count = bars.length;
    bars.forEach(({ position: at, roll, size }, i) => {
      this.#rotation.setFromEuler(new Euler(0.42, 0.55, roll));
      this.mesh.setMatrixAt(i, this.#matrix.compose(at, this.#rotation, new Vector3(size, size, size)));
    });
    this.mesh.instanceMatrix.needsUpdate = true;
  }
}
