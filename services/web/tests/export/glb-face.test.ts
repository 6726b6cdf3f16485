import { AnimationMixer, type SkinnedMesh, Vector3 } from "three";
import { GLTFLoader } from "three/examples/jsm/loaders/GLTFLoader.js";
import { describe, expect, test } from "vitest";
import { type PuppetModel, writeGlb } from "../../src/export/glb";
import { faceWeightsAt, type SampledMotion } from "../../src/export/sampled-motion";
import { EXPRESSIONS, expressionIndex } from "../../src/motion/face";
import { createPuppetModel } from "../../src/stage/puppet/puppet-model";
import { createStandardFigure } from "../stage/puppet/figures";
import { joinParts, maxJointError, runToCompletion, turningMotion, withFace } from "./motions";

interface GlbJson {
  nodes: { name: string; mesh?: number; skin?: number }[];
  meshes: {
    name: string;
    primitives: { targets?: { POSITION: number }[]; attributes: Record<string, number>; indices: number }[];
    weights?: number[];
    extras?: { targetNames: string[] };
  }[];
  accessors: { count: number; type: string; min?: number[]; max?: number[] }[];
  animations: {
    channels: { sampler: number; target: { node: number; path: string } }[];
    samplers: { input: number; output: number }[];
  }[];
}

const figure = createStandardFigure();
const model = createPuppetModel(figure);

async function write(...motions: SampledMotion[]): Promise<ArrayBuffer> {
  const models = new Map<unknown, PuppetModel>([[figure, model]]);
  const puppets = motions.map((motion) => {
    models.set(motion.figure, models.get(motion.figure) ?? createPuppetModel(motion.figure));
    return { motion, model: models.get(motion.figure) as PuppetModel };
  });
  return joinParts(runToCompletion(writeGlb(puppets, "a dance", null)));
}

function parseJson(file: ArrayBuffer): GlbJson {
  return JSON.parse(new TextDecoder().decode(new Uint8Array(file, 20, new DataView(file).getUint32(12, true))));
}

async function read(...motions: SampledMotion[]) {
  const { scene, animations } = await new GLTFLoader().parseAsync(await write(...motions), "");
  const mixer = new AnimationMixer(scene);
  mixer.clipAction(animations[0]).play();
  const partsOf = (name: string) => (scene.getObjectByName(name)?.children ?? []) as SkinnedMesh[];
  return { scene, animations, mixer, partsOf };
}

test("three.js plays the weights of a face as morph targets", async () => {
  const motion = withFace(turningMotion({ figure }), "jawOpen", "mouthSmileLeft", "happy", "gazeYaw");
  const { scene, animations, mixer, partsOf } = await read(motion);
  const parts = partsOf("face");
  expect(parts).toHaveLength(2);
  for (const part of parts)
    expect(Object.keys(part.morphTargetDictionary ?? {})).toEqual([
      "jawOpen",
      "mouthSmileLeft",
      "mouthSmileRight",
      "happy",
      "gazeYaw",
    ]);
  for (let frame = 0; frame < motion.frames - 1; frame++) {
    mixer.setTime(frame / motion.fps);
    const weights = faceWeightsAt(motion, frame) as Float64Array;
    for (const { morphTargetDictionary, morphTargetInfluences } of parts)
      for (const [name, target] of Object.entries(morphTargetDictionary ?? {}))
        expect(morphTargetInfluences?.[target]).toBeCloseTo(weights[expressionIndex(name)], 5);
  }
  expect(maxJointError(motion, scene, animations[0])).toBeLessThan(1e-4);
});

test("a motion without a face has no morph targets, and its head is part of the figure", async () => {
  const { nodes, meshes, animations } = parseJson(await write(turningMotion({ figure })));
  expect(meshes.map(({ name, primitives }) => [name, primitives.length])).toEqual([["figure", 2]]);
  expect(meshes[0].primitives.some((primitive) => "targets" in primitive)).toBe(false);
  expect(nodes.map(({ name }) => name)).not.toContain("face");
  expect(animations[0].channels.map(({ target }) => target.path)).not.toContain("weights");
});

