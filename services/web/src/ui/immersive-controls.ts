/** Controls of the immersive session: a button that enters and leaves it, and the size of the stage in the room. */
import { translate } from "../i18n/translator";
import type { StageSize } from "../immersive/placement";
import { element, setText } from "./dom";
import { icon } from "./icon";

export interface ImmersiveState {
  readonly isPresenting: boolean;
  /** True while the session is being prepared. */
  readonly isBusy: boolean;
  readonly size: StageSize;
}

export interface ImmersiveControls {
  readonly element: HTMLElement;
  render(state: ImmersiveState): void;
}

export function createImmersiveControls(actions: { toggle(): void; resize(): void }): ImmersiveControls {
  const label = element("span");
  const button = element(
    "button",
    { class: "share immersive-button", type: "button", onClick: actions.toggle },
    icon("headset"),
    label,
  );
  const size = element("button", { class: "round-button immersive-size", type: "button", onClick: actions.resize });
  return {
    element: element("div", { class: "immersive" }, button, size),
    render(state) {
      const text = translate(state.isPresenting ? "Leave VR" : "Enter VR");
      setText(label, text);
      button.setAttribute("aria-label", text);
      button.setAttribute("aria-busy", String(state.isBusy));
      setText(size, state.size);
      const sizeText = translate(state.size === "1:1" ? "Size in VR: as large as life" : "Size in VR: a quarter");
      size.setAttribute("aria-label", sizeText);
      size.title = sizeText;
    },
  };
}
