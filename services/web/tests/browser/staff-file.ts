/** Model file of a staff, as a user has one. */
import { joinChunks } from "../prop-model-file";

/** Length and width of the staff in metres. */
const [LENGTH_M, WIDTH_M] = [0.9, 0.03];
const FACES = [
  0, 2, 1, 0, 3, 2, 4, 5, 6, 4, 6, 7, 0, 1, 5, 0, 5, 4, 1, 2, 6, 1, 6, 5, 2, 3, 7, 2, 7, 6, 3, 0, 4, 3, 4, 7,
];

/**
 * Return a GLB file of a red staff, an upright box whose origin is a quarter up. `share` varies its length, so that the
 * files of several tests differ.
 */
export function createStaffGlb(share: number): Buffer<ArrayBuffer> {
  const length = LENGTH_M * share;
  const [low, high, half] = [-length / 4, (3 * length) / 4, WIDTH_M / 2];
  const square = [
    [-half, half],
    [half, half],
    [half, -half],
    [-half, -half],
  ];
  const positions = [low, high].flatMap((y) => square.flatMap(([x, z]) => [x, y, z]));
  const binary = new Uint8Array(positions.length * 4 + FACES.length * 2);
  binary.set(new Uint8Array(Float32Array.from(positions).buffer));
  binary.set(new Uint8Array(Uint16Array.from(FACES).buffer), positions.length * 4);
  const json = {
    asset: { version: "2.0" },
    scenes: [{ nodes: [0] }],
    nodes: [{ mesh: 0 }],
    meshes: [{ primitives: [{ attributes: { POSITION: 0 }, indices: 1, material: 0 }] }],
    materials: [{ pbrMetallicRoughness: { baseColorFactor: [0.8, 0.05, 0.05, 1], metallicFactor: 0 } }],
    accessors: [
      {
        bufferView: 0,
        componentType: 5126,
        count: 8,
        type: "VEC3",
        min: [-half, low, -half],
        max: [half, high, half],
      },
      { bufferView: 1, componentType: 5123, count: FACES.length, type: "SCALAR" },
    ],
    bufferViews: [
      { buffer: 0, byteLength: positions.length * 4 },
      { buffer: 0, byteOffset: positions.length * 4, byteLength: FACES.length * 2 },
    ],
    buffers: [{ byteLength: binary.length }],
  };
  return Buffer.from(joinChunks(JSON.stringify(json), binary));
}
