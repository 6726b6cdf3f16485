/** Pulses by which a controller tells its hand that it took a string, or could not, or lost it. */
import type { HandGrip, HandName } from "../input/hand";

/** Strength, 0 to 1, and duration in milliseconds. */
type Pulse = readonly [strength: number, durationMs: number];

const TAKEN: Pulse = [0.5, 35];
const REFUSED: Pulse = [1, 140];

/** Gamepad with the actuators of the WebXR Gamepads Module. */
interface HapticGamepad {
  readonly hapticActuators?: readonly { pulse?(strength: number, durationMs: number): Promise<unknown> }[];
}

/** Return the pulse for a hand whose grip has changed; null for none. */
export function pulseFor(before: HandGrip["kind"], now: HandGrip["kind"]): Pulse | null {
  if (before === now) return null;
  if (now === "holding") return TAKEN;
  // Another puppeteer holds the string, or took it.
  if (now === "asking" || (now === "empty" && before !== "open")) return REFUSED;
  return null;
}

export class GripPulses {
  readonly #kinds = new Map<HandName, HandGrip["kind"]>();

  /** Send the pulses for what has changed. `gamepadOf` returns the gamepad of a hand, null if it has none. */
  update(grips: readonly HandGrip[], gamepadOf: (name: HandName) => Gamepad | null): void {
    for (const { name, kind } of grips) {
      const pulse = pulseFor(this.#kinds.get(name) ?? "open", kind);
      this.#kinds.set(name, kind);
      const actuator = pulse && (gamepadOf(name) as HapticGamepad | null)?.hapticActuators?.[0];
      if (pulse) void actuator?.pulse?.(...pulse).catch(() => undefined);
    }
  }
}
