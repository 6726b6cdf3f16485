/** Controls as people read them. Pure. Letters go by their place on a keyboard as printed in the USA. */
import type { Control } from "../input/mapping";

const KEYS: Readonly<Record<string, string>> = {
  ArrowRight: "→", ArrowLeft: "←", ArrowUp: "↑", ArrowDown: "↓", PageUp: "Page Up", PageDown: "Page Down",
  Minus: "-", Equal: "=", BracketLeft: "[", BracketRight: "]", Semicolon: ";", Quote: "'", Backquote: "`", Backslash: "\\", Comma: ",", Period: ".", Slash: "/",
};
const BUTTONS = ["A", "B", "X", "Y", "L1", "R1", "L2", "R2", "Select", "Start", "L3", "R3", "Cross ↑", "Cross ↓", "Cross ←", "Cross →", "Home"];
const MOUSE = ["", "Middle button", "Right button", "Back button", "Forward button"];
const STICKS = ["Left stick", "Right stick"];
const WAYS = [["←", "→"], ["↑", "↓"]];

/** "W", "Num 1", "R2", "L1 + Left stick ↑". */
export function controlName(control: Control): string {
  return control.split(" ").map(one).join(" + ");
}

function one(control: string): string {
  const [kind, rest] = control.split(":");
  if (rest === undefined) return KEYS[control] ?? control.replace(/^(Key|Digit)/, "").replace(/^Numpad/, "Num ").replace(/([a-z])([A-Z])/g, "$1 $2");
  const index = parseInt(rest, 10);
  if (kind === "wheel") return `Wheel ${rest === "+" ? "↓" : "↑"}`;
  if (kind === "mouse") return MOUSE[index];
  if (kind === "button") return BUTTONS[index] ?? `Button ${index + 1}`;
  const way = Number(rest.endsWith("+"));
  return index < 4 ? `${STICKS[index >> 1]} ${WAYS[index & 1][way]}` : `Axis ${index + 1} ${"-+"[way]}`;
}
