/** Polls the first standard gamepad and carries out what its controls are bound to. */
import type { CommandDispatcher } from "./command-dispatcher";
import { resolveControls } from "./gamepad-state";
import { type Control, isPadControl, type Mapping } from "./mapping";
import { OneEuro, smoothingSettings } from "./one-euro";

/** Of the smoothing of a stick, Hz for each full push a second: a flick is followed within a frame or two. */
const STICK_BETA = 3;

export interface GamepadInput {
  /** The pad in use, for the picture of it; null when none is there. */
  readonly pad: Gamepad | null;
  /** Reads the pad. Once a frame, with a time that never runs backwards, milliseconds. Not `acting`, it only looks which pad there is. */
  update(now: number, enabled?: boolean): void;
}

export function createGamepadInput(
  commands: CommandDispatcher,
  mapping: () => Mapping,
  pads: () => readonly (Gamepad | null)[],
): GamepadInput {
  const filters = [0, 1].map(() => new OneEuro(2, { minCutoff: 1, beta: STICK_BETA, derivativeCutoff: 1 }));
  let pad: Gamepad | null = null;
  let before: readonly Control[] = [];

  /** The axes, the sticks among them without their noise. One at rest is at rest: nothing of its movement lingers on. */
  const smooth = (axes: readonly number[], { deadZone, stickSmoothing }: Mapping, now: number): number[] => {
    const settings = smoothingSettings(stickSmoothing, STICK_BETA);
    const smoothed = [...axes];
    filters.forEach((filter, side) => {
      const [x, y] = axes.slice(side * 2, side * 2 + 2);
      if (!settings || y === undefined || Math.hypot(x, y) <= deadZone) {
        filter.reset();
        return;
      }
      filter.settings = settings;
      [smoothed[side * 2], smoothed[side * 2 + 1]] = filter.filter([x, y], now / 1000);
    });
    return smoothed;
  };

  return {
    get pad() {
      return pad;
    },
    update(now, acting = true) {
      pad = pads().find((one) => one?.connected && one.mapping === "standard") ?? null;
      if (!pad || !acting) {
        commands.releaseAll(isPadControl);
        before = [];
        return;
      }
      const asked = resolveControls({ axes: smooth(pad.axes, mapping(), now), buttons: pad.buttons }, mapping());
      const down = asked.map(({ control }) => control);
      for (const control of before) if (!down.includes(control)) commands.release(control, now);
      for (const { control, commands: wanted, strength } of asked) commands.press(control, wanted, strength, now);
      before = down;
    },
  };
}
