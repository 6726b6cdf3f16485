/** Keys and gamepad: what does what and how to change it, a drawing of the pad that lights up as it is used, and how much is smoothed. */

import { formatPercent } from "../../i18n/number-format";
import { translate } from "../../i18n/translator";
import { pressedControls } from "../../input/gamepad-state";
import { DEFAULT_MAPPING, MAX_DEAD_ZONE, type Mapping } from "../../input/mapping";
import { element, setText } from "../dom";
import { icon } from "../icon";
import { createGamepadDrawing } from "./gamepad-drawing";
import { createMappingEditor } from "./mapping-editor";

export interface MappingDialog {
  show(): void;
  readonly isOpen: boolean;
  /** A key or button is awaited, to be bound: it shall do nothing else. */
  readonly isCapturing: boolean;
  /** Lights what is pressed; null when no pad is there. Once a frame while it is open. */
  updateGamepad(
    pad: { id: string; axes: readonly number[]; buttons: readonly { pressed: boolean; value: number }[] } | null,
  ): void;
  setMapping(mapping: Mapping): void;
}

const SLIDERS = [
  { name: "deadZone", label: "Dead zone of the sticks", most: MAX_DEAD_ZONE },
  { name: "stickSmoothing", label: "Smoothing of the sticks", most: 1 },
  { name: "pointerSmoothing", label: "Smoothing of mouse and touch", most: 1 },
] as const;

/** `change` is told the new mapping whenever it is edited, and shall bring it back by `mapping`. */
export function createMappingDialog(root: HTMLElement, onChange: (mapping: Mapping) => void): MappingDialog {
  let mapping = DEFAULT_MAPPING;
  const dialog = element("dialog", { class: "modal", "aria-label": translate("Keys and gamepad") });
  const close = element(
    "button",
    { class: "round-button", type: "button", "aria-label": translate("Close"), onClick: () => dialog.close() },
    icon("close"),
  );
  const drawing = createGamepadDrawing();
  const editor = createMappingEditor(onChange);
  const state = element("p", { class: "pad-state" });
  const sliders = SLIDERS.map(({ name, label: english, most }) => {
    const label = translate(english);
    const value = element("span", { class: "value", "aria-hidden": "true" });
    const input = element("input", {
      type: "range",
      "aria-label": label,
      min: 0,
      max: most,
      step: 0.01,
      onInput: () => onChange({ ...mapping, [name]: Number(input.value) }),
    });
    return { name, value, input, row: element("label", { class: "slider" }, element("span", {}, label), value, input) };
  });
  const reset = element(
    "button",
    { class: "text-button", type: "button", onClick: () => onChange(DEFAULT_MAPPING) },
    translate("Back to the default"),
  );
  const left = element("div", { class: "pad" });
  left.append(drawing.element, state, ...sliders.map(({ row }) => row), reset);
  dialog.append(
    element("div", { class: "panel-head" }, element("h2", {}, translate("Keys and gamepad")), close),
    element("div", { class: "modal-columns" }, left, editor.element),
  );
  dialog.addEventListener("click", (event) => {
    if (event.target === dialog) dialog.close();
  });
  dialog.addEventListener(
    "keydown",
    (event) => {
      if (editor.captureKey(event)) event.preventDefault();
    },
    true,
  );
  for (const kind of ["mousedown", "wheel"] as const) {
    dialog.addEventListener(
      kind,
      (event) => {
        if (editor.captureMouse(event)) event.preventDefault();
      },
      { passive: false },
    );
  }
  dialog.addEventListener("cancel", (event) => {
    if (editor.isCapturing) event.preventDefault();
  });
  dialog.addEventListener("close", () => editor.cancelCapture());
  root.append(dialog);
  return {
    show: () => dialog.showModal(),
    get isOpen() {
      return dialog.open;
    },
    get isCapturing() {
      return editor.isCapturing;
    },
    updateGamepad(now) {
      setText(
        state,
        now
          ? translate("{pad} is connected", { pad: now.id.replace(/\s*\(.*\)$/, "") })
          : translate("Press any button of a gamepad to connect it"),
      );
      drawing.highlightPressed(now, mapping.deadZone);
      editor.captureGamepad(now ? pressedControls(now, mapping.deadZone) : new Map());
    },
    setMapping(now) {
      mapping = now;
      editor.render(now);
      drawing.setMapping(now);
      for (const { name, value, input } of sliders) {
        input.value = String(now[name]);
        const told = now[name] > 0 ? formatPercent(now[name]) : translate("off");
        setText(value, told);
        input.setAttribute("aria-valuetext", told);
      }
      reset.disabled = now === DEFAULT_MAPPING;
    },
  };
}
