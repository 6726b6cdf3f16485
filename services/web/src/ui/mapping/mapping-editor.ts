/** The list of what can be done and the controls that do it: each can be taken away, and another bound by pressing it. */

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
  /** A press is awaited, to be bound. */
  readonly isCapturing: boolean;
  render(mapping: Mapping): void;
  /** Controls of the gamepad that are pressed, 0 to 1; once a frame. */
  captureGamepad(pressed: ReadonlyMap<Control, number>): void;
  /** A key while a press is awaited; true where it was taken. */
  captureKey(event: KeyboardEvent): boolean;
  /** A further button of the mouse, or its wheel, while a press is awaited; true where it was taken. */
  captureMouse(event: MouseEvent): boolean;
  /** Awaits nothing any more. */
  cancelCapture(): void;
}

/** Keys that move the focus, or mean nothing alone. */
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
  let awaited: { command: Command; capture: GamepadCapture } | null = null;
  const live = element("p", { class: "sr-only", role: "status", "aria-live": "polite" });
  const rows = new Map<Command, { chips: HTMLElement; clash: HTMLElement; add: HTMLButtonElement }>();

  const stop = () => {
    const last = awaited;
    awaited = null;
    if (last) render(last.command);
  };
  const start = (command: Command) => {
    const same = awaited?.command === command;
    stop();
    if (same) return;
    awaited = { command, capture: new GamepadCapture() };
    setText(
      live,
      translate("Press a key or a button of the gamepad for: {command}. Escape for none.", {
        command: commandName(command),
      }),
    );
    render(command);
  };
  const found = (control: Control) => {
    if (!awaited) return;
    const { command } = awaited;
    awaited = null;
    const also = conflictsOf(bind(mapping, control, command), control, command);
    const bound = { control: controlName(control), command: commandName(command) };
    setText(
      live,
      also.length > 0
        ? translate("{control}: {command}. It does this too: {others}", {
            ...bound,
            others: joinList(also.map(commandName)),
          })
        : translate("{control}: {command}", bound),
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
            "aria-label": translate("{control}: {command}. Take away", {
              control: name,
              command: commandName(command),
            }),
            title: translate("Take away"),
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
    const waiting = awaited?.command === command;
    setAttribute(row.add, "aria-pressed", waiting);
    row.add.replaceChildren(waiting ? translate("press a key") : icon("add"));
  };
  const remove = (control: Control, command: Command) => {
    onChange(unbind(mapping, control, command));
    rows.get(command)?.add.focus();
  };
  const list = (commands: readonly Command[]) => {
    const made = element("ul", { class: "bindings" });
    for (const command of commands) {
      const [chips, clash] = [element("span", { class: "chips" }), element("small", { class: "clash" })];
      const add = element("button", {
        class: "add",
        type: "button",
        "aria-label": translate("Bind a key or button: {command}", { command: commandName(command) }),
        onClick: () => start(command),
      });
      rows.set(command, { chips, clash, add });
      made.append(element("li", {}, element("span", { class: "what" }, commandName(command), clash), chips, add));
    }
    return made;
  };
  const [strings, stage, each] = COMMAND_GROUPS.map(list);
  const fixed = element(
    "p",
    { class: "fixed-keys" },
    ...translateToParts("{escape} lets go and closes, {question} opens this page.", {
      escape: element("kbd", {}, "Esc"),
      question: element("kbd", {}, "?"),
    }),
  );
  const more = element(
    "details",
    {},
    element("summary", {}, translate("The 14 inputs, each by itself")),
    element(
      "p",
      { class: "muted" },
      translate(
        "A hand has six, a leg its angle: as buttons, up and down. Right, up and nearer are yours, not the puppet's.",
      ),
    ),
    each,
  );
  return {
    element: element("div", { class: "editor" }, strings, stage, fixed, more, live),
    get isCapturing() {
      return awaited !== null;
    },
    render(now) {
      mapping = now;
      for (const command of rows.keys()) render(command);
    },
    captureGamepad(pressed) {
      const control = awaited?.capture.update(pressed);
      if (control) found(control);
    },
    captureKey(event) {
      if (!awaited) return false;
      if (event.code === "Escape") stop();
      else if (event.code === "" || RESERVED_KEYS.has(event.code)) return event.code !== "Tab";
      else if (!event.repeat) found(event.code);
      return true;
    },
    captureMouse(event) {
      const control = awaited && controlOfEvent(event);
      if (control) found(control);
      return Boolean(control);
    },
    cancelCapture: stop,
  };
}
