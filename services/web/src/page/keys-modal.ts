/** Keys and gamepad: the list of keys, and a drawing of the pad that lights up as it is used. */
import { BUTTON, DEAD_ZONE } from "../input/gamepad-mapping";
import { element, setAttribute, setText, shape } from "./dom";
import { icon } from "./icons";

const KEYS: readonly (readonly [keys: readonly string[], what: string])[] = [
  [["1", "2"], "take or let go right, left hand"],
  [["3", "4"], "take or let go right, left leg"],
  [["W", "A", "S", "D"], "pull the held string; arrows too"],
  [["Q", "E"], "nearer, further; Page Down, Page Up"],
  [["Space"], "play or pause"],
  [["←", "→"], "seek by one block, no string held"],
  [["L", "S", "N"], "library, strings, line"],
  [["Esc"], "let go, close"],
  [["?"], "this page"],
];

export interface KeysModal {
  show(): void;
  readonly open: boolean;
  /** Lights what is pressed; null when no pad is there. */
  pad(pad: { id: string; axes: readonly number[]; buttons: readonly { pressed: boolean; value: number }[] } | null): void;
}

export function createKeysModal(root: HTMLElement): KeysModal {
  const dialog = element("dialog", { class: "modal", "aria-label": "Keys and gamepad" });
  const close = element("button", { class: "round-button", type: "button", "aria-label": "Close", onClick: () => dialog.close() }, icon("close"));
  const drawing = drawPad();
  const state = element("p", { class: "pad-state" });
  const list = element("dl", { class: "keys" });
  for (const [keys, what] of KEYS) list.append(element("dt", {}, ...keys.map((key) => element("kbd", {}, key))), element("dd", {}, what));
  const pad = element("div", { class: "pad" });
  pad.append(drawing.svg, state);
  dialog.append(element("div", { class: "panel-head" }, element("h2", {}, "Keys and gamepad"), close), element("div", { class: "modal-columns" }, pad, list));
  dialog.addEventListener("click", (event) => {
    if (event.target === dialog) dialog.close();
  });
  root.append(dialog);
  return {
    show: () => dialog.showModal(),
    get open() {
      return dialog.open;
    },
    pad(now) {
      setText(state, now ? `${now.id.replace(/\s*\(.*\)$/, "")} is connected` : "Press any button of a gamepad to connect it");
      for (const [index, part] of drawing.buttons) setAttribute(part, "data-on", (now?.buttons[index]?.value ?? 0) > 0.05);
      drawing.sticks.forEach((part, side) => {
        const [x, y] = [now?.axes[side * 2] ?? 0, now?.axes[side * 2 + 1] ?? 0];
        part.setAttribute("transform", `translate(${(x * 11).toFixed(1)} ${(y * 11).toFixed(1)})`);
        setAttribute(part, "data-on", Math.hypot(x, y) > DEAD_ZONE);
      });
    },
  };
}

/** The pad from above: shell, shoulders and triggers, cross, buttons, two sticks, and what each of them does. */
function drawPad(): { svg: SVGSVGElement; buttons: Map<number, SVGElement>; sticks: SVGElement[] } {
  const svg = shape("svg", { viewBox: "-16 0 544 344", role: "img", "aria-label": "Gamepad: sticks move the hands, L2 and R2 bring them nearer, L1 and R1 with a stick move the legs" });
  const buttons = new Map<number, SVGElement>();
  const draw = (tag: "path" | "circle" | "rect", attributes: Record<string, string | number>, button?: number) => {
    const part = shape(tag, attributes);
    if (button !== undefined) buttons.set(button, part);
    svg.append(part);
    return part;
  };
  const label = (x: number, y: number, text: string, small?: string) => {
    svg.append(shape("text", { x, y }, document.createTextNode(text)));
    if (small) svg.append(shape("text", { x, y: y + 17, class: "small" }, document.createTextNode(small)));
  };
  draw("path", { class: "shell", d: "M150 106h212c58 0 80 38 90 104c8 54-3 88-37 88c-36 0-46-54-84-54H181c-38 0-48 54-84 54c-34 0-45-34-37-88c10-66 32-104 90-104z" });
  draw("path", { class: "shoulder", d: "M126 101c5-13 20-20 52-21" }, BUTTON.left1);
  draw("path", { class: "shoulder", d: "M386 101c-5-13-20-20-52-21" }, BUTTON.right1);
  draw("path", { class: "shoulder", d: "M138 70c6-9 18-14 36-15" }, BUTTON.left2);
  draw("path", { class: "shoulder", d: "M374 70c-6-9-18-14-36-15" }, BUTTON.right2);
  for (const [button, x, y] of [[BUTTON.up, 131, 140], [BUTTON.down, 131, 164], [BUTTON.left, 119, 152], [BUTTON.right, 143, 152]]) {
    draw("rect", { class: "cross", x, y, width: 13, height: 13, rx: 3 }, button);
  }
  for (const [button, x, y] of [[BUTTON.play, 374, 180], [1, 395, 159], [2, 353, 159], [3, 374, 138]]) {
    draw("circle", { class: "button", cx: x, cy: y, r: 8 }, button);
  }
  const sticks = [194, 318].map((x) => {
    draw("circle", { class: "well", cx: x, cy: 214, r: 30 });
    return draw("circle", { class: "stick", cx: x, cy: 214, r: 19 });
  });
  for (const d of ["M194 245V312", "M318 245V312", "M156 55V42", "M356 55V42", "M116 158H32V196", "M384 180H480V196"]) draw("path", { class: "lead", d });
  label(194, 330, "Left hand");
  label(318, 330, "Right hand");
  label(156, 16, "L2 nearer", "hold L1: further, and left leg");
  label(356, 16, "R2 nearer", "hold R1: further, and right leg");
  label(32, 214, "Seek", "left, right");
  label(480, 214, "Play", "A or ×");
  return { svg, buttons, sticks };
}
