/**
 * Drawing of meshes without a graphics processor: a z-buffer with Gouraud shading. It draws the film of a person in
 * milliseconds a picture, on any machine alike.
 */
import { type Camera, Color, type Group, Matrix4, Mesh, type MeshBasicMaterial, Vector3 } from "three";

export interface Picture {
  readonly width: number;
  readonly height: number;
  /** Red, green and blue of each pixel, 0 to 255, sRGB. */
  readonly pixels: Uint8ClampedArray;
}

const KEY_LIGHT = new Vector3(0.45, 0.6, 0.75).normalize();
const FILL_LIGHT = new Vector3(-0.8, 0.1, 0.5).normalize();
/** Shares of the light: of the key, of the fill, from above, and from everywhere. */
const [KEY, FILL, SKY, AMBIENT] = [0.62, 0.16, 0.14, 0.3];
const [WALL, FLOOR] = [new Color("#b7ae9f"), new Color("#8a7762")];

/** Draw the meshes of a group before a wall. World matrices must be up to date. */
export function drawPicture(group: Group, camera: Camera, width: number, height: number): Picture {
  camera.updateMatrixWorld(true);
  const pixels = new Uint8ClampedArray(width * height * 3);
  fillBackground(pixels, width, height);
  const depths = new Float32Array(width * height).fill(Infinity);
  const toClip = new Matrix4().multiplyMatrices(camera.projectionMatrix, camera.matrixWorldInverse);
  group.traverse((object) => {
    if (object instanceof Mesh)
      drawMesh(object as Mesh<never, MeshBasicMaterial>, toClip, { width, height, pixels }, depths);
  });
  return { width, height, pixels };
}

function fillBackground(pixels: Uint8ClampedArray, width: number, height: number): void {
  const colour = new Color();
  for (let y = 0; y < height; y++) {
    const share = Math.min(1, Math.max(0, (y / height - 0.86) * 12));
    const [red, green, blue] = colour.lerpColors(WALL, FLOOR, share).convertLinearToSRGB().toArray();
    for (let at = y * width * 3; at < (y + 1) * width * 3; at += 3)
      pixels.set([red * 255, green * 255, blue * 255], at);
  }
}

function drawMesh(mesh: Mesh<never, MeshBasicMaterial>, toClip: Matrix4, picture: Picture, depths: Float32Array): void {
  const { position, normal } = mesh.geometry["attributes"] as Record<string, { count: number; array: Float32Array }>;
  const index = (mesh.geometry as { index: { array: Uint16Array } | null }).index?.array;
  const [world, normalMatrix] = [mesh.matrixWorld, mesh.matrixWorld.clone().invert().transpose()];
  // Position on the screen, depth and colour of each vertex.
  const vertices = new Float32Array(position.count * 6);
  const point = new Vector3();
  const colour = new Color();
  for (let vertex = 0; vertex < position.count; vertex++) {
    point.fromArray(normal.array, vertex * 3).transformDirection(normalMatrix);
    const light =
      AMBIENT +
      KEY * Math.max(0, point.dot(KEY_LIGHT)) +
      FILL * Math.max(0, point.dot(FILL_LIGHT)) +
      SKY * (0.5 + 0.5 * point.y);
    colour.copy(mesh.material.color).multiplyScalar(light).convertLinearToSRGB();
    point
      .fromArray(position.array, vertex * 3)
      .applyMatrix4(world)
      .applyMatrix4(toClip);
    const at = vertex * 6;
    vertices[at] = (point.x * 0.5 + 0.5) * picture.width;
    vertices[at + 1] = (0.5 - point.y * 0.5) * picture.height;
    vertices[at + 2] = point.z;
    colour.toArray(vertices, at + 3);
  }
  const count = index?.length ?? position.count;
  for (let corner = 0; corner < count; corner += 3) {
    const [a, b, c] = [0, 1, 2].map((nth) => (index ? index[corner + nth] : corner + nth) * 6);
    drawTriangle(vertices, a, b, c, picture, depths);
  }
}

function drawTriangle(
  v: Float32Array,
  a: number,
  b: number,
  c: number,
  { width, height, pixels }: Picture,
  depths: Float32Array,
): void {
  const area = (v[b] - v[a]) * (v[c + 1] - v[a + 1]) - (v[c] - v[a]) * (v[b + 1] - v[a + 1]);
  // Seen from behind, or a line.
  if (area > -1e-9) return;
  const left = Math.max(0, Math.floor(Math.min(v[a], v[b], v[c])));
  const right = Math.min(width - 1, Math.ceil(Math.max(v[a], v[b], v[c])));
  const top = Math.max(0, Math.floor(Math.min(v[a + 1], v[b + 1], v[c + 1])));
  const bottom = Math.min(height - 1, Math.ceil(Math.max(v[a + 1], v[b + 1], v[c + 1])));
  for (let y = top; y <= bottom; y++)
    for (let x = left; x <= right; x++) {
      const [px, py] = [x + 0.5, y + 0.5];
      const wa = ((v[b] - px) * (v[c + 1] - py) - (v[c] - px) * (v[b + 1] - py)) / area;
      const wb = ((v[c] - px) * (v[a + 1] - py) - (v[a] - px) * (v[c + 1] - py)) / area;
      const wc = 1 - wa - wb;
      if (wa < 0 || wb < 0 || wc < 0) continue;
      const depth = wa * v[a + 2] + wb * v[b + 2] + wc * v[c + 2];
      const pixel = y * width + x;
      if (depth >= depths[pixel] || depth < -1) continue;
      depths[pixel] = depth;
      for (let part = 3; part < 6; part++)
        pixels[pixel * 3 + part - 3] = 255 * (wa * v[a + part] + wb * v[b + part] + wc * v[c + part]);
    }
}
