/** The solver of one figure's limbs, its arm tables fetched from the IK service. */

import { readTable } from "../marionette/arm";
import { armProportions, ArmRig, LegRig } from "../marionette/limbs";
import { Plane } from "../marionette/plane";
import { type Figure, LIMB_JOINTS, type Pose } from "../motion/skeleton";
import { ProblemError } from "./library";
import type { Solver } from "./solver";

/** After a longer pause the plane swings as if only this had passed, seconds. */
const LONGEST_STEP = 0.1;

/** The four limbs of a figure, with the memory of the planes its arms hang in. */
export class Marionette implements Solver {
  private readonly arms: readonly [ArmRig, ArmRig];
  private readonly legs: readonly [LegRig, LegRig];
  private readonly planes = [new Plane(), new Plane()] as const;
  /** When each arm was solved last, local milliseconds; null where it rests. */
  private readonly solvedAt: (number | null)[] = [null, null];
  private readonly hung = new Float64Array(12);
  /** For each limb the quaternions last seen: of the pose (12), and as hung (12). */
  private readonly seen = [0, 1, 2, 3].map(() => ({ known: false, pose: new Float64Array(12), hung: new Float64Array(12) }));
  private readonly up = new Float64Array(3);
  private readonly normal = new Float64Array(3);
  private readonly direction = new Float64Array(3);

  /** `tables` are what `readTable` gave for the left and the right arm. */
  constructor(figure: Figure, tables: readonly [Float64Array, Float64Array]) {
    this.arms = [new ArmRig(figure, 0, tables[0]), new ArmRig(figure, 1, tables[1])];
    this.legs = [new LegRig(figure, 2), new LegRig(figure, 3)];
  }

  target(pose: Pose, limb: number, out: Float64Array): void {
    if (limb < 2) {
      this.arms[limb].target(out, 0, pose.rotations);
    } else {
      out[0] = this.legs[limb - 2].angle(pose.rotations);
      out[1] = out[2] = 0;
    }
  }

  solve(pose: Pose, limb: number, target: Float64Array, weight: number, nowMs: number): void {
    if (limb < 2) this.hangArm(pose, limb, target, nowMs);
    else this.legs[limb - 2].hang(this.hung, 0, target[0], pose.rotations);
    const seen = this.seen[limb];
    for (let joint = 0; joint < 3; joint++) {
      const at = (LIMB_JOINTS[limb] + joint) * 4;
      if (seen.known) carryOn(pose.rotations, at, seen.pose, joint * 4);
      seen.pose.set(pose.rotations.subarray(at, at + 4), joint * 4);
      carryOn(this.hung, joint * 4, seen.known ? seen.hung : seen.pose, joint * 4);
      seen.hung.set(this.hung.subarray(joint * 4, joint * 4 + 4), joint * 4);
      mix(pose.rotations, at, this.hung, joint * 4, weight);
    }
    seen.known = true;
  }

  rest(limb: number): void {
    this.seen[limb].known = false;
    if (limb < 2) this.solvedAt[limb] = null;
  }

  private hangArm(pose: Pose, limb: number, target: Float64Array, nowMs: number): void {
    const { up, normal, direction } = this;
    const rig = this.arms[limb], plane = this.planes[limb], before = this.solvedAt[limb];
    rig.up(up, 0, pose.rotations);
    rig.direction(direction, 0, target, 0);
    if (before === null) {
      rig.restingNormal(normal, 0, target, 0, up, 0);
      plane.start(normal, direction);
    } else {
      const seconds = Math.min(Math.max(nowMs - before, 0) / 1000, LONGEST_STEP);
      plane.follow(direction, rig.arm.clamp(Math.hypot(target[0], target[1], target[2])), up, seconds);
    }
    this.solvedAt[limb] = nowMs;
    rig.hang(this.hung, 0, target, 0, up, 0, plane.normal, 0);
  }
}

/** Of the two quaternions of one rotation, the nearer to `before`. */
function carryOn(q: Float64Array, at: number, before: Float64Array, beforeAt: number): void {
  let dot = 0;
  for (let i = 0; i < 4; i++) dot += q[at + i] * before[beforeAt + i];
  if (dot < 0) for (let i = 0; i < 4; i++) q[at + i] = -q[at + i];
}

/**
 * Brings `q` on to `goal` by `weight`, at even speed. It goes the way their signs say, the longer one too: were it always the
 * shorter, the joint would be thrown across where the two come to be opposite on the way.
 */
function mix(q: Float64Array, at: number, goal: Float64Array, goalAt: number, weight: number): void {
  let dot = 0;
  for (let i = 0; i < 4; i++) dot += q[at + i] * goal[goalAt + i];
  const angle = Math.acos(Math.min(Math.max(dot, -1), 1)), sine = Math.sin(angle);
  const straight = sine < 1e-6;
  const u = straight ? 1 - weight : Math.sin((1 - weight) * angle) / sine;
  const v = straight ? weight : Math.sin(weight * angle) / sine;
  for (let i = 0; i < 4; i++) q[at + i] = u * q[at + i] + v * goal[goalAt + i];
}

/** The solver of `figure`, its tables from the service at `origin`; rejects with `ProblemError` where there are none. */
export async function fetchMarionette(figure: Figure, origin: string): Promise<Solver> {
  const tables = await Promise.all(([0, 1] as const).map((limb) => fetchTable(figure, limb, origin)));
  return new Marionette(figure, [tables[0], tables[1]]);
}

async function fetchTable(figure: Figure, limb: 0 | 1, origin: string): Promise<Float64Array> {
  const { identity } = armProportions(figure, limb);
  let answer: Response;
  try {
    answer = await fetch(`${origin}/v1/arms/${identity}/table`);
  } catch {
    throw ProblemError.unreachable();
  }
  if (!answer.ok) throw ProblemError.from(answer.status, await answer.text());
  return readTable(new Uint8Array(await answer.arrayBuffer()));
}
