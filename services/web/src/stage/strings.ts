/** What the audience sees of the strings: rings, threads and bars, from who holds what (section 5). */
import { Group, Vector3 } from "three";
import { LIMBS } from "../motion/skeleton";
import { limbNumber, MOST_LIMBS } from "../wire/limbs";
import { apart } from "./apart";
import { Bars, HOOK, type Bar } from "./bars";
import type { Look } from "./look";
import type { Performer } from "./performer";
import { Rings } from "./rings";
import { Threads } from "./threads";

export interface StringState {
  /** Index of the holder's colour, or null when the limb is free. */
  holder: number | null;
  /** The pointer is near, or the control has the focus. */
  lit: boolean;
  /** Where the holder pulls to, world metres; null when unknown (another's hand, keys, a stick). */
  pull: Vector3 | null;
  /** Of a performer that this page's keys do not act on just now: it keeps to the background. */
  behind?: boolean;
}

/** How the strings are looked at. */
export interface StringsView {
  /** Height of the floor, and what bars stay under, world metres. */
  ground: number;
  ceiling: number;
  /** The camera's right, world. */
  right: Vector3;
  /** How many times further away than from one dancer. */
  wide: number;
}

const FREE: StringState = { holder: null, lit: false, pull: null };
/** What is left of the rings and silk of those behind. */
const BEHIND = 0.42;
const NOWHERE = new Vector3();

/** Pull error that draws a thread fully taut, metres. */
const TAUT = 0.25;
/** Heights over the floor that bars keep at least: of hands, of legs. Metres for the standard figure. */
const OVERHEAD = [2.14, 1.98];
/** Bars at heights nearer than this hang as far apart as this, so that none covers another. Metres for the standard figure. */
const LEVEL = 0.2;
const APART = 0.36;
const LEAN = (12 * Math.PI) / 180;

interface Motion {
  held: number;
  lit: number;
  bar: Vector3;
  roll: number;
  holder: number;
  shake: number;
}

/** One string just now: its handle, and where its bar is to hang, null where it is free. */
interface Hung {
  state: StringState;
  /** Which limb of its performer it is, 0..3. */
  part: number;
  handle: Vector3;
  goal: Vector3 | null;
  /** Of its performer, and of what is to be seen from where one looks. */
  scale: number;
  size: number;
}

export class Strings {
  readonly group = new Group();
  /** No easing, no shake. */
  still = false;
  readonly #threads = new Threads();
  readonly #rings = new Rings();
  readonly #bars = new Bars();
  readonly #motions: Motion[];

  constructor() {
    this.group.name = "strings";
    this.group.add(this.#threads.mesh, this.#rings.mesh, this.#bars.mesh);
    this.group.visible = false;
    this.#motions = Array.from({ length: MOST_LIMBS }, () => ({ held: 0, lit: 0, bar: new Vector3(), roll: 0, holder: 0, shake: 0 }));
  }

  /** The ring of a limb that another holds shakes its head. */
  refuse(limb: number): void {
    if (!this.still) this.#motions[limb].shake = 1;
  }

  /** Where a limb's bar is, for its name tag; null while there is none. */
  bar(limb: number): Vector3 | null {
    return this.#motions[limb].held > 0.5 ? this.#motions[limb].bar : null;
  }

  /** Draws four strings for each performer, none where that is null; `states` by number of the limb, free where there is none. */
  update(performers: readonly (Pick<Performer, "handle" | "scale"> | null)[], states: readonly StringState[], look: Look, seconds: number, view: StringsView): void {
    this.group.visible = true;
    this.#threads.dark = look.dark;
    this.#threads.count = this.#rings.count = performers.length * LIMBS.length;
    const strings = performers.flatMap((performer, k) => LIMBS.map((_, part) => performer && hung(performer, part, states[limbNumber(k, part)] ?? FREE, view)));
    const there = strings.filter((string) => string !== null);
    hangApart(there.flatMap(({ goal }) => goal ?? []), view.right, Math.max(...there.map(({ size }) => size)));
    const bars = strings.map((string, limb) => (string ? this.#draw(limb, string, look, seconds, view.right) : this.#hide(limb)));
    this.#bars.set(bars.filter((bar) => bar !== null));
  }

  /** Draws a string, but for its bar, which it returns. */
  #draw(limb: number, { state, part, handle, goal, scale, size }: Hung, look: Look, seconds: number, right: Vector3): Bar | null {
    const motion = this.#motions[limb];
    const held = state.holder !== null;
    if (state.holder !== null) {
      if (motion.held < 0.02) motion.bar.copy(handle).y += 0.2;
      motion.holder = state.holder;
    }
    motion.held = this.#toward(motion.held, held ? 1 : 0, seconds, held ? 0.16 : 0.5);
    motion.lit = this.#toward(motion.lit, state.lit ? 1 : 0, seconds, 0.16);
    motion.shake = this.#toward(motion.shake, 0, seconds, 0.4);
    const shake = motion.shake > 0 ? Math.sin(motion.shake * 4 * Math.PI) * 0.01 * size : 0;
    const shown = handle.clone().addScaledVector(right, shake);
    const tension = state.pull ? Math.min(1, 0.35 + state.pull.distanceTo(handle) / TAUT) : held ? 0.75 : 0;
    const bar = motion.held > 0.01 ? this.#bar(motion, goal, part, seconds, size) : null;
    this.#ring(limb, shown, motion, state, look, size);
    if (held) {
      const hook = motion.bar.clone().setY(motion.bar.y - HOOK * (size / scale));
      this.#threads.set(limb, shown, hook, { colour: look.holders[motion.holder], alpha: 1, tension, sag: (1 - motion.held) * 0.05, fading: false });
    } else {
      const top = shown.clone().setY(shown.y + (part < 2 ? 0.62 : 0.26) * scale);
      const alpha = look.silkStrength * (state.behind ? BEHIND : 1);
      this.#threads.set(limb, shown, top, { colour: look.silk, alpha, tension: 0, sag: motion.held * 0.03, fading: true });
    }
    return bar;
  }

  #hide(limb: number): null {
    this.#motions[limb].held = 0;
    this.#rings.set(limb, NOWHERE, { colour: "#fff", alpha: 0, radius: 0, line: 0, glow: 0 });
    this.#threads.set(limb, NOWHERE, NOWHERE, { colour: "#fff", alpha: 0, tension: 0, sag: 0, fading: false });
    return null;
  }

  /** `goal` is where the bar is to hang; null where it was let go, and rises. */
  #bar(motion: Motion, goal: Vector3 | null, part: number, seconds: number, size: number): Bar {
    const held = goal !== null;
    const before = motion.bar.x;
    motion.bar.lerp(goal ?? motion.bar.clone().setY(motion.bar.y + 0.3), this.still ? 1 : 1 - Math.exp(-(held ? 9 : 2) * seconds));
    const lean = seconds > 0 && !this.still ? Math.max(-LEAN, Math.min(LEAN, -0.16 * ((motion.bar.x - before) / seconds))) : 0;
    motion.roll += ((part % 2 === 0 ? -0.1 : 0.1) + lean - motion.roll) * Math.min(1, 8 * seconds || 1);
    return { at: motion.bar.clone(), roll: motion.roll, size: (held ? 1.1 : motion.held * 1.1) * size };
  }

