/** What the audience sees of the strings: rings, threads and bars, from who holds what (section 5). */
import { Group, Vector3 } from "three";
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
}

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
    this.#motions = [0, 1, 2, 3].map(() => ({ held: 0, lit: 0, bar: new Vector3(), roll: 0, holder: 0, shake: 0 }));
  }

  /** The ring of a limb that another holds shakes its head. */
  refuse(limb: number): void {
    if (!this.still) this.#motions[limb].shake = 1;
  }

  /** Where a limb's bar is, for its name tag; null while there is none. */
  bar(limb: number): Vector3 | null {
    return this.#motions[limb].held > 0.5 ? this.#motions[limb].bar : null;
  }

  /** Draws the four strings. `ground` is the floor's height, `ceiling` what bars stay under, `right` the camera's right, world. */
  update(puppet: Performer, states: readonly StringState[], look: Look, seconds: number, ground: number, ceiling: number, right: Vector3): void {
    this.group.visible = true;
    this.#threads.dark = look.dark;
    const bars: Bar[] = [];
    const handles = states.map((_, limb) => puppet.handle(limb, new Vector3()));
    const goals = states.map((state, limb) => (state.holder === null ? null : goalOf(state, handles[limb], limb, ground, ceiling, puppet.scale)));
    hangApart(goals.flatMap((goal) => goal ?? []), right, puppet.scale);
    states.forEach((state, limb) => {
      const motion = this.#motions[limb];
      const handle = handles[limb];
      const held = state.holder !== null;
      if (state.holder !== null) {
        if (motion.held < 0.02) motion.bar.copy(handle).y += 0.2;
        motion.holder = state.holder;
      }
      motion.held = this.#toward(motion.held, held ? 1 : 0, seconds, held ? 0.16 : 0.5);
      motion.lit = this.#toward(motion.lit, state.lit ? 1 : 0, seconds, 0.16);
      motion.shake = this.#toward(motion.shake, 0, seconds, 0.4);
      const shake = motion.shake > 0 ? Math.sin(motion.shake * 4 * Math.PI) * 0.01 * puppet.scale : 0;
      const shown = handle.clone().addScaledVector(right, shake);
      const tension = state.pull ? Math.min(1, 0.35 + state.pull.distanceTo(handle) / TAUT) : held ? 0.75 : 0;
      if (motion.held > 0.01) bars.push(this.#bar(motion, goals[limb], limb, seconds, puppet.scale));
      this.#ring(limb, shown, motion, state, look, puppet.scale);
      if (held) {
        const hook = motion.bar.clone().setY(motion.bar.y - HOOK);
        this.#threads.set(limb, shown, hook, { colour: look.holders[motion.holder], alpha: 1, tension, sag: (1 - motion.held) * 0.05, fading: false });
      } else {
        const rise = (limb < 2 ? 0.62 : 0.26) * puppet.scale;
        const top = shown.clone().setY(shown.y + rise);
        this.#threads.set(limb, shown, top, { colour: look.silk, alpha: look.silkStrength, tension: 0, sag: motion.held * 0.03, fading: true });
      }
    });
    this.#bars.set(bars);
  }

  /** `goal` is where the bar is to hang; null where it was let go, and rises. */
  #bar(motion: Motion, goal: Vector3 | null, limb: number, seconds: number, scale: number): Bar {
    const held = goal !== null;
    const before = motion.bar.x;
    motion.bar.lerp(goal ?? motion.bar.clone().setY(motion.bar.y + 0.3), this.still ? 1 : 1 - Math.exp(-(held ? 9 : 2) * seconds));
    const lean = seconds > 0 && !this.still ? Math.max(-LEAN, Math.min(LEAN, -0.16 * ((motion.bar.x - before) / seconds))) : 0;
    motion.roll += ((limb % 2 === 0 ? -0.1 : 0.1) + lean - motion.roll) * Math.min(1, 8 * seconds || 1);
    return { at: motion.bar.clone(), roll: motion.roll, size: (held ? 1.1 : motion.held * 1.1) * scale };
  }

  #ring(limb: number, at: Vector3, motion: Motion, state: StringState, look: Look, scale: number): void {
    const held = state.holder !== null;
    const radius = (held ? 0.062 : 0.046 + 0.01 * motion.lit) * scale;
    this.#rings.set(limb, at, {
      colour: held ? look.holders[motion.holder] : look.ring,
      alpha: held ? 1 : look.ringStrength + (1 - look.ringStrength) * motion.lit,
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

/** Where a held limb's bar hangs by itself. */
function goalOf({ pull }: StringState, handle: Vector3, limb: number, ground: number, ceiling: number, scale: number): Vector3 {
  const goal = handle.clone();
  goal.x += (limb % 2 === 0 ? 1 : -1) * (limb < 2 ? 0.08 : 0.16) * scale;
  // Above the head, so that neither bar nor name stands before the face.
  const clear = Math.max(handle.y + (limb < 2 ? 0.32 : 0.5) * scale, ground + OVERHEAD[limb < 2 ? 0 : 1] * scale);
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
