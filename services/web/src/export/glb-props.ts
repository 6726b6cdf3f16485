/** Props of a GLB file: meshes that move with the hands of the puppets, or lie on the floor. */

import type { PropState } from "../codec/extension/props";
import type { PropModel, PropShape } from "../motion/prop-model";
import { PropMovement } from "../motion/prop-movement";
import {
  createPropTransform,
  GRIP_SHARE,
  heldTransform,
  laidTransform,
  type PropForm,
  type PropTransform,
} from "../motion/props";
import { multiply, type Numbers, rotate } from "../motion/rotation";
import { JOINTS, TIP_JOINTS } from "../motion/skeleton";
import { addScaled, fromCoordinateAxis } from "../motion/vector";
import { limbWithinPerformer, performerOfLimb } from "../wire/limbs";
import type { ExportSkeleton } from "./export-skeleton";
import { frameTimes, type GltfBuilder, writeRotation } from "./gltf";
import type { SampledMotion } from "./sampled-motion";

/** A prop of a motion, with its state in each frame; null while it is not on the stage. */
export interface SampledProp {
  readonly kind: string;
  readonly states: readonly (PropState | null)[];
}

/** Joints of the balls of the feet, which stand on the floor. */
const BALLS = ["l_midtarsal", "r_midtarsal"] as const;

/** Path of a performer's hands and feet on the stage. */
export class PerformerPath {
  /** Grips: [frame][left, right][x y z], metres, and [frame][left, right][w x y z]. */
  private readonly positions: Float64Array;
  private readonly rotations: Float64Array;
  /** Height of the lower ball of the feet by frame, metres. */
  private readonly heights: Float64Array;

  /** `skeleton` is that of the file, whose rotations are recorded; `soleHeight` that of the balls above the floor. */
  constructor(
    private readonly skeleton: ExportSkeleton,
    private readonly motion: Pick<SampledMotion, "figure" | "placement" | "frames" | "fps">,
    private readonly soleHeight: number,
  ) {
    this.positions = new Float64Array(motion.frames * 6);
    this.rotations = new Float64Array(motion.frames * 8);
    this.heights = new Float64Array(motion.frames);
  }

  /** Record a frame: the position of the root, and the rotations [joint][w x y z] in the frames of the parents. */
  record(frame: number, root: Numbers, rotations: Numbers): void {
    const { placement, figure } = this.motion;
    fromCoordinateAxis(placing, 0, 1, placement.turn);
    for (let hand = 0; hand < 2; hand++) {
      const joint = TIP_JOINTS[hand + 1];
      for (let i = 0; i < 3; i++) position[i] = figure.tips[joint * 3 + i] * GRIP_SHARE;
      this.carry(JOINTS[joint], root, rotations);
      rotate(position, 0, placing, 0, position, 0);
      multiply(rotation, 0, placing, 0, rotation, 0);
      position[0] += placement.x;
      position[2] += placement.z;
      this.positions.set(position, (frame * 2 + hand) * 3);
      this.rotations.set(rotation, (frame * 2 + hand) * 4);
    }
    const heights = BALLS.map((ball) => {
      position.fill(0);
      this.carry(ball, root, rotations);
      return position[1];
    });
    this.heights[frame] = Math.min(...heights);
  }

  /** Return the grip of a hand (0 left, 1 right) at a time in seconds: that of the nearest frame. */
  gripAt(seconds: number, hand: number): PropTransform {
    const { fps, frames } = this.motion;
    const at = Math.min(Math.round(seconds * fps), frames - 1) * 2 + hand;
    return {
      position: this.positions.subarray(at * 3, at * 3 + 3),
      rotation: this.rotations.subarray(at * 4, at * 4 + 4),
    };
  }

  /** Height of the floor: the one on which the performer stands for most of the time. */
  get floorHeight(): number {
    return this.heights.toSorted()[Math.floor(this.heights.length / 2)] - this.soleHeight;
  }

