/** Press-and-hold arrows that move one limb of the chosen performer: laid out as the keys Q W E, A S D are; of a leg only up and down. */

import { translate } from "../../i18n/translator";
import { DIGITAL_INPUTS, type DigitalInput, effectOf } from "../../input/digital-input";
import { element } from "../dom";
import { icon } from "../icon";
import { LIMB_NAMES } from "../limb-state";
import { directionName } from "../mapping/command-name";

/** As they stand, three in a row. */
const DIRECTIONS = ["nearer", "up", "further", "left", "down", "right"];
/** How long an activation that is no press lasts (a screen reader's, a voice's), milliseconds. */
const CLICK_PRESS_MS = 250;

export interface DirectionPad {
  readonly element: HTMLElement;
  setVisible(shown: boolean): void;
}

/** `press(input, down)` is told when a button goes down and comes up. */
export function createDirectionPad(limb: number, onPress: (input: DigitalInput, down: boolean) => void): DirectionPad {
  const down = new Set<DigitalInput>();
  const set = (input: DigitalInput, to: boolean) => {
    if (down.has(input) === to) return;
    if (to) down.add(input);
    else down.delete(input);
    onPress(input, to);
  };
  const pad = element("div", {
    class: "move-pad",
    role: "group",
    "aria-label": translate("Move the {limb}", { limb: translate(LIMB_NAMES[limb]).toLowerCase() }),
    "data-leg": limb >= 2,
    hidden: true,
  });
  const inputs = DIGITAL_INPUTS.filter((one) => effectOf(one).limb === limb);
  for (const way of DIRECTIONS)
    for (const input of inputs) if (directionName(input) === way) pad.append(createDirectionButton(input, set));
  return {
    element: pad,
    setVisible(shown) {
      pad.hidden = !shown;
      if (!shown) for (const input of [...down]) set(input, false);
    },
  };
}

function createDirectionButton(
  input: DigitalInput,
  onPress: (input: DigitalInput, down: boolean) => void,
): HTMLButtonElement {
  const way = directionName(input);
  const said = translate(way);
  const name = said.charAt(0).toUpperCase() + said.slice(1);
  const made = element("button", { class: "move", type: "button", "aria-label": name });
  made.append(way === "nearer" || way === "further" ? name : icon(way));
  let pressed = false;
  const change = (to: boolean) => {
    pressed = to;
    if (to) made.dataset.on = "";
    else delete made.dataset.on;
    onPress(input, to);
  };
  made.addEventListener("pointerdown", (event) => {
    if (event.button !== 0) return;
    made.setPointerCapture(event.pointerId);
    change(true);
  });
  for (const end of ["pointerup", "pointercancel", "lostpointercapture", "blur"])
    made.addEventListener(end, () => change(false));
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
    setTimeout(() => change(false), CLICK_PRESS_MS);
  });
  made.addEventListener("contextmenu", (event) => event.preventDefault());
  return made;
}
