/** The list of what can be done and the controls that do it: each can be taken away, and another bound by pressing it. */
import { PadCapture } from "../input/capture";
import { mouseControl } from "../input/mouse";
import { bind, conflictsOf, controlsOf, DEFAULT_MAPPING, isPadControl, unbind, type Command, type Control, type Mapping } from "../input/mapping";
import { commandName, GROUPS } from "./command-names";
import { controlName } from "./control-names";
import { element, setAttribute, setText } from "./dom";
import { icon } from "./icons";
import { series, say, sayAround } from "../words/say";

export interface MappingEditor {
  readonly element: HTMLElement;
  /** A press is awaited, to be bound. */
  readonly listening: boolean;
  render(mapping: Mapping): void;
  /** Controls of the gamepad that are pressed, 0 to 1; once a frame. */
  see(pressed: ReadonlyMap<Control, number>): void;
  /** A key while a press is awaited; true where it was taken. */
  key(event: KeyboardEvent): boolean;
  /** A further button of the mouse, or its wheel, while a press is awaited; true where it was taken. */
  mouse(event: MouseEvent): boolean;
  /** Awaits nothing any more. */
  stop(): void;
}

/** Keys that move the focus, or mean nothing alone. */
const RESERVED = new Set(["Escape", "Tab", "ShiftLeft", "ShiftRight", "ControlLeft", "ControlRight", "AltLeft", "AltRight", "MetaLeft", "MetaRight"]);

export function createMappingEditor(change: (mapping: Mapping) => void): MappingEditor {
  let mapping = DEFAULT_MAPPING;
  let awaited: { command: Command; capture: PadCapture } | null = null;
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
    awaited = { command, capture: new PadCapture() };
    setText(live, say("Press a key or a button of the gamepad for: {command}. Escape for none.", { command: commandName(command) }));
    render(command);
  };
  const found = (control: Control) => {
    if (!awaited) return;
    const { command } = awaited;
    awaited = null;
    const also = conflictsOf(bind(mapping, control, command), control, command);
    const bound = { control: controlName(control), command: commandName(command) };
    setText(live, also.length > 0 ? say("{control}: {command}. It does this too: {others}", { ...bound, others: series(also.map(commandName)) }) : say("{control}: {command}", bound));
    change(bind(mapping, control, command));
    rows.get(command)?.add.focus();
  };
  const render = (command: Command) => {
    const row = rows.get(command);
    if (!row) return;
    const controls = controlsOf(mapping, command);
    const clashes = controls.flatMap((control) => conflictsOf(mapping, control, command).map((other) => say("{control} also: {command}", { control: controlName(control), command: commandName(other) })));
    row.chips.replaceChildren(
      ...controls.map((control) => {
        const name = controlName(control);
        const chip = element("button", { class: "chip", type: "button", "aria-label": say("{control}: {command}. Take away", { control: name, command: commandName(command) }), title: say("Take away"), onClick: () => remove(control, command) }, name);
        setAttribute(chip, "data-pad", isPadControl(control));
        setAttribute(chip, "data-clash", conflictsOf(mapping, control, command).length > 0);
        return chip;
      }),
    );
    setText(row.clash, clashes.join(say("; ")));
    row.clash.hidden = clashes.length === 0;
    const waiting = awaited?.command === command;
    setAttribute(row.add, "aria-pressed", waiting);
    row.add.replaceChildren(waiting ? say("press a key") : icon("add"));
  };
  const remove = (control: Control, command: Command) => {
    change(unbind(mapping, control, command));
    rows.get(command)?.add.focus();
  };
  const list = (commands: readonly Command[]) => {
    const made = element("ul", { class: "bindings" });
    for (const command of commands) {
      const [chips, clash] = [element("span", { class: "chips" }), element("small", { class: "clash" })];
      const add = element("button", { class: "add", type: "button", "aria-label": say("Bind a key or button: {command}", { command: commandName(command) }), onClick: () => start(command) });
      rows.set(command, { chips, clash, add });
      made.append(element("li", {}, element("span", { class: "what" }, commandName(command), clash), chips, add));
    }
    return made;
  };
  const [strings, stage, each] = GROUPS.map(list);
  const fixed = element("p", { class: "fixed-keys" }, ...sayAround("{escape} lets go and closes, {question} opens this page.", { escape: element("kbd", {}, "Esc"), question: element("kbd", {}, "?") }));
  const more = element("details", {}, element("summary", {}, say("The 14 inputs, each by itself")), element("p", { class: "muted" }, say("A hand has six, a leg its angle: as buttons, up and down. Right, up and nearer are yours, not the puppet's.")), each);
  return {
    element: element("div", { class: "editor" }, strings, stage, fixed, more, live),
    get listening() {
      return awaited !== null;
    },
    render(now) {
      mapping = now;
      for (const command of rows.keys()) render(command);
    },
    see(pressed) {
      const control = awaited?.capture.see(pressed);
      if (control) found(control);
    },
    key(event) {
      if (!awaited) return false;
      if (event.code === "Escape") stop();
      else if (event.code === "" || RESERVED.has(event.code)) return event.code !== "Tab";
      else if (!event.repeat) found(event.code);
      return true;
    },
    mouse(event) {
      const control = awaited && mouseControl(event);
      if (control) found(control);
      return Boolean(control);
    },
    stop,
  };
}
