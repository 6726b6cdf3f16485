/** Dialog of keys and gamepad: an editor of the mapping, a drawing of the gamepad, and sliders for smoothing. */
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
  /** True if the next key or button is bound to a command, and must have no other effect. */
  readonly isCapturing: boolean;
  /** Highlight the pressed parts; null without a gamepad. Call this every frame while the dialog is open. */
  updateGamepad(
    pad: { id: string; axes: readonly number[]; buttons: readonly { pressed: boolean; value: number }[] } | null,
  ): void;
  setMapping(mapping: Mapping): void;
}

const SLIDERS = [
  { name: "deadZone", label: "Dead zone of the sticks", max: MAX_DEAD_ZONE },
  { name: "stickSmoothing", label: "Smoothing of the sticks", max: 1 },
  { name: "pointerSmoothing", label: "Smoothing of mouse and touch", max: 1 },
] as const;

/** Create the dialog. `onChange` receives each edited mapping, and must return it through `setMapping`. */
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
  const sliders = SLIDERS.map(({ name, label: english, max }) => {
    const label = translate(english);
    const value = element("span", { class: "value", "aria-hidden": "true" });
    const input = element("input", {
      type: "range",
      "aria-label": label,
      min: 0,
      max,
      step: 0.01,
      onInput: () => onChange({ ...mapping, [name]: Number(input.value) }),
    });
    return { name, value, input, row: element("label", { class: "slider" }, element("span", {}, label), value, input) };
  });
  const reset = element(
    "button",
    { class: "text-button", type: "button", onClick: () => onChange(DEFAULT_MAPPING) },
    translate("Reset to defaults"),
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
    updateGamepad(pad) {
      setText(
        state,
        pad
          ? translate("{pad} is connected", { pad: pad.id.replace(/\s*\(.*\)$/, "") })
          : "getGamepads" in navigator
            ? translate("Press any button of a gamepad to connect it")
            : translate("This browser allows gamepads only on pages with HTTPS"),
      );
      drawing.highlightPressed(pad, mapping.deadZone);
      editor.captureGamepad(pad ? pressedControls(pad, mapping.deadZone) : new Map());
    },
    setMapping(current) {
      mapping = current;
      editor.render(current);
      drawing.setMapping(current);
      for (const { name, value, input } of sliders) {
        input.value = String(current[name]);
        const text = current[name] > 0 ? formatPercent(current[name]) : translate("off");
        setText(value, text);
        input.setAttribute("aria-valuetext", text);
      }
      reset.disabled = current === DEFAULT_MAPPING;
    },
  };
}
