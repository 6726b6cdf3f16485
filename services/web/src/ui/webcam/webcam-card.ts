/** Card of the camera: the person as in a mirror, what happens, and the buttons. */

import { formatPercent } from "../../i18n/number-format";
import { type PlainMessageKey, translate } from "../../i18n/translator";
import { element, setAttribute, setText } from "../dom";
import { icon } from "../icon";
import { createMirror, type Mirror } from "./mirror";

/** What the person does on the stage. */
export type ModeName = "hands" | "performer";

const MODE_LABELS: Readonly<Record<ModeName, PlainMessageKey>> = { hands: "Hands", performer: "Whole body" };

export interface WebcamActions {
  stop(): void;
  recalibrate(): void;
  retry(): void;
  choose(mode: ModeName): void;
}

/** Problem for the person: what it is, and what to do about it. */
export interface WebcamProblem {
  readonly cause: string;
  readonly remedy: string;
}

export interface WebcamCard {
  readonly element: HTMLElement;
  readonly mirror: Mirror;
  /** Show what happens. */
  setStatus(text: string): void;
  /** Show the share of something that has been done, 0 to 1; null hides it. */
  setProgress(share: number | null): void;
  /** Show a problem in place of the person; null removes it. */
  setProblem(problem: WebcamProblem | null): void;
  /** Offer to calibrate again. */
  setFollowing(isFollowing: boolean): void;
  remove(): void;
}

/** Create the card in `root`. It offers `modes`, of which the first is chosen. */
export function createWebcamCard(root: HTMLElement, modes: readonly ModeName[], actions: WebcamActions): WebcamCard {
  const mirror = createMirror();
  const chooser = element(
    "div",
    { class: "webcam-modes", role: "radiogroup", "aria-label": translate("What to move"), hidden: modes.length < 2 },
    ...modes.map((name, index) => {
      const onChange = () => actions.choose(name);
      const radio = element("input", { type: "radio", name: "webcam-mode", checked: index === 0, onChange });
      return element("label", {}, radio, element("span", {}, translate(MODE_LABELS[name])));
    }),
  );
  const status = element("p", { class: "webcam-status", role: "status" });
  const bar = element("i");
  const progress = element("div", { class: "progress", role: "progressbar", hidden: true }, bar);
  const problem = element("div", { class: "problem", role: "alert", hidden: true });
  const textButton = (label: PlainMessageKey, onClick: () => void) =>
    element("button", { class: "text-button", type: "button", hidden: true, onClick }, translate(label));
  const again = textButton("Calibrate again", actions.recalibrate);
  const retry = textButton("Try again", actions.retry);
  const picture = element(
    "button",
    {
      class: "round-button",
      type: "button",
      "aria-label": translate("Show the picture of the camera"),
      "aria-pressed": "true",
      onClick: () => {
        mirror.showsPicture = !mirror.showsPicture;
        setAttribute(picture, "aria-pressed", String(mirror.showsPicture));
      },
    },
    icon("picture"),
  );
  const stop = element(
    "button",
    { class: "round-button", type: "button", "aria-label": translate("Stop the camera"), onClick: actions.stop },
    icon("close"),
  );
  const card = element(
    "section",
    { class: "webcam", "aria-label": translate("Camera") },
    chooser,
    mirror.element,
    progress,
    problem,
    status,
    element("div", { class: "webcam-buttons" }, again, retry, picture, stop),
  );
  root.append(card);
  return {
    element: card,
    mirror,
    setStatus: (text) => setText(status, text),
    setProgress(share) {
      progress.hidden = share === null;
      if (share === null) return;
      setAttribute(bar, "style", `width: ${Math.round(share * 100)}%`);
      setAttribute(progress, "aria-valuenow", Math.round(share * 100));
      setAttribute(progress, "aria-valuetext", formatPercent(share));
      setAttribute(progress, "aria-label", status.textContent);
    },
    setProblem(shown) {
      problem.hidden = shown === null;
      mirror.element.hidden = status.hidden = picture.hidden = shown !== null;
      retry.hidden = shown === null;
      if (shown) problem.replaceChildren(element("b", {}, shown.cause), shown.remedy);
    },
    setFollowing(isFollowing) {
      again.hidden = !isFollowing;
    },
    remove: () => card.remove(),
  };
}
