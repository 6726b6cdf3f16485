/** Controls of the immersive session: a button that enters and leaves it, and the size of the stage in the room. */
import { translate } from "../i18n/translator";
import type { StageSize } from "../immersive/placement";
import { element, setText, shape } from "./dom";

/** Outline of a headset on a 20 px grid. */
const HEADSET =
  "M3.500 6.500h13a1.500 1.500 0 0 1 1.500 1.500v5a1.500 1.500 0 0 1-1.500 1.500h-3.300l-1.700-2.400" +
  "a1.850 1.850 0 0 0-3 0l-1.700 2.400H3.500A1.500 1.500 0 0 1 2 13V8a1.500 1.500 0 0 1 1.500-1.500z" +
  "M6.300 10.200h.01M13.700 10.200h.01";

export interface ImmersiveState {
  readonly isPresenting: boolean;
  /** True while the session is being prepared. */
  readonly isBusy: boolean;
  readonly size: StageSize;
}

export interface ImmersiveControls {
  /** False hides the controls. */
  isShown: boolean;
  render(state: ImmersiveState): void;
}

/** Create the controls beside the other buttons of the page's header in `root`. */
export function createImmersiveControls(
  root: ParentNode,
  actions: { toggle(): void; resize(): void },
): ImmersiveControls {
  const label = element("span");
  const button = element(
    "button",
    { class: "share immersive-button", type: "button", onClick: actions.toggle },
    shape("svg", { class: "icon", viewBox: "0 0 20 20", "aria-hidden": "true" }, shape("path", { d: HEADSET })),
    label,
  );
  const size = element("button", { class: "round-button immersive-size", type: "button", onClick: actions.resize });
  const group = element("div", { class: "immersive" }, button, size);
  root.querySelector(".header .keys-button")?.before(group);
  return {
    get isShown() {
      return !group.hidden;
    },
    set isShown(on) {
      group.hidden = !on;
    },
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
