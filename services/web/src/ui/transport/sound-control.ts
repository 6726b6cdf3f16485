/** The sound's button and how loud it is; shown only where the dance has sound. */

import { pageTranslator, translate } from "../../i18n/translator";
import { element, setAttribute } from "../dom";
import { icon } from "../icon";

/** Steps of the slider, from silent to full. */
const VOLUME_STEPS = 20;

export interface SoundActions {
  /** Lets the sound be heard, or no longer. */
  sound(): void;
  /** How loud, 0 to 1. */
  volume(volume: number): void;
}

export interface SoundControl {
  readonly element: HTMLElement;
  render(state: { readonly there: boolean; readonly heard: boolean; readonly volume: number }): void;
}

export interface SoundButton {
  readonly element: HTMLButtonElement;
  render(heard: boolean): void;
}

/** The button alone; `press` is told of a press. */
export function createSoundButton(onPress: () => void, { translate } = pageTranslator): SoundButton {
  const button = element(
    "button",
    {
      class: "round-button",
      type: "button",
      "aria-label": translate("Sound"),
      "aria-pressed": "false",
      onClick: onPress,
    },
    icon("silent"),
  );
  let shown: boolean | null = null;
  return {
    element: button,
    render(heard) {
      if (heard === shown) return;
      shown = heard;
      button.title = translate(heard ? "Sound off" : "Sound on");
      setAttribute(button, "aria-pressed", String(heard));
      button.replaceChildren(icon(heard ? "sound" : "silent"));
    },
  };
}

export function createSoundControl(actions: SoundActions): SoundControl {
  const button = createSoundButton(actions.sound);
  const volume = element("input", {
    type: "range",
    min: 0,
    max: VOLUME_STEPS,
    step: 1,
    "aria-label": translate("Volume"),
    onInput: () => actions.volume(Number(volume.value) / VOLUME_STEPS),
  });
  const control = element("span", { class: "sound", hidden: true }, button.element, volume);
  return {
    element: control,
    render({ there, heard, volume: loud }) {
      control.hidden = !there;
      volume.value = String(Math.round(loud * VOLUME_STEPS));
      button.render(heard);
    },
  };
}
