/** The strings as the audience sees them: rings, threads and control bars. */
import { Group, Vector3 } from "three";
import { LIMBS } from "../../motion/skeleton";
import { limbNumber, MAX_LIMBS } from "../../wire/limbs";
import type { Performer } from "../puppet/performer";
import type { Look } from "../scenery/look";
import { type ControlBar, ControlBars, HOOK_OFFSET_M } from "./control-bar";
import { HandleRings } from "./handle-ring";
import { limit, separate } from "./separation";
import { Threads } from "./thread";

export interface StringState {
  /** Index of the puppeteer's colour, or null if the limb is free. */
  puppeteer: number | null;
  /** True if the pointer is near or the control has the focus. */
  isHighlighted: boolean;
  /** Target of the pull, in world metres; null if unknown (another client, keyboard, gamepad). */
  pullTarget: Vector3 | null;
  /** True if the performer is not the selected one: its strings are dimmed. */
  isDimmed?: boolean;
  /** True if the audience can pull the limb. */
  isOpen?: boolean;
  /** Ends of the threads of the audience's pulls, in world metres. */
  crowdThreads?: readonly Vector3[];
}

/** View of the strings. */
export interface StringsView {
  /** Height of the floor, and the highest position of bars, in world metres. */
  ground: number;
  ceiling: number;
  /** The camera's right in the world frame. */
  right: Vector3;
  /**
   * Positions along `right` between which the page leaves the picture uncovered, in metres: bars of handles between
   * them stay there. Unlimited by default.
   */
  sides?: readonly [left: number, right: number];
  /** Distance of the camera as a multiple of what one performer needs. */
  distanceScale: number;
}

const FREE_STRING: StringState = { puppeteer: null, isHighlighted: false, pullTarget: null };
/** Remaining opacity of dimmed rings and threads. */
const DIMMED_SHARE = 0.42;
/** Most threads of the audience's pulls, over all limbs. */
const MAX_CROWD_THREADS = 64;
const CROWD_THREAD = { alpha: 0.85, tension: 0.12, sag: 0.02, fadesOut: true };
const HIDDEN_POSITION = new Vector3();

/** Lengths of the threads of free limbs, for hands and legs, in metres for the standard figure. */
export const FREE_THREAD_LENGTH_M = [0.62, 0.26] as const;
/** Pull error at which a thread is fully taut, in metres. */
const TAUT_ERROR_M = 0.25;
/** Minimum heights of bars above the floor, for hands and legs, in metres for the standard figure. */
const MIN_BAR_HEIGHT_M = [2.14, 1.98];
/**
 * Bars at heights closer than this are kept this far apart, so that none covers another. Metres for the standard
 * figure.
 */
const SAME_HEIGHT_M = 0.2;
const MIN_BAR_DISTANCE_M = 0.36;
/** Half the width of a bar with a margin, in metres for the standard figure. */
const BAR_HALF_WIDTH_M = 0.2;
const MAX_LEAN_RAD = (12 * Math.PI) / 180;

interface StringAnimation {
  held: number;
  highlight: number;
  bar: Vector3;
  roll: number;
  puppeteer: number;
  shake: number;
}

/** Layout of a string: its handle, and the target of its bar, null if it is free. */
interface StringLayout {
  state: StringState;
  /** Limb of its performer, 0..3. */
  limb: number;
  handle: Vector3;
  barTarget: Vector3 | null;
  /** Scale of the performer, and of its string at this distance. */
  scale: number;
  size: number;
}

export class Strings {
  readonly group = new Group();
  /** Disables easing and shaking. */
  reducedMotion = false;
  readonly #threads = new Threads();
  readonly #crowdThreads = new Threads(MAX_CROWD_THREADS);
  readonly #rings = new HandleRings();
  readonly #bars = new ControlBars();
  readonly #animations: StringAnimation[];

