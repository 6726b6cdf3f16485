import { AnimationMixer, type Matrix4, type Mesh, Quaternion, Vector3 } from "three";
import { GLTFLoader } from "three/examples/jsm/loaders/GLTFLoader.js";
import { describe, expect, test } from "vitest";
import type { PropState } from "../../src/codec/extension/props";
import { writeGlb } from "../../src/export/glb";
import type { NamedPropModel, SampledProp } from "../../src/export/glb-props";
import type { SampledMotion } from "../../src/export/sampled-motion";
import { PROP_FORMS, PROP_KINDS } from "../../src/motion/props";
import { JOINTS, TIP_JOINTS } from "../../src/motion/skeleton";
import { readPropModel } from "../../src/stage/props/prop-file";
import { createPropShape } from "../../src/stage/props/prop-shape";
import { createPuppetModel } from "../../src/stage/puppet/puppet-model";
import { EXTRAS, STORED_ID, writePropModel } from "../prop-model-file";
import { createOtherFigure } from "../stage/puppet/figures";
import { extendedMotion, joinParts, runToCompletion, turningMotion } from "./motions";

const FPS = 30;
const FRAMES = 40;
/** Frames that a prop takes to another place. */
const MOVE_FRAMES = 8;
const ON_FLOOR: PropState = { limb: null, place: [1, -0.5, 0.4] };

/** Write motions with props as GLB and read them with three.js. Return the nodes at a frame. */
async function read(motions: SampledMotion[], props: SampledProp[], stored?: NamedPropModel) {
  const puppets = motions.map((motion) => ({ motion, model: createPuppetModel(motion.figure) }));
  const models = new Map<string, NamedPropModel>(
    PROP_KINDS.map((kind) => [kind, { name: kind, form: PROP_FORMS[kind], shape: createPropShape(kind) }]),
  );
  if (stored) models.set(STORED_ID, stored);
  const exported = { props, models };
  const file = await joinParts(runToCompletion(writeGlb(puppets, "a dance", null, exported)));
  const { scene, animations } = await new GLTFLoader().parseAsync(file, "");
  const mixer = new AnimationMixer(scene);
  mixer.clipAction(animations[0]).play();
  return {
    scene,
    at(frame: number) {
      mixer.setTime((frame + 1e-3) / FPS);
      scene.updateMatrixWorld(true);
      const prop = (name: string) => scene.getObjectByName(name) as Mesh;
      /** Return the grip of a hand of the file's puppet. */
      const grip = (performer: number, hand: number) => {
        const wrist = JOINTS[TIP_JOINTS[hand + 1]];
        const joints: Matrix4[] = [];
        // three.js numbers equal names.
        scene.traverse(({ name, matrixWorld }) => name.replace(/_\d$/, "") === wrist && joints.push(matrixWorld));
        const { tips } = motions[performer].figure;
        return new Vector3()
          .fromArray(tips, TIP_JOINTS[hand + 1] * 3)
          .multiplyScalar(0.5)
          .applyMatrix4(joints[performer]);
      };
      return { prop, grip };
    },
  };
}

const positionOf = (mesh: Mesh) => new Vector3().setFromMatrixPosition(mesh.matrixWorld);
const throughout = (state: PropState | null) => Array.from({ length: FRAMES }, () => state);

