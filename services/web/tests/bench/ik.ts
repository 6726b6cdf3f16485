/**
 * One run of `make bench-ik` in Node: Bunraku's solver, three.js's `CCDIKSolver` and `closed-chain-ik` solve the same
 * targets alternately, after a warm-up. Reads JSON from standard input and prints a JSON object as its last line.
 */

import { readFileSync } from "node:fs";
import { Goal, Joint, Link, Solver } from "closed-chain-ik/src/core/index.js";
import { Bone, BufferGeometry, MeshBasicMaterial, Skeleton, SkinnedMesh, Vector3 } from "three";
import { CCDIKSolver } from "three/examples/jsm/animation/CCDIKSolver.js";
import { Arm, NUMBERS_PER_ARM, parseBendTable } from "../../src/marionette/arm";
import { MAX_ELBOW_BEND_RAD, MAX_WRIST_BEND_RAD } from "../../src/marionette/constants";
import { type Proportions, parseProportions } from "../../src/marionette/proportions";

interface BenchInput {
  /** Arms, and hand tips (x, y, z each) for which the Python solver's results are compared. */
  bodies: { proportions: string; table: string; checked: number[] }[];
  /**
   * Hand tips for the last body by name of their order, in arm lengths from the shoulder, y up. Their number is a
   * multiple of `BATCH_SIZE`.
   */
  orders: Record<string, number[]>;
}

/** Targets per call of `solve`. */
const BATCH_SIZE = 500;
const ROUNDS = 5;

interface Contender {
  /** Solve for `count` targets, starting at index `from` of `targets` (x, y, z each). */
  solve(targets: Float64Array, from: number, count: number): void;
  /** Return the position of the hand tip. */
  tip(): ArrayLike<number>;
}

function createOwnSolver(proportions: Proportions, table: Float64Array): Contender {
  const arm = new Arm(proportions, table),
    out = new Float64Array(BATCH_SIZE * NUMBERS_PER_ARM);
  return {
    solve: (targets, from, count) => arm.solveArms(out, 0, targets, from, count),
    tip: () => out.subarray(8, 11),
  };
}

/** Create a contender from a solver that takes one target per call. */
function solveOneByOne(solve: (x: number, y: number, z: number) => void, tip: () => ArrayLike<number>): Contender {
  return {
    solve: (targets, from, count) => {
      for (let at = from; at < from + 3 * count; at += 3) solve(targets[at], targets[at + 1], targets[at + 2]);
    },
    tip,
  };
}

/**
 * Create three.js's solver: three links that hang from the shoulder, and a bone as the target. It starts from the last
 * pose.
 */
function createCcdIk({ upper, forearm: fore, hand }: Proportions, limited: boolean): Contender {
  const [root, shoulder, elbow, wrist, tip, target] = Array.from({ length: 6 }, () => new Bone());
  root.add(shoulder, target);
  shoulder.add(elbow);
  elbow.add(wrist);
  wrist.add(tip);
  elbow.position.set(0, -upper, 0);
  wrist.position.set(0, -fore, 0);
  tip.position.set(0, -hand, 0);
  const mesh = new SkinnedMesh(new BufferGeometry(), new MeshBasicMaterial());
  mesh.add(root);
  mesh.bind(new Skeleton([root, shoulder, elbow, wrist, tip, target]));
  mesh.updateMatrixWorld(true);
  const hinge = (limit: number) =>
    limited ? { rotationMin: new Vector3(-limit, 0, 0), rotationMax: new Vector3(0, 0, 0) } : {};
  const links = [{ index: 3, ...hinge(MAX_WRIST_BEND_RAD) }, { index: 2, ...hinge(MAX_ELBOW_BEND_RAD) }, { index: 1 }];
  const solver = new CCDIKSolver(mesh, [{ target: 5, effector: 4, links, iteration: 10 }]);
  return solveOneByOne(
    (x, y, z) => {
      target.position.set(x, y, z);
      target.updateMatrixWorld();
      solver.update();
    },
    () => tip.matrixWorld.elements.slice(12, 15),
  );
}

/** Degrees of freedom by their closed-chain-ik index: translations, then rotations. */
const [X, Y, Z, EX, EY, EZ] = [0, 1, 2, 3, 4, 5];

/**
 * Create closed-chain-ik's solver: a free shoulder, and hinges without limits at elbow and wrist, because poses rarely
 * reach the limits. By default it stops after five iterations and when progress stalls; here it may continue until its
 * error is below 0.001.
 */
