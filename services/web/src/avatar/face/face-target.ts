/** Expressions that an avatar can show: those of a VRM file, or morph targets of a plain glTF file. */
import type { VRM } from "@pixiv/three-vrm";
import { Mesh, type Object3D } from "three";
import { expressionOfName, isExactName } from "./expression-name";

/** An expression of an avatar under the name that a performer's face has for it. */
export interface FaceTarget {
  readonly name: string;
  setWeight(weight: number): void;
  /** Return to the weight of the file. */
  reset(): void;
}

/** Presets of VRM that the direction of the eyes sets. */
const LOOK_PRESETS = ["lookLeft", "lookRight", "lookUp", "lookDown"];

/** Return the expressions of a VRM file that change something, presets before custom ones of the same name. */
export function findVrmTargets({ expressionManager }: Pick<VRM, "expressionManager">): FaceTarget[] {
  if (!expressionManager) return [];
  const { presetExpressionMap, customExpressionMap } = expressionManager;
  const found = new Map<string, FaceTarget>();
  const named = [
    ...Object.entries(presetExpressionMap).map(([own, expression]) => ({ own, name: own, expression })),
    ...Object.entries(customExpressionMap).map(([own, expression]) => ({
      own,
      name: expressionOfName(own),
      expression,
    })),
  ];
  for (const { own, name, expression } of named) {
    if (name === null || LOOK_PRESETS.includes(name) || found.has(name) || !expression?.binds.length) continue;
    found.set(name, {
      name,
      setWeight: (weight) => expressionManager.setValue(own, weight),
      reset: () => expressionManager.setValue(own, 0),
    });
  }
  return [...found.values()];
}

/** Return the morph targets of all meshes that are named as expressions. */
export function findMorphTargets(root: Object3D): FaceTarget[] {
  const found = new Map<string, { influences: number[]; index: number; rest: number }[]>();
  root.traverse((mesh) => {
    if (!(mesh instanceof Mesh)) return;
    const { morphTargetDictionary: names, morphTargetInfluences: influences } = mesh as Mesh;
    if (!names || !influences) return;
    const own = new Map<string, number>();
    for (const [morph, index] of Object.entries(names)) {
      const name = expressionOfName(morph);
      if (name !== null && (!own.has(name) || isExactName(morph))) own.set(name, index);
    }
    for (const [name, index] of own) {
      const morphs = found.get(name) ?? [];
      found.set(name, morphs);
      morphs.push({ influences, index, rest: influences[index] });
    }
  });
  return [...found].map(([name, morphs]) => ({
    name,
    setWeight: (weight) => {
      for (const { influences, index } of morphs) influences[index] = weight;
    },
    reset: () => {
      for (const { influences, index, rest } of morphs) influences[index] = rest;
    },
  }));
}
