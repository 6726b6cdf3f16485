/** Face of a VRM Animation: nodes whose movement gives the weights of expressions and the gaze. */

import { expressionIndex, faceExpressionNames, GAZE } from "../motion/face";
import { findGazeSource, gazeFrom } from "../motion/gaze";
import { multiply } from "../motion/rotation";
import { fromCoordinateAxis } from "../motion/vector";
import { type GltfBuilder, writeRotation } from "./gltf";
import { faceWeightsAt, type SampledMotion } from "./sampled-motion";

/** Presets of VRM 1.0 that files may animate. */
const PRESETS = "happy angry sad relaxed surprised neutral aa ih ou ee oh blink blinkLeft blinkRight".split(" ");
/** Presets that the gaze sets. */
const LOOK_PRESETS = ["lookLeft", "lookRight", "lookUp", "lookDown"];

/** Parts of the extension for a face. */
export interface VrmaFace {
  expressions?: { preset: Record<string, { node: number }>; custom: Record<string, { node: number }> };
  lookAt?: { node: number };
  /** Nodes of the expressions and the gaze, which have no parents. */
  nodes: number[];
}

/**
 * Add the face of a motion: presets of VRM, and blend shapes of ARKit as custom expressions, by the x component of
 * translations; the gaze as a rotation, unless the blend shapes have it. `times` is the accessor of the frames' times.
 */
export function addFace(asset: GltfBuilder, motion: SampledMotion, times: number): VrmaFace {
  const { face, frames } = motion;
  const nodes: number[] = [];
  if (!face) return { nodes };
  const addNode = (name: string) => {
    nodes.push(asset.nodes.push({ name }) - 1);
    return nodes[nodes.length - 1];
  };
  const expressions: NonNullable<VrmaFace["expressions"]> = { preset: {}, custom: {} };
  for (const name of faceExpressionNames(face.face)) {
    if (GAZE.includes(name) || LOOK_PRESETS.includes(name)) continue;
    const expression = expressionIndex(name);
    const translations = new Float32Array(frames * 3);
    for (let frame = 0; frame < frames; frame++)
      translations[frame * 3] = faceWeightsAt(motion, frame)?.[expression] ?? 0;
    const node = addNode(name);
    expressions[PRESETS.includes(name) ? "preset" : "custom"][name] = { node };
    asset.addChannel(node, "translation", times, translations);
  }
  const source = findGazeSource(face.face);
  if (!source || source === "eyes") return { expressions, nodes };
  const rotations = new Float32Array(frames * 4);
  const gaze = { yaw: 0, pitch: 0 };
  const turn = new Float64Array(8);
  for (let frame = 0; frame < frames; frame++) {
    gazeFrom(source, faceWeightsAt(motion, frame) as Float64Array, gaze);
    fromCoordinateAxis(turn, 0, 1, gaze.yaw);
    // A rotation about x is positive downwards.
    fromCoordinateAxis(turn, 4, 0, -gaze.pitch);
    multiply(turn, 0, turn, 0, turn, 4);
    writeRotation(rotations, frame * 4, turn, 0);
  }
  const node = addNode("lookAt");
  asset.addChannel(node, "rotation", times, rotations);
  return { expressions, lookAt: { node }, nodes };
}
