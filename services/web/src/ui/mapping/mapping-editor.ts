/** Editor of the mapping: lists commands with their controls, removes controls, and binds new ones by pressing them. */
import { joinList, translate, translateToParts } from "../../i18n/translator";
import { GamepadCapture } from "../../input/gamepad-capture";
import {
  bind,
  type Command,
  type Control,
  conflictsOf,
  controlsOf,
  DEFAULT_MAPPING,
  isPadControl,
  type Mapping,
  unbind,
} from "../../input/mapping";
import { controlOfEvent } from "../../input/mouse";
import { element, setAttribute, setText } from "../dom";
import { icon } from "../icon";
import { COMMAND_GROUPS, commandName } from "./command-name";
import { controlName } from "./control-name";

export interface MappingEditor {
  readonly element: HTMLElement;
  /** True if the next press is bound to a command. */
  readonly isCapturing: boolean;
  render(mapping: Mapping): void;
  /** Handle the pressed controls of the gamepad, 0 to 1. Call this every frame. */
  captureGamepad(pressed: ReadonlyMap<Control, number>): void;
  /** Handle a key while capturing. Returns whether it was used. */
  captureKey(event: KeyboardEvent): boolean;
  /** Handle a mouse button other than the first, or the wheel, while capturing. Returns whether it was used. */
  captureMouse(event: MouseEvent): boolean;
  cancelCapture(): void;
}

/** Keys that move the focus, or have no meaning alone. */
const RESERVED_KEYS = new Set([
  "Escape",
  "Tab",
  "ShiftLeft",
  "ShiftRight",
  "ControlLeft",
  "ControlRight",
  "AltLeft",
  "AltRight",
  "MetaLeft",
  "MetaRight",
]);

export function createMappingEditor(onChange: (mapping: Mapping) => void): MappingEditor {
  let mapping = DEFAULT_MAPPING;
  let capturing: { command: Command; capture: GamepadCapture } | null = null;
  const live = element("p", { class: "sr-only", role: "status", "aria-live": "polite" });
  const rows = new Map<Command, { chips: HTMLElement; clash: HTMLElement; add: HTMLButtonElement }>();

  const cancel = () => {
    const last = capturing;
    capturing = null;
    if (last) render(last.command);
  };
  const start = (command: Command) => {
    const isSame = capturing?.command === command;
    cancel();
    if (isSame) return;
    capturing = { command, capture: new GamepadCapture() };
    setText(
      live,
      translate("Press a key or gamepad button for: {command}. Escape cancels.", {
        command: commandName(command),
      }),
    );
    render(command);
  };
  const bindControl = (control: Control) => {
    if (!capturing) return;
    const { command } = capturing;
    capturing = null;
    const conflicts = conflictsOf(bind(mapping, control, command), control, command);
    const names = { control: controlName(control), command: commandName(command) };
    setText(
      live,
      conflicts.length > 0
        ? translate("{control}: {command}. Also bound to: {others}", {
            ...names,
            others: joinList(conflicts.map(commandName)),
          })
        : translate("{control}: {command}", names),
    );
    onChange(bind(mapping, control, command));
    rows.get(command)?.add.focus();
  };
  const render = (command: Command) => {
    const row = rows.get(command);
    if (!row) return;
    const controls = controlsOf(mapping, command);
    const clashes = controls.flatMap((control) =>
      conflictsOf(mapping, control, command).map((other) =>
        translate("{control} also: {command}", { control: controlName(control), command: commandName(other) }),
      ),
    );
    row.chips.replaceChildren(
      ...controls.map((control) => {
        const name = controlName(control);
        const chip = element(
          "button",
          {
            class: "chip",
            type: "button",
            "aria-label": translate("{control}: {command}. Remove", {
              control: name,
              command: commandName(command),
            }),
            title: translate("Remove"),
            onClick: () => remove(control, command),
          },
          name,
        );
        setAttribute(chip, "data-pad", isPadControl(control));
        setAttribute(chip, "data-clash", conflictsOf(mapping, control, command).length > 0);
        return chip;
      }),
    );
    setText(row.clash, clashes.join(translate("; ")));
    row.clash.hidden = clashes.length === 0;
    const isCapturing = capturing?.command === command;
    setAttribute(row.add, "aria-pressed", isCapturing);
    row.add.replaceChildren(isCapturing ? translate("press a key") : icon("add"));
  };
  const remove = (control: Control, command: Command) => {
    onChange(unbind(mapping, control, command));
    rows.get(command)?.add.focus();
  };
  const createList = (commands: readonly Command[]) => {
    const list = element("ul", { class: "bindings" });
    for (const command of commands) {
      const [chips, clash] = [element("span", { class: "chips" }), element("small", { class: "clash" })];
      const add = element("button", {
        class: "add",
        type: "button",
        "aria-label": translate("Bind a key or button: {command}", { command: commandName(command) }),
        onClick: () => start(command),
      });
      rows.set(command, { chips, clash, add });
      list.append(element("li", {}, element("span", { class: "what" }, commandName(command), clash), chips, add));
    }
    return list;
  };
  const [strings, stage, inputs] = COMMAND_GROUPS.map(createList);
  const fixed = element(
    "p",
    { class: "fixed-keys" },
    ...translateToParts("{escape} releases and closes, {question} opens this page.", {
      escape: element("kbd", {}, "Esc"),
      question: element("kbd", {}, "?"),
    }),
  );
  const more = element(
    "details",
    {},
    element("summary", {}, translate("The 14 inputs, one by one")),
    element(
      "p",
      { class: "muted" },
      translate("Each hand has six inputs, each leg two: up and down. Right, up and nearer are as you see the stage."),
    ),
    inputs,
  );
  return {
    element: element("div", { class: "editor" }, strings, stage, fixed, more, live),
    get isCapturing() {
      return capturing !== null;
    },
    render(current) {
      mapping = current;
      for (const command of rows.keys()) render(command);
    },
    captureGamepad(pressed) {
      const control = capturing?.capture.update(pressed);
      if (control) bindControl(control);
    },
    captureKey(event) {
      if (!capturing) return false;
      if (event.code === "Escape") cancel();
      else if (event.code === "" || RESERVED_KEYS.has(event.code)) return event.code !== "Tab";
      else if (!event.repeat) bindControl(event.code);
      return true;
    },
    captureMouse(event) {
      const control = capturing && controlOfEvent(event);
      if (control) bindControl(control);
      return Boolean(control);
    },
    cancelCapture: cancel,
  };
}
