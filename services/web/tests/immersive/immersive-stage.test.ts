import { Group, Matrix4, Vector3, type WebGLRenderer } from "three";
import { beforeEach, expect, test } from "vitest";
import type { ImmersiveFrame } from "../../src/engine/message";
import { ImmersiveStage } from "../../src/immersive/immersive-stage";
import { type Figure, type Pose, restPose } from "../../src/motion/skeleton";
import type { Performer } from "../../src/stage/puppet/performer";
import type { PropPresence } from "../../src/wire/messages";
import { createStandardFigure } from "../stage/puppet/figures";

/** Performer without a mesh, whose rings are at its root. */
class FakePerformer implements Performer {
  readonly group = new Group();
  readonly scale = 1;
  readonly height = 1.75;
  readonly root = new Matrix4();
  readonly ground = 0.1;
  showsReflection = false;
  usesSimpleMaterials = false;
  constructor(readonly figure: Figure) {}
  apply({ root }: Pose): void {
    this.root.setPosition(root[0], root[1], root[2]);
  }
  handle(_: number, out: Vector3): Vector3 {
    return out.setFromMatrixPosition(this.root);
  }
  hand(_limb: number, _share: number, out: Matrix4): Matrix4 {
    return out;
  }
  joint(): Matrix4 {
    return this.root;
  }
  toStreamedHandle(_: number, to: Vector3): Vector3 {
    return to;
  }
  dispose(): void {
    this.group.removeFromParent();
  }
}

const FIGURES = [createStandardFigure(), createStandardFigure()];
/** Viewer in the middle of the room, who looks along -z. */
const VIEWER = new Matrix4().setPosition(0, 1.6, 0);

let stage: ImmersiveStage;

beforeEach(() => {
  const renderer = {
    getRenderTarget: () => null,
    setRenderTarget: () => undefined,
    render: () => undefined,
    compile: () => undefined,
    setClearColor: () => undefined,
  } as unknown as WebGLRenderer;
  stage = new ImmersiveStage(renderer, { theme: "night", size: "1:1", isSimple: true, reducedMotion: true });
  for (const performer of [0, 1]) stage.setPerformerFactory((figure) => new FakePerformer(figure), performer);
  stage.camera.matrix.copy(VIEWER);
});

/** Show performers at these places, of which one is selected. */
function show(
  places: [x: number, z: number][],
  performer = 0,
  canMove = true,
  figures: Figure[] | null = FIGURES,
  props: readonly PropPresence[] = [],
): void {
  const poses = places.map(([x, z]) => {
    const pose = restPose();
    pose.root.set([x, 1, z]);
    return pose;
  });
  const frame: ImmersiveFrame = { figures, front: 0, poses, strings: [], lights: [], props, performer, grips: [] };
  stage.apply(frame, 0.02, canMove);
  stage.updateMatrices();
}

/** Return the place in the room where a performer is, and the height of its floor there. */
function inRoom(performer: number): { x: number; floor: number; z: number } {
  const at = stage.ringOf(4 * performer) as Vector3;
  const { x, y, z } = at.setY(0.1).applyMatrix4(stage.placement.matrix.clone().invert());
  return { x, floor: y, z };
}

test("the selected performer stands on the floor before the viewer", () => {
  show(
    [
      [3, 2],
      [4, 2],
    ],
    1,
  );
  const { x, floor, z } = inRoom(1);
  expect([x, floor]).toEqual([expect.closeTo(0), expect.closeTo(0)]);
  expect(z).toBeCloseTo(-1);
  // The viewer looks at its front: the first performer is to its right, on the viewer's left.
  expect(inRoom(0).x).toBeCloseTo(-1);
});

test("the stage stands still while the performer dances, and moves with one who leaves", () => {
  show([[0, 0]]);
  show([[0.6, 0.2]], 0, true, null);
  expect(inRoom(0).x).toBeCloseTo(0.6);
  show([[5, 0]], 0, false, null);
  expect(inRoom(0).x).toBeCloseTo(5);
  show([[5, 0]], 0, true, null);
  expect(inRoom(0).x).toBeCloseTo(0);
});

test("the next performer comes before the viewer, unless a hand pulls a limb", () => {
  show([
    [0, 0],
    [1, 0],
  ]);
  show(
    [
      [0, 0],
      [1, 0],
    ],
    1,
    true,
    null,
  );
  expect([inRoom(1).x, inRoom(1).z]).toEqual([expect.closeTo(0), expect.closeTo(-1)]);
  show(
    [
      [0, 0],
      [1, 0],
    ],
    0,
    false,
    null,
  );
  expect(inRoom(1).x).toBeCloseTo(0);
});

test("another size takes effect once no hand pulls a limb, on a pedestal", () => {
  show([[0, 0]]);
  stage.size = "1:4";
  show([[0, 0]], 0, false, null);
  expect([stage.size, stage.placement.size, inRoom(0).floor]).toEqual(["1:4", "1:1", expect.closeTo(0)]);
  show([[0, 0]], 0, true, null);
  expect(stage.placement.size).toBe("1:4");
  expect(inRoom(0).floor).toBeCloseTo(0.98);
});

test("props are on the floor of the stage and in hands", () => {
  const laid = { prop: 0, kind: "ball", limb: null, place: [0.5, 0.2, 0] };
  show([[0, 0]], 0, true, FIGURES, [laid, { prop: 1, kind: "fan", limb: 1, place: [0, 0, 0] }]);
  const [ball, fan] = stage.scene.getObjectByName("props")?.children ?? [];
  const { x, y, z } = new Vector3().setFromMatrixPosition(ball.matrixWorld);
  // Above the floor by its radius.
  expect([x, y, z]).toEqual([0.5, 0.1 + 0.11, 0.2].map((value) => expect.closeTo(value, 9)));
  expect(fan.visible).toBe(true);
});

test("without a pose nothing is placed, and no ring is reached", () => {
  expect(stage.ringOf(0)).toBe(null);
  stage.apply(
    { figures: FIGURES, front: 0, poses: [null], strings: [], lights: [], props: [], performer: 0, grips: [] },
    0,
    true,
  );
  expect(stage.ringOf(0)).toBe(null);
});
