/**
 * The puppeteer's limbs, by limb number over all performers: translates inputs in the audience's frame to messages for
 * the session.
 */
import { type Quaternion, Vector3 } from "three";
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

/** Speed of a hand, in arm lengths per second, and of a thigh, in radians per second, by an input of full velocity. */
const [HAND_SPEED, THIGH_SPEED] = [1, 2];
/** Range of a thigh's angle in radians, as of a puppeteer's. */
const [MIN_THIGH_ANGLE, MAX_THIGH_ANGLE] = [-Math.PI / 4, (2 * Math.PI) / 3];
/** Longest time for which one frame moves a limb, in milliseconds. */
const MAX_FRAME_MS = 100;

/** Pull of this page on a limb with the crowd. */
interface CrowdPull {
  /** Local times of the last pull that was sent, and of the last frame. */
  sentAt: number;
  movedAt: number;
  /** Values of the last target; null before the first. */
  target: Vector3 | null;
}

/** Viewer of the session, through which limbs are pulled with the crowd. */
export type CrowdMember = Pick<Viewer, "presence" | "pull">;

export class LimbController {
  /** Called when the limbs held here change. */
  onChange: () => void = () => undefined;
  readonly #stage: Stage;
  #puppeteer: Puppeteer | null = null;
  #crowdMember: CrowdMember | null = null;
  readonly #crowdPulls = new Map<number, CrowdPull>();
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
   * Claim a limb; one already held here changes its source. Return false without a session. A limb that is open to the
   * crowd is pulled with it, and not claimed.
   */
  claim(limb: number, source: HoldSource): boolean {
    if (this.#sources[limb] === null) {
      if (this.isOpen(limb)) this.#crowdPulls.set(limb, { sentAt: -Infinity, movedAt: this.now(), target: null });
      else if (!this.#puppeteer || this.#puppeteer.isClosed) return false;
      else this.#puppeteer.claim(limb);
    }
    this.#sources[limb] = source;
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
    if (limbIndex < 2) this.pullHand(limb, handleTarget);
    else this.#sendTarget(limb, thighAngle(performer, limbIndex, handleTarget), 0, 0);
  }

  /** Pull the handle of a streamed figure's hand to a world position. */
  pullHand(limb: number, handle: Vector3): void {
    const performer = this.#stage.performers[performerOfLimb(limb)];
    if (!performer || this.#sources[limb] === null) return;
    const limbIndex = limbWithinPerformer(limb);
    const { tip, frame } = armOf(performer, limbIndex);
    tip.sub(handlePosition(performer, limbIndex, new Vector3())).add(handle);
    const { x, y, z } = toShoulderFrame(tip, ...frame);
    this.#sendTarget(limb, x, y, z);
  }

  #sendTarget(limb: number, x: number, y: number, z: number): void {
    const pull = this.#crowdPulls.get(limb);
    if (!pull) this.#puppeteer?.target(limb, x, y, z);
    // It was closed.
    else if (!this.isOpen(limb)) this.onRefused(limb);
    else {
      pull.target = new Vector3(x, y, z);
      pull.movedAt = this.now();
      if (pull.movedAt - pull.sentAt < CROWD_PULL_INTERVAL_MS) return;
      this.#crowdMember?.pull(limb, x, y, z);
      pull.sentAt = pull.movedAt;
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
    const handle = performer.handle(limbIndex, new Vector3());
    const { tip, frame } = armOf(performer, limbIndex);
    return places.map((place) => {
      const way = fromShoulderFrame(new Vector3(...place), ...frame).sub(tip);
      return way.setLength(MIN_THREAD_M + way.length()).add(handle);
    });
  }

  /** Move a limb at -1..1 of full speed to the right, up and towards the audience; legs use `up` alone. */
  move(limb: number, right: number, up: number, nearer: number): void {
    const performer = this.#stage.performers[performerOfLimb(limb)];
    if (!performer || this.#sources[limb] === null) return;
    this.#pullTargets[limb] = null;
    if (limbWithinPerformer(limb) >= 2) {
      this.#sendVelocity(limb, performer, up, 0, 0);
      return;
    }
    const direction = this.#stage
      .right()
      .multiplyScalar(right)
      .addScaledVector(this.#stage.up(), up)
      .addScaledVector(this.#stage.back(), nearer);
    const { x, y, z } = toChestFrame(direction, orientationOf(performer.joint("vl5")));
    // Coarse steps, so that small movements of the chest do not cause new inputs.
    this.#sendVelocity(limb, performer, quantise(x), quantise(y), quantise(z));
  }

  /** Send a velocity; with the crowd, move the target of the pull, as the session moves that of a puppeteer. */
  #sendVelocity(limb: number, performer: Performer, x: number, y: number, z: number): void {
    const pull = this.#crowdPulls.get(limb);
    if (!pull) {
      this.#puppeteer?.velocity(limb, x, y, z);
      return;
    }
    const limbIndex = limbWithinPerformer(limb);
    const seconds = Math.min(this.now() - pull.movedAt, MAX_FRAME_MS) / 1000;
    const target = pull.target ?? placeOf(performer, limbIndex);
    if (limbIndex < 2) target.addScaledVector(new Vector3(x, y, z), seconds * HAND_SPEED).clampLength(0, 1);
    else target.x = Math.min(MAX_THIGH_ANGLE, Math.max(MIN_THIGH_ANGLE, target.x + seconds * THIGH_SPEED * x));
    this.#sendTarget(limb, target.x, target.y, target.z);
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

/** Return where a limb is, as the values of a target. */
function placeOf(performer: Performer, limbIndex: number): Vector3 {
  if (limbIndex < 2) {
    const { tip, frame } = armOf(performer, limbIndex);
    return toShoulderFrame(tip, ...frame);
  }
  const knee = positionOf(performer.joint(`${sideOf(limbIndex)}_knee`));
  return new Vector3(thighAngle(performer, limbIndex, knee));
}

/** Return the angle that moves the knee to the height of `knee`, a world position. */
function thighAngle(performer: Performer, limbIndex: number, knee: Vector3): number {
  const side = sideOf(limbIndex);
  const hip = positionOf(performer.joint(`${side}_hip`));
  const thighLength = jointOffset(performer, `${side}_knee`).length();
  return solveThighAngle(knee, hip, orientationOf(performer.joint("sacroiliac")), thighLength);
}

/** Return the finger tips in world metres, and the shoulder's frame: origin, axes, and the arm's length to the tips. */
function armOf(
  performer: Performer,
  limbIndex: number,
): { tip: Vector3; frame: [shoulder: Vector3, chest: Quaternion, armLength: number] } {
  const side = sideOf(limbIndex);
  const fingers = jointTip(performer, `${side}_wrist`);
  const armLength =
    jointOffset(performer, `${side}_elbow`).length() +
    jointOffset(performer, `${side}_wrist`).length() +
    fingers.length();
  return {
    tip: fingers.applyMatrix4(performer.joint(`${side}_wrist`)),
    frame: [positionOf(performer.joint(`${side}_shoulder`)), orientationOf(performer.joint("vl5")), armLength],
  };
}

function sideOf(limbIndex: number): string {
  return limbIndex % 2 === 0 ? "l" : "r";
}
