/** Sound button and volume slider, shown only for a motion with sound. */
import { pageTranslator, translate } from "../../i18n/translator";
import { element, setAttribute } from "../dom";
import { icon } from "../icon";

/** Steps of the slider from silent to full volume. */
const VOLUME_STEPS = 20;

export interface SoundActions {
  /** Switch the sound on or off. */
  sound(): void;
  /** Set the volume, 0 to 1. */
  volume(volume: number): void;
}

export interface SoundControl {
  readonly element: HTMLElement;
  render(state: { readonly available: boolean; readonly audible: boolean; readonly volume: number }): void;
}

export interface SoundButton {
  readonly element: HTMLButtonElement;
  render(audible: boolean): void;
}

/** Create the button without the slider. */
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
    render(audible) {
      if (audible === shown) return;
      shown = audible;
      button.title = translate(audible ? "Sound off" : "Sound on");
      setAttribute(button, "aria-pressed", String(audible));
      button.replaceChildren(icon(audible ? "sound" : "silent"));
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
    render({ available, audible, volume: value }) {
      control.hidden = !available;
      volume.value = String(Math.round(value * VOLUME_STEPS));
      button.render(audible);
    },
  };
}
