/** Press-and-hold buttons that move a limb of the selected performer, laid out like the keys Q W E, A S D. */
import { translate } from "../../i18n/translator";
import { DIGITAL_INPUTS, type DigitalInput, effectOf } from "../../input/digital-input";
import { element } from "../dom";
import { icon } from "../icon";
import { LIMB_NAMES } from "../limb-state";
import { directionName } from "../mapping/command-name";

/** Directions in layout order, three per row. A leg has only up and down. */
const DIRECTIONS = ["nearer", "up", "further", "left", "down", "right"];
/** Length of a press that was caused by assistive technology and therefore cannot be held. */
const CLICK_PRESS_MS = 250;

export interface DirectionPad {
  readonly element: HTMLElement;
  setVisible(visible: boolean): void;
}

/** Create the buttons of a limb. `onPress` is called when one goes down (`down` is true) and when it comes up. */
export function createDirectionPad(limb: number, onPress: (input: DigitalInput, down: boolean) => void): DirectionPad {
  const down = new Set<DigitalInput>();
  const setDown = (input: DigitalInput, isDown: boolean) => {
    if (down.has(input) === isDown) return;
    if (isDown) down.add(input);
    else down.delete(input);
    onPress(input, isDown);
  };
  const pad = element("div", {
    class: "move-pad",
    role: "group",
    "aria-label": translate("Move the {limb}", { limb: translate(LIMB_NAMES[limb]).toLowerCase() }),
    "data-leg": limb >= 2,
    hidden: true,
  });
  const inputs = DIGITAL_INPUTS.filter((input) => effectOf(input).limb === limb);
  for (const direction of DIRECTIONS)
    for (const input of inputs)
      if (directionName(input) === direction) pad.append(createDirectionButton(input, setDown));
  return {
    element: pad,
    setVisible(visible) {
      pad.hidden = !visible;
      if (!visible) for (const input of [...down]) setDown(input, false);
    },
  };
}

function createDirectionButton(
  input: DigitalInput,
  onPress: (input: DigitalInput, down: boolean) => void,
): HTMLButtonElement {
  const direction = directionName(input);
  const text = translate(direction);
  const name = text.charAt(0).toUpperCase() + text.slice(1);
  const button = element("button", { class: "move", type: "button", "aria-label": name });
  button.append(direction === "nearer" || direction === "further" ? name : icon(direction));
  let pressed = false;
  const setPressed = (isPressed: boolean) => {
    pressed = isPressed;
    if (isPressed) button.dataset.on = "";
    else delete button.dataset.on;
    onPress(input, isPressed);
  };
  button.addEventListener("pointerdown", (event) => {
    if (event.button !== 0) return;
    button.setPointerCapture(event.pointerId);
    setPressed(true);
  });
  for (const type of ["pointerup", "pointercancel", "lostpointercapture", "blur"])
    button.addEventListener(type, () => setPressed(false));
  const isPress = ({ key }: KeyboardEvent) => key === " " || key === "Enter";
  button.addEventListener("keydown", (event) => {
    if (!isPress(event)) return;
    event.preventDefault();
    if (!event.repeat) setPressed(true);
  });
  button.addEventListener("keyup", (event) => {
    if (isPress(event)) setPressed(false);
  });
  // A click without a pointer or a key comes from assistive technology, which cannot hold the button.
  button.addEventListener("click", (event) => {
    if (event.detail !== 0 || pressed) return;
    setPressed(true);
    setTimeout(() => setPressed(false), CLICK_PRESS_MS);
  });
  button.addEventListener("contextmenu", (event) => event.preventDefault());
  return button;
}
