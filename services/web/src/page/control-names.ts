/** Controls as people read them. Pure. Letters go by their place on a keyboard as printed in the USA. */
import type { Control } from "../input/mapping";
import { pageSpeech, type Speech } from "../words/say";

const KEYS: Readonly<Record<string, string>> = {
  ArrowRight: "→", ArrowLeft: "←", ArrowUp: "↑", ArrowDown: "↓", PageUp: "Page Up", PageDown: "Page Down",
  Minus: "-", Equal: "=", BracketLeft: "[", BracketRight: "]", Semicolon: ";", Quote: "'", Backquote: "`", Backslash: "\\", Comma: ",", Period: ".", Slash: "/",
};
const BUTTONS = ["A", "B", "X", "Y", "L1", "R1", "L2", "R2", "Select", "Start", "L3", "R3", "↑", "↓", "←", "→", "Home"];
/** The first and the last of the cross. */
const CROSS = [12, 15];
const MOUSE = ["Middle button", "Right button", "Back button", "Forward button"] as const;
const STICKS = ["Left stick {way}", "Right stick {way}"] as const;
const WAYS = [["←", "→"], ["↑", "↓"]];

/** "W", "Num 1", "R2", "L1 + Left stick ↑". */
export function controlName(control: Control, speech = pageSpeech): string {
  return control.split(" ").map((one) => partName(one, speech)).join(" + ");
}

function partName(control: string, { say }: Speech): string {
  const [kind, rest] = control.split(":");
  if (rest === undefined) return KEYS[control] ?? control.replace(/^(Key|Digit)/, "").replace(/^Numpad/, say("Num ")).replace(/([a-z])([A-Z])/g, "$1 $2");
  const index = parseInt(rest, 10);
  if (kind === "wheel") return say("Wheel {way}", { way: rest === "+" ? "↓" : "↑" });
  if (kind === "mouse") return say(MOUSE[index - 1]);
  if (kind === "button" && index >= CROSS[0] && index <= CROSS[1]) return say("Cross {way}", { way: BUTTONS[index] });
  if (kind === "button") return BUTTONS[index] ?? say("Button {number}", { number: index + 1 });
  const way = Number(rest.endsWith("+"));
  return index < 4 ? say(STICKS[index >> 1], { way: WAYS[index & 1][way] }) : say("Axis {number} {sign}", { number: index + 1, sign: "-+"[way] });
}
