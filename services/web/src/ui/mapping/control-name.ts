/** Names of keys, buttons and axes for display. Letters name positions on a US keyboard. Pure. */
import { pageTranslator, type Translator } from "../../i18n/translator";
import type { Control } from "../../input/mapping";

const KEY_NAMES: Readonly<Record<string, string>> = {
  ArrowRight: "→",
  ArrowLeft: "←",
  ArrowUp: "↑",
  ArrowDown: "↓",
  PageUp: "Page Up",
  PageDown: "Page Down",
  Minus: "-",
  Equal: "=",
  BracketLeft: "[",
  BracketRight: "]",
  Semicolon: ";",
  Quote: "'",
  Backquote: "`",
  Backslash: "\\",
  Comma: ",",
  Period: ".",
  Slash: "/",
};
const BUTTON_NAMES = [
  "A",
  "B",
  "X",
  "Y",
  "L1",
  "R1",
  "L2",
  "R2",
  "Select",
  "Start",
  "L3",
  "R3",
  "↑",
  "↓",
  "←",
  "→",
  "Home",
];
/** First and last button of the directional pad. */
const DPAD_BUTTON_RANGE = [12, 15];
const MOUSE_BUTTON_NAMES = ["Middle button", "Right button", "Back button", "Forward button"] as const;
const STICK_NAMES = ["Left stick {way}", "Right stick {way}"] as const;
const STICK_ARROWS = [
  ["←", "→"],
  ["↑", "↓"],
];

/** Name a control: "W", "Num 1", "R2", "L1 + Left stick ↑". */
export function controlName(control: Control, translator = pageTranslator): string {
  return control
    .split(" ")
    .map((part) => singleControlName(part, translator))
    .join(" + ");
}

function singleControlName(control: string, { translate }: Translator): string {
  const [kind, rest] = control.split(":");
  if (rest === undefined)
    return (
      KEY_NAMES[control] ??
      control
        .replace(/^(Key|Digit)/, "")
        .replace(/^Numpad/, translate("Num "))
        .replace(/([a-z])([A-Z])/g, "$1 $2")
    );
  const index = parseInt(rest, 10);
  if (kind === "wheel") return translate("Wheel {way}", { way: rest === "+" ? "↓" : "↑" });
  if (kind === "mouse") return translate(MOUSE_BUTTON_NAMES[index - 1]);
  if (kind === "button" && index >= DPAD_BUTTON_RANGE[0] && index <= DPAD_BUTTON_RANGE[1])
    return translate("Cross {way}", { way: BUTTON_NAMES[index] });
  if (kind === "button") return BUTTON_NAMES[index] ?? translate("Button {number}", { number: index + 1 });
  const way = Number(rest.endsWith("+"));
  return index < 4
    ? translate(STICK_NAMES[index >> 1], { way: STICK_ARROWS[index & 1][way] })
    : translate("Axis {number} {sign}", { number: index + 1, sign: "-+"[way] });
}
