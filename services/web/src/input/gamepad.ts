/** Polls the first standard gamepad and hands its sticks to the strings. */
import { readPad, type PadReading } from "./gamepad-mapping";
import type { Hands } from "./hands";

/** A limb whose stick has rested this long is let go, and the dance has it back. Milliseconds. */
const REST = 700;
/** A refused limb is asked for again no sooner than this. Milliseconds. */
const PATIENCE = 1500;

export interface GamepadActions {
  take(limb: number): boolean;
  play(): void;
  step(blocks: number): void;
}

export interface GamepadInput {
  /** The pad in use, for the picture of it; null when none is there. */
  readonly pad: Gamepad | null;
  /** Reads the pad. Once a frame, with a time that never runs backwards, milliseconds. */
  update(now: number): void;
}

export function createGamepad(hands: Hands, actions: GamepadActions, pads: () => readonly (Gamepad | null)[]): GamepadInput {
  const moved = [-Infinity, -Infinity, -Infinity, -Infinity];
  const asked = [-Infinity, -Infinity, -Infinity, -Infinity];
  let before: PadReading | null = null;
  let pad: Gamepad | null = null;
  return {
    get pad() {
      return pad;
    },
    update(now) {
      pad = pads().find((one) => one?.connected && one.mapping === "standard") ?? null;
      if (!pad) {
        for (let limb = 0; limb < 4; limb++) if (hands.source(limb) === "pad") hands.letGo(limb);
        before = null;
        return;
      }
      const reading = readPad(pad);
      reading.limbs.forEach((direction, limb) => {
        const active = direction.some((part) => part !== 0);
        if (active) moved[limb] = now;
        if (active && hands.source(limb) === null && now - asked[limb] > PATIENCE) {
          asked[limb] = now;
          actions.take(limb);
        }
        if (hands.source(limb) !== "pad") return;
        hands.move(limb, ...direction);
        if (now - moved[limb] > REST) {
          hands.letGo(limb);
          asked[limb] = -Infinity;
        }
      });
      if (reading.play && !before?.play) actions.play();
      if (reading.seek !== 0 && reading.seek !== before?.seek) actions.step(reading.seek);
      before = reading;
    },
  };
}