  constructor() {
    this.group.name = "strings";
    this.group.add(this.#threads.mesh, this.#crowdThreads.mesh, this.#rings.mesh, this.#bars.mesh);
    this.group.visible = false;
    this.#animations = Array.from({ length: MAX_LIMBS }, () => ({
      held: 0,
      highlight: 0,
      bar: new Vector3(),
      roll: 0,
      puppeteer: 0,
      shake: 0,
    }));
  }

  /** Draws for a transparent picture, whose colours are multiplied by its alpha. */
  set isOverNothing(on: boolean) {
    this.#threads.isOverNothing = this.#crowdThreads.isOverNothing = on;
  }

  /** Shows the rings by which limbs are taken. */
  set showsHandles(on: boolean) {
    this.#rings.mesh.visible = on;
  }

  /** Shake the ring of a limb that another puppeteer holds. */
  shakeRing(limb: number): void {
    if (!this.reducedMotion) this.#animations[limb].shake = 1;
  }

  /** Return the position of a limb's bar, for its name tag; null if there is none. */
  barPosition(limb: number): Vector3 | null {
    return this.#animations[limb].held > 0.5 ? this.#animations[limb].bar : null;
  }

  /**
   * Draw four strings per performer, none for null. `states` is indexed by limb number; without a state the limb is
   * free.
   */
  update(
    performers: readonly (Pick<Performer, "handle" | "scale"> | null)[],
    states: readonly StringState[],
    look: Look,
    seconds: number,
    view: StringsView,
  ): void {
    this.group.visible = true;
    this.#threads.dark = look.dark;
    this.#threads.count = this.#rings.count = performers.length * LIMBS.length;
    const strings = performers.flatMap((performer, k) =>
      LIMBS.map(
        (_, limbIndex) =>
          performer && layOutString(performer, limbIndex, states[limbNumber(k, limbIndex)] ?? FREE_STRING, view),
      ),
    );
    const visible = strings.filter((string) => string !== null);
    separateBars(visible, view);
    const bars = strings.map((string, limb) =>
      string ? this.#drawString(limb, string, look, seconds, view.right) : this.#hideString(limb),
    );
    this.#bars.set(bars.filter((bar) => bar !== null));
    this.#drawCrowdThreads(visible, look);
  }

  /** Draw the pulls of the audience as fans of fine threads. */
  #drawCrowdThreads(strings: readonly StringLayout[], look: Look): void {
    const threads = strings
      .flatMap(({ state, handle }) => (state.crowdThreads ?? []).map((end) => ({ handle, end })))
      .slice(0, MAX_CROWD_THREADS);
    this.#crowdThreads.dark = look.dark;
    this.#crowdThreads.count = threads.length;
    threads.forEach(({ handle, end }, index) => {
      this.#crowdThreads.set(index, handle, end, { ...CROWD_THREAD, colour: look.threadColour });
    });
  }

  /** Draw a string except for its bar, which is returned. */
  #drawString(
    limb: number,
    { state, limb: limbIndex, handle, barTarget: goal, scale, size }: StringLayout,
    look: Look,
    seconds: number,
    right: Vector3,
  ): ControlBar | null {
    const motion = this.#animations[limb];
    const held = state.puppeteer !== null;
    if (state.puppeteer !== null) {
      if (motion.held < 0.02) motion.bar.copy(handle).y += 0.2;
      motion.puppeteer = state.puppeteer;
    }
    motion.held = this.#approach(motion.held, held ? 1 : 0, seconds, held ? 0.16 : 0.5);
    motion.highlight = this.#approach(motion.highlight, state.isHighlighted ? 1 : 0, seconds, 0.16);
    motion.shake = this.#approach(motion.shake, 0, seconds, 0.4);
    const shake = motion.shake > 0 ? Math.sin(motion.shake * 4 * Math.PI) * 0.01 * size : 0;
    const ringPosition = handle.clone().addScaledVector(right, shake);
    const tension = state.pullTarget
      ? Math.min(1, 0.35 + state.pullTarget.distanceTo(handle) / TAUT_ERROR_M)
      : held
        ? 0.75
        : 0;
    const bar = motion.held > 0.01 ? this.#animateBar(motion, goal, limbIndex, seconds, size) : null;
    this.#drawRing(limb, ringPosition, motion, state, look, size);
    if (held) {
      const hook = motion.bar.clone().setY(motion.bar.y - HOOK_OFFSET_M * (size / scale));
      this.#threads.set(limb, ringPosition, hook, {
        colour: look.puppeteerColours[motion.puppeteer],
        alpha: 1,
        tension,
        sag: (1 - motion.held) * 0.05,
        fadesOut: false,
      });
    } else {
      const top = ringPosition.clone().setY(ringPosition.y + FREE_THREAD_LENGTH_M[limbIndex < 2 ? 0 : 1] * scale);
      const alpha = look.threadOpacity * (state.isDimmed ? DIMMED_SHARE : 1);
      this.#threads.set(limb, ringPosition, top, {
        colour: look.threadColour,
        alpha,
        tension: 0,
        sag: motion.held * 0.03,
        fadesOut: true,
      });
    }
    return bar;
  }

  #hideString(limb: number): null {
    this.#animations[limb].held = 0;
    this.#rings.set(limb, HIDDEN_POSITION, { colour: "#fff", alpha: 0, radius: 0, lineShare: 0, glow: 0 });
    this.#threads.set(limb, HIDDEN_POSITION, HIDDEN_POSITION, {
      colour: "#fff",
      alpha: 0,
      tension: 0,
      sag: 0,
      fadesOut: false,
    });
    return null;
  }

  /** `goal` is the target of the bar, or null after a release: the bar rises. */
  #animateBar(
    motion: StringAnimation,
    goal: Vector3 | null,
    limbIndex: number,
    seconds: number,
    size: number,
  ): ControlBar {
    const held = goal !== null;
    const before = motion.bar.x;
    motion.bar.lerp(
      goal ?? motion.bar.clone().setY(motion.bar.y + 0.3),
      this.reducedMotion ? 1 : 1 - Math.exp(-(held ? 9 : 2) * seconds),
    );
    const lean =
      seconds > 0 && !this.reducedMotion
        ? Math.max(-MAX_LEAN_RAD, Math.min(MAX_LEAN_RAD, -0.16 * ((motion.bar.x - before) / seconds)))
        : 0;
    motion.roll += ((limbIndex % 2 === 0 ? -0.1 : 0.1) + lean - motion.roll) * Math.min(1, 8 * seconds || 1);
    return { position: motion.bar.clone(), roll: motion.roll, size: (held ? 1.1 : motion.held * 1.1) * size };
  }

  #drawRing(limb: number, at: Vector3, motion: StringAnimation, state: StringState, look: Look, size: number): void {
    const held = state.puppeteer !== null;
    // Larger and glowing while the audience can pull it.
    const isOpen = !held && state.isOpen === true;
    const radius = (held || isOpen ? 0.062 : 0.046 + 0.01 * motion.highlight) * size;
    const strength = look.ringOpacity * (state.isDimmed ? DIMMED_SHARE : 1);
    this.#rings.set(limb, at, {
      colour: held ? look.puppeteerColours[motion.puppeteer] : look.ringColour,
      alpha: held ? 1 : strength + (1 - strength) * motion.highlight,
      radius,
      lineShare: held ? 0.035 : 0.026,
      glow: (held || isOpen) && look.dark ? 1 : 0,
    });
  }

  #approach(value: number, goal: number, seconds: number, over: number): number {
    if (this.reducedMotion) return goal;
    const step = seconds / over;
    return value < goal ? Math.min(goal, value + step) : Math.max(goal, value - step);
  }
}