  #ring(limb: number, at: Vector3, motion: Motion, state: StringState, look: Look, size: number): void {
    const held = state.holder !== null;
    const radius = (held ? 0.062 : 0.046 + 0.01 * motion.lit) * size;
    const strength = look.ringStrength * (state.behind ? BEHIND : 1);
    this.#rings.set(limb, at, {
      colour: held ? look.holders[motion.holder] : look.ring,
      alpha: held ? 1 : strength + (1 - strength) * motion.lit,
      radius,
      line: held ? 0.035 : 0.026,
      glow: held && look.dark ? 1 : 0,
    });
  }

  #toward(value: number, goal: number, seconds: number, over: number): number {
    if (this.still) return goal;
    const step = seconds / over;
    return value < goal ? Math.min(goal, value + step) : Math.max(goal, value - step);
  }
}

function hung(performer: Pick<Performer, "handle" | "scale">, part: number, state: StringState, view: StringsView): Hung {
  const { scale } = performer;
  const handle = performer.handle(part, new Vector3());
  const goal = state.holder === null ? null : goalOf(state, handle, part, view, scale);
  // from far away small things are drawn larger, though not as large as from near
  return { state, part, handle, goal, scale, size: scale * Math.sqrt(view.wide) };
}

/** Where a held limb's bar hangs by itself. */
function goalOf({ pull }: StringState, handle: Vector3, part: number, { ground, ceiling }: StringsView, scale: number): Vector3 {
  const goal = handle.clone();
  goal.x += (part % 2 === 0 ? 1 : -1) * (part < 2 ? 0.08 : 0.16) * scale;
  // Above the head, so that neither bar nor name stands before the face.
  const clear = Math.max(handle.y + (part < 2 ? 0.32 : 0.5) * scale, ground + OVERHEAD[part < 2 ? 0 : 1] * scale);
  goal.y = Math.min(Math.max(clear, pull ? pull.y : -Infinity), ceiling);
  // A bar never meets the hand; where the picture ends too soon it slips above the edge instead.
  goal.y = Math.max(goal.y, handle.y + 0.12 * scale);
  return goal;
}

/** Moves bars of about one height aside along the camera's `right`. */
function hangApart(goals: readonly Vector3[], right: Vector3, scale: number): void {
  const level: Vector3[][] = [];
  for (const goal of [...goals].sort((a, b) => a.y - b.y)) {
    const last = level.at(-1);
    if (last && goal.y - last[last.length - 1].y < LEVEL * scale) last.push(goal);
    else level.push([goal]);
  }
  for (const bars of level) {
    const places = bars.map((bar) => bar.dot(right));
    apart(places, APART * scale).forEach((place, nth) => bars[nth].addScaledVector(right, place - places[nth]));
  }
}