describe("a prop in a GLB file", () => {
  test.each([
    ["turning", turningMotion()],
    [
      "differently proportioned, placed",
      turningMotion({ figure: createOtherFigure(), place: { x: 2, z: -1, turn: 0.8 } }),
    ],
    ["extended", { ...extendedMotion(0), fps: FPS }],
  ] as [string, SampledMotion][])("follows the hand of a %s motion", async (_, motion) => {
    const states = Array.from({ length: motion.frames }, (): PropState => ({ limb: 1, place: [0, 0, 0] }));
    const { at } = await read([motion], [{ kind: "fan", states }]);
    for (const frame of [0, 7, Math.min(23, motion.frames - 2)]) {
      const { prop, grip } = at(frame);
      expect(positionOf(prop("prop_1_fan")).distanceTo(grip(0, 1)), String(frame)).toBeLessThan(2e-3);
      expect(prop("prop_1_fan").scale.x).toBe(1);
    }
  });

  test("is in the hand of the second performer, and moves to the floor in a quarter of a second", async () => {
    const motions = [turningMotion(), turningMotion({ place: { x: -1.5, z: 0, turn: 0 } })];
    const states = throughout({ limb: 4, place: [0, 0, 0] }).fill(ON_FLOOR, 20);
    const { at } = await read(motions, [{ kind: "umbrella", states }]);
    const before = at(19);
    expect(positionOf(before.prop("prop_1_umbrella")).distanceTo(before.grip(1, 0))).toBeLessThan(2e-3);
    const path = Array.from({ length: MOVE_FRAMES + 2 }, (_, frame) =>
      positionOf(at(19 + frame).prop("prop_1_umbrella")),
    );
    const steps = path.slice(1).map((place, index) => place.distanceTo(path[index]));
    const way = path[0].distanceTo(path.at(-1) as Vector3);
    expect(Math.max(...steps)).toBeLessThan(0.3 * way);
    const laid = at(35).prop("prop_1_umbrella");
    expect([laid.position.x, laid.position.z]).toEqual([expect.closeTo(1, 5), expect.closeTo(-0.5, 5)]);
    const shaft = new Vector3(0, 1, 0).applyQuaternion(laid.getWorldQuaternion(new Quaternion()));
    expect(shaft.y).toBeCloseTo(Math.cos(PROP_FORMS.umbrella.rest.pitch), 4);
  });

  test("is seen only while it is on the stage", async () => {
    const states = throughout(ON_FLOOR).fill(null, 0, 10).fill(null, 30);
    const { at } = await read([turningMotion()], [{ kind: "ball", states }]);
    expect([5, 9, 10, 20, 29, 30, 38].map((frame) => at(frame).prop("prop_1_ball").scale.x)).toEqual([
      0, 0, 1, 1, 1, 0, 0,
    ]);
  });

  test("has no size if the file has not its performer", async () => {
    const { at } = await read([turningMotion()], [{ kind: "ball", states: throughout({ limb: 4, place: [0, 0, 0] }) }]);
    expect(at(5).prop("prop_1_ball").scale.x).toBe(0);
  });

  test("shares its mesh with others of its kind, and has its colours", async () => {
    const { scene } = await read(
      [turningMotion()],
      [0, 1].map((limb) => ({ kind: "branch", states: throughout({ limb, place: [0, 0, 0] }) })),
    );
    const [first, second] = ["prop_1_branch", "prop_2_branch"].map((name) => scene.getObjectByName(name) as Mesh);
    expect(first.geometry).toBe(second.geometry);
    const { indices, colours } = createPropShape("branch");
    expect(first.geometry.index?.count).toBe(indices.length);
    expect(first.geometry.getAttribute("color").count).toBe(colours.length / 3);
  });

  test("of a kind without a model is left out", async () => {
    const kinds = [STORED_ID, "ball"];
    const { scene } = await read(
      [turningMotion()],
      kinds.map((kind) => ({ kind, states: throughout(ON_FLOOR) })),
    );
    expect(scene.getObjectByName("prop_1_ball")).toBeDefined();
    expect(scene.getObjectByName("prop_2_ball")).toBeUndefined();
  });

  test("that is stored has its name, mesh and form", async () => {
    const stored = { ...readPropModel(writePropModel()), name: "sword" };
    const { at } = await read([turningMotion()], [{ kind: STORED_ID, states: throughout(ON_FLOOR) }], stored);
    const { at: atFan } = await read([turningMotion()], [{ kind: "fan", states: throughout(ON_FLOOR) }]);
    const { geometry, position } = at(3).prop("prop_1_sword");
    const floor = atFan(3).prop("prop_1_fan").position.y - PROP_FORMS.fan.rest.height;
    expect([...(geometry.index?.array ?? [])]).toEqual([0, 1, 2, 1, 3, 2]);
    expect(position.y).toBeCloseTo(floor + EXTRAS.height, 4);
  });
});
