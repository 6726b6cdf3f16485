import { Group, type Matrix4, type Mesh, PerspectiveCamera, Quaternion, Vector3 } from "three";
import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { PROP_FORMS } from "../../../src/motion/props";
import { JOINT_COUNT } from "../../../src/motion/skeleton";
import { ScreenProjection } from "../../../src/stage/camera/screen-projection";
import { PropGroup } from "../../../src/stage/props/prop-group";
import { SimplePropMaterial } from "../../../src/stage/props/prop-material";
import type { Performer } from "../../../src/stage/puppet/performer";
import type { PropPresence } from "../../../src/wire/messages";
import { EXTRAS, STORED_ID, writePropModel } from "../../prop-model-file";

const FLOOR_M = -0.05;
const FRAME_S = 1 / 60;
/** Performer whose hands are at a place and turned about y. */
class Hands {
  readonly group = new Group();
  turn = 0;

  constructor(readonly at: Vector3) {}

  hand(limb: number, _: number, out: Matrix4): Matrix4 {
    const rotation = new Quaternion().setFromAxisAngle(new Vector3(0, 1, 0), this.turn);
    const position = this.at.clone().add(new Vector3(limb === 0 ? 0.5 : -0.5, 0, 0));
    return out.compose(position, rotation, new Vector3(1, 1, 1));
  }
}

let props: PropGroup;
let [first, second]: Hands[] = [];

beforeEach(() => {
  props = new PropGroup();
  [first, second] = [new Hands(new Vector3(0, 1, 0)), new Hands(new Vector3(2, 1.5, 0))];
});

afterEach(() => void vi.unstubAllGlobals());

function show(seconds: number, ...shown: PropPresence[]): boolean {
  const performers = [first, second] as unknown as Performer[];
  const isNew = props.update(shown, performers, FLOOR_M, seconds);
  props.group.updateMatrixWorld();
  return isNew;
}

const held = (limb: number | null, kind = "fan", prop = 0): PropPresence => ({ prop, kind, limb, place: [1, 2, 0.3] });
const meshes = () => props.group.children as Mesh[];
const positionOf = (mesh: Mesh) => new Vector3().setFromMatrixPosition(mesh.matrixWorld);

/** Return the positions of the first prop in frames that show it in this state. */
function positionsWhile(frames: number, prop: PropPresence): Vector3[] {
  return Array.from({ length: frames }, () => {
    show(FRAME_S, prop);
    return positionOf(meshes()[0]);
  });
}

test("a prop appears where it is, and follows the hand", () => {
  expect(show(FRAME_S, held(0))).toBe(true);
  expect(positionOf(meshes()[0]).toArray()).toEqual([0.5, 1, 0]);
  first.at.y = 1.4;
  expect(show(FRAME_S, held(0))).toBe(false);
  expect(positionOf(meshes()[0]).y).toBeCloseTo(1.4, 9);
  first.turn = 1;
  show(FRAME_S, held(0));
  const shaft = new Vector3(0, 1, 0).transformDirection(meshes()[0].matrixWorld);
  expect(shaft.distanceTo(new Vector3(Math.sin(1), 0, Math.cos(1)))).toBeLessThan(1e-9);
});

test("a prop lies on the floor", () => {
  show(FRAME_S, held(null, "umbrella"));
  expect(positionOf(meshes()[0]).toArray()).toEqual([1, FLOOR_M + PROP_FORMS.umbrella.rest.height, 2]);
});

test.each([
  ["taken", held(null), held(0)],
  ["passed to another performer", held(0), held(5)],
  ["passed to the other hand", held(0), held(1)],
  ["laid down", held(1), held(null)],
  ["moved on the floor", held(null), { ...held(null), place: [0, 0, 2] }],
])("a prop that is %s moves there in a quarter of a second without a jump", (_, before, after) => {
  show(FRAME_S, before);
  const start = positionOf(meshes()[0]);
  const path = [start, ...positionsWhile(16, after)];
  show(Infinity, after);
  const end = positionOf(meshes()[0]);
  expect(path[1].distanceTo(start)).toBeLessThan(0.05 * end.distanceTo(start));
  for (let at = 1; at < path.length; at++)
    expect(path[at].distanceTo(path[at - 1])).toBeLessThan(0.15 * end.distanceTo(start));
  expect(path[12].distanceTo(end)).toBeGreaterThan(1e-3);
  expect(path[15].distanceTo(end)).toBeLessThan(1e-9);
});

test("another change on the way starts where the prop is", () => {
  show(FRAME_S, held(0));
  const [last] = positionsWhile(8, held(5)).slice(-1);
  const [next] = positionsWhile(1, held(null));
  expect(next.distanceTo(last)).toBeLessThan(0.1);
});