describe("several performers", () => {
  const motions = [
    withFace(turningMotion({ figure, place: { x: -1, z: 0, turn: 0 } }), "jawOpen", "aa"),
    turningMotion({ figure, place: { x: 1, z: 0, turn: 0 } }),
    withFace(turningMotion({ figure, place: { x: 0, z: 1, turn: 0 } }), "eyeBlinkLeft"),
    withFace(turningMotion({ figure, place: { x: 0, z: 2, turn: 0 } }), "jawOpen", "aa"),
  ];

  test("have the targets of their own faces, and share what is equal", async () => {
    const json = parseJson(await write(...motions));
    const named = (name: string) => json.nodes.find((node) => node.name === name);
    const targetsOf = (name: string) => json.meshes[named(name)?.mesh ?? -1]?.extras?.targetNames;
    expect(targetsOf("face 1")).toEqual(["jawOpen", "aa"]);
    expect(named("face 2")).toBe(undefined);
    expect(targetsOf("face 3")).toEqual(["eyeBlinkLeft", "eyeBlinkRight"]);
    expect(json.meshes[named("face 4")?.mesh ?? -1]).toEqual(json.meshes[named("face 1")?.mesh ?? -1]);
    expect(named("face 4")?.skin).toBe(named("puppet 4")?.skin);
    const figures = json.meshes.filter(({ name }) => name === "figure");
    expect(new Set(figures.map(({ primitives }) => primitives[0].attributes["POSITION"])).size).toBe(1);
  });

  test("follow the rules of morph targets (glTF 2.0, 3.7.2.2 and 3.11)", async () => {
    const { nodes, meshes, accessors, animations } = parseJson(await write(...motions));
    for (const { primitives, weights, extras } of meshes) {
      const count = primitives[0].targets?.length;
      expect([weights?.length, extras?.targetNames.length]).toEqual([count, count]);
      for (const { targets, attributes, indices } of primitives) {
        expect(targets?.length).toBe(count);
        expect(accessors[indices].count % 3).toBe(0);
        for (const accessor of Object.values(attributes))
          expect(accessors[accessor].count).toBe(accessors[attributes["POSITION"]].count);
        for (const { POSITION } of targets ?? []) {
          expect(accessors[POSITION].count).toBe(accessors[attributes["POSITION"]].count);
          expect([accessors[POSITION].min?.length, accessors[POSITION].max?.length]).toEqual([3, 3]);
        }
      }
    }
    const moved = animations[0].channels.filter(({ target }) => target.path === "weights");
    expect(moved.map(({ target }) => nodes[target.node].name)).toEqual(["face 1", "face 3", "face 4"]);
    for (const { sampler, target } of moved) {
      const { input, output } = animations[0].samplers[sampler];
      const targets = meshes[nodes[target.node].mesh as number].weights?.length as number;
      expect(accessors[output]).toMatchObject({ type: "SCALAR", count: accessors[input].count * targets });
    }
  });

  test("open their own mouths", async () => {
    const { mixer, partsOf } = await read(...motions);
    mixer.setTime(0.5);
    const first = partsOf("face_1")[1].morphTargetInfluences?.slice();
    expect(first?.[0]).toBeGreaterThan(0.1);
    expect(partsOf("face_4")[1].morphTargetInfluences).toEqual(first);
    expect(partsOf("face_3")[1].morphTargetInfluences?.[1]).toBe(0);
  });
});

test("all expressions add at most 0.8 MB", async () => {
  const motion = turningMotion({ figure });
  const [bare, faced] = await Promise.all([write(motion), write(withFace(motion, ...EXPRESSIONS))]);
  expect(faced.byteLength - bare.byteLength).toBeLessThan(800_000);
});

test("the skin moves the face with the head", async () => {
  const motion = withFace(turningMotion({ figure }), "cheekPuff");
  const { scene, mixer, partsOf } = await read(motion);
  const head = scene.getObjectByName("skullbase");
  const [, face] = partsOf("face");
  const at = new Vector3();
  const placeOf = (seconds: number) => {
    mixer.setTime(seconds);
    scene.updateMatrixWorld(true);
    face.getVertexPosition(40, at).applyMatrix4(face.matrixWorld);
    return head?.worldToLocal(at).toArray() ?? [];
  };
  const atRest = placeOf(0);
  placeOf(0.8).forEach((value, axis) => expect(value).toBeCloseTo(atRest[axis], 5));
});
