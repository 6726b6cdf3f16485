/**
 * The puppeteer's limbs, by limb number over all performers: translates inputs in the audience's frame to messages for
 * the session.
 */
import { Vector3 } from "three";
import type { Puppeteer } from "../client/puppeteer";
import type { Viewer } from "../client/viewer";
import { JOINTS } from "../motion/skeleton";
import { handlePosition, type Performer } from "../stage/puppet/performer";
import type { Stage } from "../stage/stage";
import { CROWD, limbWithinPerformer, MAX_LIMBS, performerOfLimb } from "../wire/limbs";
import {
  fromShoulderFrame,
  orientationOf,
  positionOf,
  solveThighAngle,
  toChestFrame,
  toShoulderFrame,
} from "./target-frame";

/**
 * Source that holds a limb: a pointer or a hand in VR that it follows, inputs (keys, gamepad, buttons) that set its
 * velocity, or a hand before the camera.
 */
export type HoldSource = "pointer" | "velocity" | "camera";

/** Shortest thread of a pull of the crowd, in metres. */
const MIN_THREAD_M = 0.18;
/** Minimum interval between two pulls on a limb with the crowd, in milliseconds. */
const CROWD_PULL_INTERVAL_MS = 50;

/** Viewer of the session, through which limbs are pulled with the crowd. */
export type CrowdMember = Pick<Viewer, "presence" | "pull">;

export class LimbController {
  /** Called when the limbs held here change. */
  onChange: () => void = () => undefined;
  readonly #stage: Stage;
  #puppeteer: Puppeteer | null = null;
  #crowdMember: CrowdMember | null = null;
  /** Local time of the last pull of each limb that is pulled with the crowd. */
  readonly #crowdPulls = new Map<number, number>();
  /** Index: limb number. */
  readonly #sources: (HoldSource | null)[] = Array<null>(MAX_LIMBS).fill(null);
  readonly #pullTargets: (Vector3 | null)[] = Array<null>(MAX_LIMBS).fill(null);

  /** `now` returns local milliseconds. */
  constructor(
    stage: Stage,
    private readonly now: () => number = () => performance.now(),
  ) {
    this.#stage = stage;
  }

  /** Viewer of the session; set it before the puppeteer. */
  set crowdMember(member: CrowdMember | null) {
    this.#crowdMember = member;
  }

  /** Return whether a limb is open to the crowd, and no puppeteer holds it. */
  isOpen(limb: number): boolean {
    const presence = this.#crowdMember?.presence;
    const holder = presence?.limbs[limb] ?? CROWD;
    return holder === CROWD && (presence?.crowd ?? []).some((open) => open.limb === limb);
  }

  /** Return whether a limb is pulled here with the crowd: then it is not held here. */
  isCrowdPull(limb: number): boolean {
    return this.#crowdPulls.has(limb);
  }

  /** Connection to the session. Setting it forgets the limbs held in another session. */
  set puppeteer(puppeteer: Puppeteer | null) {
    this.#puppeteer = puppeteer;
    for (let limb = 0; limb < MAX_LIMBS; limb++) this.#clearLimb(limb);
  }

  /** Return the source that holds a limb here, or null. */
  source(limb: number): HoldSource | null {
    return this.#sources[limb];
  }

  /** True if any limb is held here. */
  get isHoldingAny(): boolean {
    return this.#sources.some((source) => source !== null);
  }

  /** Return the target of a limb in world metres; null if it moves by velocity or is not held. */
  pullTarget(limb: number): Vector3 | null {
    return this.#pullTargets[limb];
  }

