/** The sound's button and how loud it is; shown only where the dance has sound. */
import { element, setAttribute } from "./dom";
import { icon } from "./icons";
import { pageSpeech, say } from "../words/say";

/** Steps of the slider, from silent to full. */
const STEPS = 20;

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
export function createSoundButton(press: () => void, { say } = pageSpeech): SoundButton {
  const button = element("button", { class: "round-button", type: "button", "aria-label": say("Sound"), "aria-pressed": "false", onClick: press }, icon("silent"));
  let shown: boolean | null = null;
  return {
    element: button,
    render(heard) {
      if (heard === shown) return;
      shown = heard;
      button.title = say(heard ? "Sound off" : "Sound on");
      setAttribute(button, "aria-pressed", String(heard));
      button.replaceChildren(icon(heard ? "sound" : "silent"));
    },
  };
}

export function createSoundControl(on: SoundActions): SoundControl {
  const button = createSoundButton(on.sound);
  const volume = element("input", {
    type: "range", min: 0, max: STEPS, step: 1, "aria-label": say("Volume"), onInput: () => on.volume(Number(volume.value) / STEPS),
  });
  const control = element("span", { class: "sound", hidden: true }, button.element, volume);
  return {
    element: control,
    render({ there, heard, volume: loud }) {
      control.hidden = !there;
      volume.value = String(Math.round(loud * STEPS));
      button.render(heard);
    },
  };
}