function layOutString(
  performer: Pick<Performer, "handle" | "scale">,
  limbIndex: number,
  state: StringState,
  view: StringsView,
): StringLayout {
  const { scale } = performer;
  const handle = performer.handle(limbIndex, new Vector3());
  const goal = state.puppeteer === null ? null : barTarget(state, handle, limbIndex, view, scale);
  // Small objects are drawn larger at a distance, but not as large as close up.
  return { state, limb: limbIndex, handle, barTarget: goal, scale, size: scale * Math.sqrt(view.distanceScale) };
}

/** Return the target of a held limb's bar, before separation. */
function barTarget(
  { pullTarget: pull }: StringState,
  handle: Vector3,
  limbIndex: number,
  { ground, ceiling }: StringsView,
  scale: number,
): Vector3 {
  const goal = handle.clone();
  goal.x += (limbIndex % 2 === 0 ? 1 : -1) * (limbIndex < 2 ? 0.08 : 0.16) * scale;
  // Above the head, so that neither bar nor name covers the face.
  const clear = Math.max(
    handle.y + (limbIndex < 2 ? 0.32 : 0.5) * scale,
    ground + MIN_BAR_HEIGHT_M[limbIndex < 2 ? 0 : 1] * scale,
  );
  goal.y = Math.min(Math.max(clear, pull ? pull.y : -Infinity), ceiling);
  // A bar never meets the hand; near the top of the picture it moves above the edge instead.
  goal.y = Math.max(goal.y, handle.y + 0.12 * scale);
  return goal;
}

/** Move bars of similar height apart along the camera's right, between the sides of the view. */
function separateBars(strings: readonly StringLayout[], { right, sides = [-Infinity, Infinity] }: StringsView): void {
  const scale = Math.max(...strings.map(({ size }) => size));
  const bars = strings
    .flatMap(({ barTarget: goal, handle }) => (goal ? { goal, handle: handle.dot(right) } : []))
    .sort((a, b) => a.goal.y - b.goal.y);
  const levels: (typeof bars)[] = [];
  for (const bar of bars) {
    const last = levels.at(-1);
    if (last && bar.goal.y - last[last.length - 1].goal.y < SAME_HEIGHT_M * scale) last.push(bar);
    else levels.push([bar]);
  }
  const [left, end] = sides;
  for (const level of levels) {
    const positions = level.map(({ goal }) => goal.dot(right));
    const separated = separate(positions, MIN_BAR_DISTANCE_M * scale);
    // A handle that is outside the picture or covered keeps its bar above it.
    const inside = level.flatMap(({ handle }, index) => (handle > left && handle < end ? index : []));
    const limited = limit(
      inside.map((index) => separated[index]),
      MIN_BAR_DISTANCE_M * scale,
      [left + BAR_HALF_WIDTH_M * scale, end - BAR_HALF_WIDTH_M * scale],
    );
    inside.forEach((index, nth) => (separated[index] = limited[nth]));
    level.forEach(({ goal }, index) => goal.addScaledVector(right, separated[index] - positions[index]));
  }
}