  /**
   * Claim a limb; one already held here changes its source. Return false without a session. A pointer pulls a limb that
   * is open to the crowd with it, and does not claim it.
   */
  claim(limb: number, source: HoldSource): boolean {
    if (source === "pointer" && this.#sources[limb] === null && this.isOpen(limb)) {
      this.#sources[limb] = source;
      this.#crowdPulls.set(limb, -Infinity);
      this.onChange();
      return true;
    }
    if (!this.#puppeteer || this.#puppeteer.isClosed) return false;
    const held = this.#sources[limb] !== null && !this.#crowdPulls.delete(limb);
    this.#sources[limb] = source;
    if (!held) this.#puppeteer.claim(limb);
    this.onChange();
    return true;
  }

  release(limb: number): void {
    if (this.#sources[limb] === null) return;
    const isHeld = !this.isCrowdPull(limb);
    this.#clearLimb(limb);
    if (isHeld) this.#puppeteer?.release(limb);
    this.onChange();
  }

  /** Release all limbs from `firstLimb` on. */
  releaseAll(firstLimb = 0): void {
    for (let limb = firstLimb; limb < MAX_LIMBS; limb++) this.release(limb);
  }

  /** Handle a refused claim or a revoked limb. */
  onRefused(limb: number): void {
    this.#clearLimb(limb);
    this.onChange();
  }

  /** Pull a limb's handle to a world position. */
  pullTo(limb: number, to: Vector3): void {
    const performer = this.#stage.performers[performerOfLimb(limb)];
    if (!performer || this.#sources[limb] === null) return;
    const limbIndex = limbWithinPerformer(limb);
    this.#pullTargets[limb] = to.clone();
    // In the measures of the streamed figure, whichever performer is shown.
    const handleTarget = performer.toStreamedHandle(limbIndex, to, new Vector3());
    const side = limbIndex % 2 === 0 ? "l" : "r";
    if (limbIndex < 2) this.pullHand(limb, handleTarget);
    else {
      const hip = positionOf(performer.joint(`${side}_hip`));
      const angle = solveThighAngle(
        handleTarget,
        hip,
        orientationOf(performer.joint("sacroiliac")),
        jointOffset(performer, `${side}_knee`).length(),
      );
      this.#sendTarget(limb, angle, 0, 0);
    }
  }

  /** Pull the handle of a streamed figure's hand to a world position. */
  pullHand(limb: number, handle: Vector3): void {
    const performer = this.#stage.performers[performerOfLimb(limb)];
    if (!performer || this.#sources[limb] === null) return;
    const limbIndex = limbWithinPerformer(limb);
    const side = limbIndex === 0 ? "l" : "r";
    const wrist = performer.joint(`${side}_wrist`);
    const fingers = jointTip(performer, `${side}_wrist`).applyMatrix4(wrist);
    const tip = fingers.sub(handlePosition(performer, limbIndex, new Vector3())).add(handle);
    const shoulder = positionOf(performer.joint(`${side}_shoulder`));
    const chest = orientationOf(performer.joint("vl5"));
    const { x, y, z } = toShoulderFrame(tip, shoulder, chest, armLength(performer, side));
    this.#sendTarget(limb, x, y, z);
  }

  #sendTarget(limb: number, x: number, y: number, z: number): void {
    const pulledAt = this.#crowdPulls.get(limb);
    if (pulledAt === undefined) this.#puppeteer?.target(limb, x, y, z);
    else if (this.now() - pulledAt >= CROWD_PULL_INTERVAL_MS) {
      this.#crowdMember?.pull(limb, x, y, z);
      this.#crowdPulls.set(limb, this.now());
    }
  }

  /**
   * Return where the threads of the crowd's pulls of a hand end, in world metres: from its handle towards each place, in
   * the shoulder's frame. A leg has none.
   */
  crowdThreads(limb: number, places: readonly (readonly number[])[]): Vector3[] {
    const performer = this.#stage.performers[performerOfLimb(limb)];
    const limbIndex = limbWithinPerformer(limb);
    if (!performer || limbIndex >= 2) return [];
    const side = limbIndex === 0 ? "l" : "r";
    const handle = performer.handle(limbIndex, new Vector3());
    const shoulder = positionOf(performer.joint(`${side}_shoulder`));
    const chest = orientationOf(performer.joint("vl5"));
    const tip = jointTip(performer, `${side}_wrist`).applyMatrix4(performer.joint(`${side}_wrist`));
    return places.map((place) => {
      const way = fromShoulderFrame(new Vector3(...place), shoulder, chest, armLength(performer, side)).sub(tip);
      return way.setLength(MIN_THREAD_M + way.length()).add(handle);
    });
  }

  /** Move a limb at -1..1 of full speed to the right, up and towards the audience; legs use `up` alone. */
  move(limb: number, right: number, up: number, nearer: number): void {
    const performer = this.#stage.performers[performerOfLimb(limb)];
    if (!performer || this.#sources[limb] === null) return;
    this.#pullTargets[limb] = null;
    if (limbWithinPerformer(limb) >= 2) {
      this.#puppeteer?.velocity(limb, up, 0, 0);
      return;
    }
    const direction = this.#stage
      .right()
      .multiplyScalar(right)
      .addScaledVector(this.#stage.up(), up)
      .addScaledVector(this.#stage.back(), nearer);
    const { x, y, z } = toChestFrame(direction, orientationOf(performer.joint("vl5")));
    // Coarse steps, so that small movements of the chest do not cause new inputs.
    this.#puppeteer?.velocity(limb, quantise(x), quantise(y), quantise(z));
  }

  #clearLimb(limb: number): void {
    this.#sources[limb] = null;
    this.#pullTargets[limb] = null;
    this.#crowdPulls.delete(limb);
  }
}

function quantise(value: number): number {
  return Math.round(value * 32) / 32;
}

function jointOffset(performer: Performer, name: string): Vector3 {
  return new Vector3().fromArray(performer.figure.offsets, JOINTS.indexOf(name) * 3);
}

function jointTip(performer: Performer, name: string): Vector3 {
  return new Vector3().fromArray(performer.figure.tips, JOINTS.indexOf(name) * 3);
}

/** Return the length of upper arm, forearm and hand to the finger tips, in metres. */
function armLength(performer: Performer, side: string): number {
  return (
    jointOffset(performer, `${side}_elbow`).length() +
    jointOffset(performer, `${side}_wrist`).length() +
    jointTip(performer, `${side}_wrist`).length()
  );
}