function createClosedChainIk({ upper, forearm: fore, hand }: Proportions): Contender {
  const base = new Link(),
    end = new Link(),
    goal = new Goal();
  let last = base;
  [
    [0, EX, EY, EZ],
    [upper, EX],
    [fore, EX],
  ].forEach(([offset, ...degreesOfFreedom], nth) => {
    const joint = new Joint(),
      link = nth === 2 ? end : new Link();
    joint.setDoF(...degreesOfFreedom);
    joint.setPosition(0, -offset, 0);
    if (nth > 0) joint.setDoFValues(-0.5);
    last.addChild(joint);
    joint.addChild(link);
    last = link;
  });
  end.setPosition(0, -hand, 0);
  goal.setGoalDoF(X, Y, Z);
  goal.makeClosure(end);
  const solver = new Solver(base),
    position: number[] = [0, 0, 0];
  solver.maxIterations = 50;
  solver.stallThreshold = 1e-6;
  solver.divergeThreshold = 1;
  return solveOneByOne(
    (x, y, z) => {
      goal.setPosition(x, y, z);
      solver.solve();
    },
    () => {
      end.updateMatrixWorld();
      end.getWorldPosition(position);
      return position;
    },
  );
}

const input = JSON.parse(readFileSync(0, "utf8")) as BenchInput;

/**
 * Solve for `count` targets in batches. Returns processor time in milliseconds, because other processes share the
 * machine.
 */
function run(contender: Contender, targets: Float64Array, count: number): number {
  const began = process.cpuUsage();
  for (let done = 0, from = 0; done < count; done += BATCH_SIZE, from = (from + 3 * BATCH_SIZE) % targets.length) {
    contender.solve(targets, from, BATCH_SIZE);
  }
  const { user, system } = process.cpuUsage(began);
  return (user + system) / 1e3;
}

/** Return the mean distance of the tip from its target over the first `count` targets, in arm lengths. */
function tipError(contender: Contender, targets: Float64Array, count: number): number {
  let sum = 0;
  for (let at = 0; at < 3 * count; at += 3) {
    contender.solve(targets, at, 1);
    const tip = contender.tip();
    sum += Math.hypot(tip[0] - targets[at], tip[1] - targets[at + 1], tip[2] - targets[at + 2]);
  }
  return sum / count;
}

const body = input.bodies[input.bodies.length - 1];
const shape = parseProportions(body.proportions),
  table = parseBendTable(Buffer.from(body.table, "base64"));
// `count` is the number of solves per round: some hundredths of a second for each solver.
const contenders: Record<string, { contender: Contender; count: number }> = {
  ours: { contender: createOwnSolver(shape, table), count: 500_000 },
  ccdik_10: { contender: createCcdIk(shape, false), count: 2_500 },
  ccdik_10_with_limits: { contender: createCcdIk(shape, true), count: 2_500 },
  closed_chain_ik: { contender: createClosedChainIk(shape), count: 500 },
};
const measured = Object.entries(input.orders).map(([order, list]) => {
  const targets = Float64Array.from(list);
  const errors: Record<string, number> = {},
    rates: Record<string, number[]> = {};
  for (const [name, { contender, count }] of Object.entries(contenders)) {
    errors[name] = tipError(contender, targets, 1_000);
    run(contender, targets, 2 * count);
    rates[name] = [];
  }
  for (let round = 0; round < ROUNDS; round++) {
    for (const [name, { contender, count }] of Object.entries(contenders)) {
      rates[name].push((count / run(contender, targets, count)) * 1e3);
    }
  }
  return [order, { rates, errors }];
});

// Results for the targets that the Python solver checks.
const solved = input.bodies.map(({ proportions, table, checked }) => {
  const arm = new Arm(parseProportions(proportions), parseBendTable(Buffer.from(table, "base64")));
  const out = new Float64Array(NUMBERS_PER_ARM),
    angles = new Float64Array(3),
    targets = Float64Array.from(checked);
  return Array.from({ length: checked.length / 3 }, (_, nth) => {
    arm.solveArms(out, 0, targets, 3 * nth);
    const level = Math.hypot(out[8], out[10]);
    arm.solveAngles(angles, 0, arm.clampDistance(Math.hypot(level, out[9])), Math.atan2(out[9], level));
    return [...out, ...angles];
  });
});
console.log(JSON.stringify({ orders: Object.fromEntries(measured) as object, solved }));