  /** Carry `position` from the frame of a joint to that of the motion, and set `rotation` to that of the joint. */
  private carry(name: string, root: Numbers, rotations: Numbers): void {
    const { parents, offsets } = this.skeleton;
    rotation.set([1, 0, 0, 0]);
    for (let joint = this.skeleton.indexOf(name); joint >= 0; joint = parents[joint]) {
      rotate(position, 0, rotations, joint * 4, position, 0);
      multiply(rotation, 0, rotations, joint * 4, rotation, 0);
      if (parents[joint] < 0) addScaled(position, 0, position, 0, root, 0, 1);
      else addScaled(position, 0, position, 0, offsets, joint * 3, 1);
    }
  }
}

/** Model of a prop, and its name in the file. */
export interface NamedPropModel extends PropModel {
  readonly name: string;
}

/** Props of a motion, and the models of their kinds. */
export interface ExportedProps {
  readonly props: readonly SampledProp[];
  readonly models: ReadonlyMap<string, NamedPropModel>;
}

/**
 * Add the props that have a model, their meshes to `meshes`, and their movement in these frames. A prop that is not on
 * the stage has no size. Return the nodes, which belong to the root of the scene.
 */
export function addProps(
  asset: GltfBuilder,
  meshes: object[],
  { props, models }: ExportedProps,
  performers: readonly PerformerPath[],
  { frames, fps }: Pick<SampledMotion, "frames" | "fps">,
): number[] {
  const times = asset.addAccessor(frameTimes(frames, fps), "SCALAR", { bounded: true });
  const floorHeight = Math.min(...performers.map((performer) => performer.floorHeight));
  const meshOf = new Map<string, number>();
  let number = 0;
  return props.flatMap(({ kind, states }) => {
    const model = models.get(kind);
    if (!model) return [];
    const { name, form, shape } = model;
    const mesh = meshOf.get(kind) ?? meshes.push(createMesh(asset, name, shape)) - 1;
    meshOf.set(kind, mesh);
    const node = asset.nodes.push({ name: `prop ${++number} ${name}`, mesh }) - 1;
    const [translations, rotations] = [new Float32Array(frames * 3), new Float32Array(frames * 4)];
    const scales = new Float32Array(frames * 3);
    const movement = new PropMovement();
    for (let frame = 0; frame < frames; frame++) {
      const state = states[frame] ?? null;
      const place = state && transformAt(form, state, performers, floorHeight, frame / fps);
      if (state && place) {
        movement.moveTo(place, state, 1 / fps);
        scales.fill(1, frame * 3, frame * 3 + 3);
      } else movement.hide();
      translations.set(movement.transform.position, frame * 3);
      writeRotation(rotations, frame * 4, movement.transform.rotation, 0);
    }
    asset.addChannel(node, "translation", times, translations);
    asset.addChannel(node, "rotation", times, rotations);
    if (scales.includes(0)) asset.addChannel(node, "scale", times, scales, "STEP");
    return [node];
  });
}

/** Return where a prop is at a time; null if the file has not the performer who holds it. */
function transformAt(
  form: PropForm,
  { limb, place }: PropState,
  performers: readonly PerformerPath[],
  floorHeight: number,
  seconds: number,
): PropTransform | null {
  if (limb === null) return laidTransform(form, place, floorHeight, transform);
  const hand = limbWithinPerformer(limb);
  const grip = performers[performerOfLimb(limb)]?.gripAt(seconds, hand);
  return grip ? heldTransform(form, hand, grip, transform) : null;
}

function createMesh(asset: GltfBuilder, name: string, { positions, normals, colours, indices }: PropShape): object {
  const vertices = (values: ArrayLike<number>, bounded = false) =>
    asset.addAccessor(Float32Array.from(values), "VEC3", { target: "vertices", bounded });
  const attributes = { POSITION: vertices(positions, true), NORMAL: vertices(normals), COLOR_0: vertices(colours) };
  const triangles = asset.addAccessor(Uint16Array.from(indices), "SCALAR", { target: "indices" });
  return { name, primitives: [{ attributes, material: 0, indices: triangles }] };
}

const position = new Float64Array(3);
const rotation = new Float64Array(4);
const placing = new Float64Array(4);
const transform = createPropTransform();
