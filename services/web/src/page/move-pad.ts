/** Press-and-hold arrows that move one limb of the chosen performer: laid out as the keys Q W E, A S D are; of a leg only up and down. */
import { DIGITAL_INPUTS, effectOf, type DigitalInput } from "../input/inputs";
import { wayName } from "./command-names";
import { element } from "./dom";
import { icon } from "./icons";
import { LIMB_NAMES } from "./model";
import { say } from "../words/say";

/** As they stand, three in a row. */
const WAYS = ["nearer", "up", "further", "left", "down", "right"];
/** How long an activation that is no press lasts (a screen reader's, a voice's), milliseconds. */
const NUDGE = 250;

export interface MovePad {
  readonly element: HTMLElement;
  show(shown: boolean): void;
}

/** `press(input, down)` is told when a button goes down and comes up. */
export function createMovePad(limb: number, press: (input: DigitalInput, down: boolean) => void): MovePad {
  const down = new Set<DigitalInput>();
  const set = (input: DigitalInput, to: boolean) => {
    if (down.has(input) === to) return;
    if (to) down.add(input);
    else down.delete(input);
    press(input, to);
  };
  const pad = element("div", { class: "move-pad", role: "group", "aria-label": say("Move the {limb}", { limb: say(LIMB_NAMES[limb]).toLowerCase() }), "data-leg": limb >= 2, hidden: true });
  const inputs = DIGITAL_INPUTS.filter((one) => effectOf(one).limb === limb);
  for (const way of WAYS) for (const input of inputs) if (wayName(input) === way) pad.append(button(input, set));
  return {
    element: pad,
    show(shown) {
      pad.hidden = !shown;
      if (!shown) for (const input of [...down]) set(input, false);
    },
  };
}

function button(input: DigitalInput, set: (input: DigitalInput, down: boolean) => void): HTMLButtonElement {
  const way = wayName(input);
  const said = say(way);
  const name = said.charAt(0).toUpperCase() + said.slice(1);
  const made = element("button", { class: "move", type: "button", "aria-label": name });
  made.append(way === "nearer" || way === "further" ? name : icon(way));
  let pressed = false;
  const change = (to: boolean) => {
    pressed = to;
    if (to) made.dataset.on = "";
    else delete made.dataset.on;
    set(input, to);
  };
  made.addEventListener("pointerdown", (event) => {
    if (event.button !== 0) return;
    made.setPointerCapture(event.pointerId);
    change(true);
  });
  for (const end of ["pointerup", "pointercancel", "lostpointercapture", "blur"]) made.addEventListener(end, () => change(false));
  const isPress = ({ key }: KeyboardEvent) => key === " " || key === "Enter";
  made.addEventListener("keydown", (event) => {
    if (!isPress(event)) return;
    event.preventDefault();
    if (!event.repeat) change(true);
  });
  made.addEventListener("keyup", (event) => {
    if (isPress(event)) change(false);
  });
  // no pointer and no key: whatever activated it cannot hold it
  made.addEventListener("click", (event) => {
    if (event.detail !== 0 || pressed) return;
    change(true);
    setTimeout(() => change(false), NUDGE);
  });
  made.addEventListener("contextmenu", (event) => event.preventDefault());
  return made;
}