test("with reduced motion nothing eases", () => {
  show(Infinity, held(0));
  show(Infinity, held(5));
  expect(positionOf(meshes()[0]).toArray()).toEqual([1.5, 1.5, 0]);
});

test("props that are removed, unknown or held by an unseen performer are not drawn", () => {
  show(FRAME_S, held(0), held(null, "sword", 1), held(4, "ball", 2), held(9, "branch", 3));
  expect(meshes().map(({ name, visible }) => visible && name)).toEqual(["fan", "ball", false]);
  second.group.visible = false;
  show(FRAME_S, held(0), held(4, "ball", 2));
  expect(meshes().map(({ visible }) => visible)).toEqual([true, false]);
  show(FRAME_S, held(4, "ball", 2));
  expect(meshes().map(({ name }) => name)).toEqual(["ball"]);
});

test("props of a kind share a shape, and cast shadows", () => {
  expect(show(FRAME_S, held(0), held(4, "fan", 1))).toBe(true);
  expect(meshes().length).toBe(2);
  expect(new Set(meshes().map(({ geometry }) => geometry)).size).toBe(1);
  for (const mesh of meshes()) expect(mesh.castShadow && mesh.receiveShadow).toBe(true);
});

test("the quality applies to props that are there and to later ones", () => {
  show(FRAME_S, held(0));
  props.usesSimpleMaterials = true;
  show(FRAME_S, held(0), held(1, "ball", 1));
  for (const mesh of meshes()) expect(mesh.material).toBeInstanceOf(SimplePropMaterial);
  props.usesSimpleMaterials = false;
  expect(new Set(meshes().map(({ material }) => material)).size).toBe(1);
  expect(meshes()[0].material).not.toBeInstanceOf(SimplePropMaterial);
});

test("boxes contain the props, and those in hands count for the framing", () => {
  const camera = new PerspectiveCamera(40, 1, 0.1, 100);
  camera.position.set(1.5, 1, 6);
  camera.updateMatrixWorld();
  const projection = new ScreenProjection(camera);
  Object.assign(projection, { width: 800, height: 800 });
  show(FRAME_S, held(null, "umbrella"));
  expect(props.reach(camera)).toBe(0);
  show(Infinity, held(4, "umbrella"));
  const [box] = props.boxes(projection);
  const positions = meshes()[0].geometry.getAttribute("position");
  for (let at = 0; at < positions.count; at++) {
    const { x, y } = projection.toScreen(
      new Vector3().fromBufferAttribute(positions, at).applyMatrix4(meshes()[0].matrixWorld),
    );
    expect(x > box.left && x < box.right && y > box.top && y < box.bottom).toBe(true);
  }
  expect(props.reach(camera)).toBeGreaterThan(0.2);
});

test("a stored prop is drawn once its model has come, in a hand that closes then, and others are drawn meanwhile", async () => {
  let resolve: (response: Response) => void = () => undefined;
  vi.stubGlobal("fetch", () => new Promise((respond) => (resolve = respond)));
  const shown = [held(0, STORED_ID), held(null, "ball", 1)];
  const pose = { root: Float64Array.of(0, 1, 0), rotations: new Float64Array(JOINT_COUNT * 4) };
  show(FRAME_S, ...shown);
  expect(meshes().map(({ name }) => name)).toEqual(["ball"]);
  expect(props.closeHands([pose], shown, Infinity)).toEqual([pose]);
  resolve(new Response(writePropModel()));
  await expect.poll(() => show(FRAME_S, ...shown)).toBe(true);
  const [, staff] = meshes();
  expect(staff.name).toBe(STORED_ID);
  expect(positionOf(staff).toArray()).toEqual([0.5, 1, 0]);
  expect(staff.geometry.getAttribute("color").getX(0)).toBe(1);
  expect(staff.geometry.getAttribute("finish").getX(1)).toBeCloseTo(0.50196, 4);
  const [closed] = props.closeHands([pose], shown, Infinity);
  expect(closed?.hands?.hands.counts.some((count) => count > 0)).toBe(true);
  show(Infinity, held(null, STORED_ID));
  expect(positionOf(meshes()[0]).y).toBeCloseTo(FLOOR_M + EXTRAS.height, 6);
});

test("the geometry of a kind is freed with its last prop", () => {
  const freed: string[] = [];
  show(FRAME_S, held(0), held(1, "ball", 1), held(4, "fan", 2));
  for (const { geometry, name } of meshes()) geometry.addEventListener("dispose", () => freed.push(name));
  show(FRAME_S, held(0));
  expect(freed).toEqual(["ball"]);
  show(FRAME_S);
  expect(freed).toEqual(["ball", "fan", "fan"]);
  expect(show(FRAME_S, held(0))).toBe(true);
});
