/** Fields for a new motion made of another one: begin and end of the part, mirror image, loop. */
import type { MotionEdit } from "../../client/motion-library";
import { formatDecimal } from "../../i18n/number-format";
import { type PlainMessageKey, translate } from "../../i18n/translator";
import { element, setText } from "../dom";

/** Step of the sliders, in seconds. The server rounds times to frames. */
const STEP_S = 0.01;

/** State of the fields: times in seconds. */
export interface Cut {
  readonly start: number;
  readonly end: number;
  readonly mirror: boolean;
  readonly loop: boolean;
}

/** Return the edit that makes this cut of a motion of `seconds`, null if it changes nothing. */
export function editOf({ start, end, mirror, loop }: Cut, seconds: number): MotionEdit | null {
  const edit: MotionEdit = {
    ...(start >= STEP_S ? { start: Math.round(start * 1e6) } : {}),
    ...(end <= seconds - STEP_S ? { end: Math.round(end * 1e6) } : {}),
    ...(mirror ? { mirror } : {}),
    ...(loop ? { loop } : {}),
  };
  return Object.keys(edit).length > 0 && end > start ? edit : null;
}

export interface CutFields {
  readonly element: HTMLElement;
  /** The edit, null if it changes nothing. */
  readonly edit: MotionEdit | null;
}

/** Create the fields. `getPosition` returns the position of the stage in the motion, null if it shows another one. */
export function createCutFields(seconds: number, getPosition: () => number | null): CutFields {
  const start = createTimeField("From", "Begin here", 0, seconds, getPosition);
  const end = createTimeField("To", "End here", seconds, seconds, getPosition);
  const mirror = createCheckbox("Mirror left and right");
  const loop = createCheckbox("Seamless loop");
  // Each slider pushes the other one, so that the part is never empty.
  start.input.addEventListener("input", () => end.set(Math.max(end.seconds, start.seconds + STEP_S)));
  end.input.addEventListener("input", () => start.set(Math.min(start.seconds, end.seconds - STEP_S)));
  return {
    element: element(
      "fieldset",
      { class: "cut" },
      element("legend", {}, translate("New dance from this one")),
      start.element,
      end.element,
      mirror.element,
      loop.element,
    ),
    get edit() {
      const cut = {
        start: start.seconds,
        end: end.seconds,
        mirror: mirror.input.checked,
        loop: loop.input.checked,
      };
      return editOf(cut, seconds);
    },
  };
}

interface TimeField {
  readonly element: HTMLElement;
  readonly input: HTMLInputElement;
  readonly seconds: number;
  set(seconds: number): void;
}

function createTimeField(
  label: PlainMessageKey,
  action: PlainMessageKey,
  initial: number,
  seconds: number,
  getPosition: () => number | null,
): TimeField {
  // The name is without the time, which is the value.
  const name = translate(label);
  const input = element("input", { type: "range", "aria-label": name, min: 0, max: seconds, step: STEP_S });
  // After the limits, which would change it.
  input.valueAsNumber = initial;
  const output = element("output", {});
  const render = () => {
    const text = translate("{seconds} s", { seconds: formatDecimal(input.valueAsNumber, 2) });
    setText(output, text);
    input.setAttribute("aria-valuetext", text);
  };
  const set = (value: number) => {
    input.valueAsNumber = value;
    render();
  };
  input.addEventListener("input", render);
  const here = element(
    "button",
    {
      class: "text-button",
      type: "button",
      onClick: () => {
        set(getPosition() ?? input.valueAsNumber);
        input.dispatchEvent(new Event("input", { bubbles: true }));
      },
    },
    translate(action),
  );
  here.hidden = getPosition() === null;
  render();
  return {
    element: element(
      "div",
      { class: "time-field" },
      element("label", {}, element("span", {}, name), output, input),
      here,
    ),
    input,
    get seconds() {
      return input.valueAsNumber;
    },
    set,
  };
}

function createCheckbox(label: PlainMessageKey): { element: HTMLElement; input: HTMLInputElement } {
  const input = element("input", { type: "checkbox" });
  return { element: element("label", { class: "check" }, input, translate(label)), input };
}
