/** A gamepad of the standard layout from above, what each part does under a mapping, and what is pressed of it. */

import { joinList, type PlainMessageKey, translate } from "../../i18n/translator";
import { PRESS_THRESHOLD } from "../../input/gamepad-state";
import type { Command, Control, Mapping } from "../../input/mapping";
import { setAttribute, setText, shape } from "../dom";
import { summarizeCommands } from "./command-name";

/** Buttons of the standard layout by their place. */
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
  /** Names the parts by what they do. */
  setMapping(mapping: Mapping): void;
  /** Lights what is pressed. */
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
    const made = shape("text", { x, y, class: kind });
    svg.append(made);
    return made;
  };
  draw("path", {
    class: "shell",
    d: "M150 106h212c58 0 80 38 90 104c8 54-3 88-37 88c-36 0-46-54-84-54H181c-38 0-48 54-84 54c-34 0-45-34-37-88c10-66 32-104 90-104z",
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
      const of = (...controls: Control[]): Command[] => controls.flatMap((control) => mapping.bindings[control] ?? []);
      const stick = (side: number) =>
        [0, 1].flatMap((axis) => ["+", "-"].map((sign) => `axis:${side * 2 + axis}${sign}`));
      [0, 1].forEach((side) => {
        setText(labels.sticks[side], summarizeCommands(of(...stick(side))));
        const trigger = `button:${BUTTON.left2 + side}`;
        const name = side === 0 ? "L" : "R";
        const does = summarizeCommands(of(trigger), side);
        setText(labels.triggers[side], does ? `${name}2 ${does.toLowerCase()}` : "");
        const held = `button:${BUTTON.left1 + side} `;
        const chords = summarizeCommands(
          of(...Object.keys(mapping.bindings).filter((control) => control.startsWith(held))),
          side,
        );
        const alone = summarizeCommands(of(held.trim()));
        setText(
          labels.chords[side],
          chords
            ? translate("hold {button}: {commands}", { button: `${name}1`, commands: chords.toLowerCase() })
            : alone
              ? `${name}1 ${alone.toLowerCase()}`
              : "",
        );
      });
      const rest = [
        ["A", 0],
        ["B", 1],
        ["X", 2],
        ["Y", 3],
        ["←", 14],
        ["→", 15],
        ["↑", 12],
        ["↓", 13],
      ] as const;
      const short: Readonly<Record<string, PlainMessageKey>> = {
        play: "play",
        back: "seek back",
        forward: "forward",
        ask: "ask",
        give: "give",
        keep: "keep",
      };
      const told = rest.flatMap(([name, index]) => {
        const commands = of(`button:${index}`);
        return commands.length > 0
          ? [
              `${name} ${joinList(commands.map((command) => (short[command] ? translate(short[command]) : summarizeCommands([command]).toLowerCase())))}`,
            ]
          : [];
      });
      setText(labels.rest, told.join("   "));
      const all = [...labels.sticks, ...labels.triggers, ...labels.chords, labels.rest]
        .map(({ textContent }) => textContent)
        .filter(Boolean);
      svg.setAttribute("aria-label", translate("Gamepad: {parts}", { parts: all.join(translate("; ")) }));
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
