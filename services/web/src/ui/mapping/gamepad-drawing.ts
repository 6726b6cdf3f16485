/** Drawing of a standard gamepad, labelled with the commands of its parts, with pressed parts highlighted. */
import { joinList, type PlainMessageKey, translate } from "../../i18n/translator";
import { PRESS_THRESHOLD } from "../../input/gamepad-state";
import type { Command, Control, Mapping } from "../../input/mapping";
import { setAttribute, setText, shape } from "../dom";
import { summarizeCommands } from "./command-name";

/** Button indices of the standard layout (W3C Gamepad, "Remapping"). */
const BUTTON = {
  a: 0,
  b: 1,
  x: 2,
  y: 3,
  left1: 4,
  right1: 5,
  left2: 6,
  right2: 7,
  up: 12,
  down: 13,
  left: 14,
  right: 15,
} as const;

export interface GamepadDrawing {
  readonly element: SVGSVGElement;
  /** Label the parts with their commands. */
  setMapping(mapping: Mapping): void;
  /** Highlight the parts that are pressed. */
  highlightPressed(
    pad: { axes: readonly number[]; buttons: readonly { value: number }[] } | null,
    deadZone: number,
  ): void;
}

export function createGamepadDrawing(): GamepadDrawing {
  const svg = shape("svg", { viewBox: "-16 0 544 358", role: "img" });
  const buttons = new Map<number, SVGElement>();
  const draw = (tag: "path" | "circle" | "rect", attributes: Record<string, string | number>, button?: number) => {
    const part = shape(tag, attributes);
    if (button !== undefined) buttons.set(button, part);
    svg.append(part);
    return part;
  };
  const text = (x: number, y: number, kind = "") => {
    const label = shape("text", { x, y, class: kind });
    svg.append(label);
    return label;
  };
  draw("path", {
    class: "shell",
    d:
      "M150 106h212c58 0 80 38 90 104c8 54-3 88-37 88c-36 0-46-54-84-54H181" +
      "c-38 0-48 54-84 54c-34 0-45-34-37-88c10-66 32-104 90-104z",
  });
  draw("path", { class: "shoulder", d: "M126 101c5-13 20-20 52-21" }, BUTTON.left1);
  draw("path", { class: "shoulder", d: "M386 101c-5-13-20-20-52-21" }, BUTTON.right1);
  draw("path", { class: "shoulder", d: "M138 70c6-9 18-14 36-15" }, BUTTON.left2);
  draw("path", { class: "shoulder", d: "M374 70c-6-9-18-14-36-15" }, BUTTON.right2);
  for (const [button, x, y] of [
    [BUTTON.up, 131, 140],
    [BUTTON.down, 131, 164],
    [BUTTON.left, 119, 152],
    [BUTTON.right, 143, 152],
  ]) {
    draw("rect", { class: "cross", x, y, width: 13, height: 13, rx: 3 }, button);
  }
  for (const [button, x, y, name] of [
    [BUTTON.a, 374, 180, "A"],
    [BUTTON.b, 395, 159, "B"],
    [BUTTON.x, 353, 159, "X"],
    [BUTTON.y, 374, 138, "Y"],
  ] as const) {
    draw("circle", { class: "button", cx: x, cy: y, r: 9 }, button);
    svg.append(shape("text", { x, y: y + 3.5, class: "letter" }, document.createTextNode(name)));
  }
  const sticks = [194, 318].map((x) => {
    draw("circle", { class: "well", cx: x, cy: 214, r: 30 });
    return draw("circle", { class: "stick", cx: x, cy: 214, r: 19 });
  });
  for (const d of ["M194 245V306", "M318 245V306", "M156 55V42", "M356 55V42"]) draw("path", { class: "lead", d });
  const labels = {
    sticks: [text(194, 324), text(318, 324)],
    triggers: [text(140, 16), text(372, 16)],
    chords: [text(140, 33, "small"), text(372, 33, "small")],
    rest: text(256, 348, "small"),
  };
  return {
    element: svg,
    setMapping(mapping) {
      const commandsOf = (...controls: Control[]): Command[] =>
        controls.flatMap((control) => mapping.bindings[control] ?? []);
      for (const side of [0, 1]) {
        const axes = [side * 2, side * 2 + 1].flatMap((axis) => [`axis:${axis}+`, `axis:${axis}-`]);
        setText(labels.sticks[side], summarizeCommands(commandsOf(...axes)));
        const trigger = summarizeCommands(commandsOf(`button:${BUTTON.left2 + side}`), side);
        const sideName = side === 0 ? "L" : "R";
        setText(labels.triggers[side], trigger ? `${sideName}2 ${trigger.toLowerCase()}` : "");
        const shoulder = `button:${BUTTON.left1 + side}`;
        const chords = Object.keys(mapping.bindings).filter((control) => control.startsWith(`${shoulder} `));
        const held = summarizeCommands(commandsOf(...chords), side);
        const alone = summarizeCommands(commandsOf(shoulder));
        setText(
          labels.chords[side],
          held
            ? translate("hold {button}: {commands}", { button: `${sideName}1`, commands: held.toLowerCase() })
            : alone
              ? `${sideName}1 ${alone.toLowerCase()}`
              : "",
        );
      }
      const buttonTexts = LABELLED_BUTTONS.flatMap(([name, index]) => {
        const commands = commandsOf(`button:${index}`);
        return commands.length > 0 ? [`${name} ${joinList(commands.map(shortCommandName))}`] : [];
      });
      setText(labels.rest, buttonTexts.join("   "));
      const parts = [...labels.sticks, ...labels.triggers, ...labels.chords, labels.rest]
        .map(({ textContent }) => textContent)
        .filter(Boolean);
      svg.setAttribute("aria-label", translate("Gamepad: {parts}", { parts: parts.join(translate("; ")) }));
    },
    highlightPressed(pad, deadZone) {
      for (const [index, part] of buttons)
        setAttribute(part, "data-on", (pad?.buttons[index]?.value ?? 0) > PRESS_THRESHOLD / 10);
      sticks.forEach((part, side) => {
        const [x, y] = [pad?.axes[side * 2] ?? 0, pad?.axes[side * 2 + 1] ?? 0];
        part.setAttribute("transform", `translate(${(x * 11).toFixed(1)} ${(y * 11).toFixed(1)})`);
        setAttribute(part, "data-on", Math.hypot(x, y) > deadZone);
      });
    },
  };
}

/** Buttons whose commands are listed below the drawing. */
const LABELLED_BUTTONS = [
  ["A", BUTTON.a],
  ["B", BUTTON.b],
  ["X", BUTTON.x],
  ["Y", BUTTON.y],
  ["←", BUTTON.left],
  ["→", BUTTON.right],
  ["↑", BUTTON.up],
  ["↓", BUTTON.down],
] as const;
const SHORT_NAMES: Readonly<Record<string, PlainMessageKey>> = {
  play: "play",
  back: "seek back",
  forward: "forward",
  ask: "ask",
  give: "give",
  keep: "keep",
};

function shortCommandName(command: Command): string {
  const short = SHORT_NAMES[command];
  return short ? translate(short) : summarizeCommands([command]).toLowerCase();
}
