/** Create a gamepad as the Gamepad API reports it. */
export function createGamepad(
  axes = [0, 0, 0, 0],
  pressed: Readonly<Record<number, number>> = {},
  mapping = "standard",
): Gamepad {
  const buttons = Array.from({ length: 17 }, (_, i) => ({
    pressed: (pressed[i] ?? 0) > 0.5,
    touched: false,
    value: pressed[i] ?? 0,
  }));
  return { id: "Pad (test)", connected: true, mapping, axes, buttons } as unknown as Gamepad;
}
