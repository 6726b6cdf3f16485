/** Keys and gamepad: what does what and how to change it, a drawing of the pad that lights up as it is used, and how much is smoothed. */
import { pressedControls } from "../input/gamepad-reading";
import { DEAD_ZONE_MOST, DEFAULT_MAPPING, type Mapping } from "../input/mapping";
import { element, setText } from "./dom";
import { icon } from "./icons";
import { createMappingEditor } from "./mapping-editor";
import { createPadDrawing } from "./pad-drawing";
import { percent } from "../words/numbers";
import { say } from "../words/say";

export interface KeysModal {
  show(): void;
  readonly open: boolean;
  /** A key or button is awaited, to be bound: it shall do nothing else. */
  readonly listening: boolean;
  /** Lights what is pressed; null when no pad is there. Once a frame while it is open. */
  pad(pad: { id: string; axes: readonly number[]; buttons: readonly { pressed: boolean; value: number }[] } | null): void;
  mapping(mapping: Mapping): void;
}

const SLIDERS = [
  { name: "deadZone", label: "Dead zone of the sticks", most: DEAD_ZONE_MOST },
  { name: "stickSmoothing", label: "Smoothing of the sticks", most: 1 },
  { name: "pointerSmoothing", label: "Smoothing of mouse and touch", most: 1 },
] as const;

/** `change` is told the new mapping whenever it is edited, and shall bring it back by `mapping`. */
export function createKeysModal(root: HTMLElement, change: (mapping: Mapping) => void): KeysModal {
  let mapping = DEFAULT_MAPPING;
  const dialog = element("dialog", { class: "modal", "aria-label": say("Keys and gamepad") });
  const close = element("button", { class: "round-button", type: "button", "aria-label": say("Close"), onClick: () => dialog.close() }, icon("close"));
  const drawing = createPadDrawing();
  const editor = createMappingEditor(change);
  const state = element("p", { class: "pad-state" });
  const sliders = SLIDERS.map(({ name, label: english, most }) => {
    const label = say(english);
    const value = element("span", { class: "value", "aria-hidden": "true" });
    const input = element("input", { type: "range", "aria-label": label, min: 0, max: most, step: 0.01, onInput: () => change({ ...mapping, [name]: Number(input.value) }) });
    return { name, value, input, row: element("label", { class: "slider" }, element("span", {}, label), value, input) };
  });
  const reset = element("button", { class: "text-button", type: "button", onClick: () => change(DEFAULT_MAPPING) }, say("Back to the default"));
  const left = element("div", { class: "pad" });
  left.append(drawing.element, state, ...sliders.map(({ row }) => row), reset);
  dialog.append(element("div", { class: "panel-head" }, element("h2", {}, say("Keys and gamepad")), close), element("div", { class: "modal-columns" }, left, editor.element));
  dialog.addEventListener("click", (event) => {
    if (event.target === dialog) dialog.close();
  });
  dialog.addEventListener("keydown", (event) => {
    if (editor.key(event)) event.preventDefault();
  }, true);
  for (const kind of ["mousedown", "wheel"] as const) {
    dialog.addEventListener(kind, (event) => {
      if (editor.mouse(event)) event.preventDefault();
    }, { passive: false });
  }
  dialog.addEventListener("cancel", (event) => {
    if (editor.listening) event.preventDefault();
  });
  dialog.addEventListener("close", () => editor.stop());
  root.append(dialog);
  return {
    show: () => dialog.showModal(),
    get open() {
      return dialog.open;
    },
    get listening() {
      return editor.listening;
    },
    pad(now) {
      setText(state, now ? say("{pad} is connected", { pad: now.id.replace(/\s*\(.*\)$/, "") }) : say("Press any button of a gamepad to connect it"));
      drawing.light(now, mapping.deadZone);
      editor.see(now ? pressedControls(now, mapping.deadZone) : new Map());
    },
    mapping(now) {
      mapping = now;
      editor.render(now);
      drawing.label(now);
      for (const { name, value, input } of sliders) {
        input.value = String(now[name]);
        const told = now[name] > 0 ? percent(now[name]) : say("off");
        setText(value, told);
        input.setAttribute("aria-valuetext", told);
      }
      reset.disabled = now === DEFAULT_MAPPING;
    },
  };
}
