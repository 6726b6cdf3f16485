/** Words on an empty stage: why nothing dances on it. */
import { element } from "../dom";
import { createLiveRegion } from "./live-region";

/** What a notice is about: who may come in, what draws the stage, or who dances on it. */
export type NoticeSubject = "access" | "graphics" | "dance";

/** Says something about a subject in place of what was said about it; a title of null: there is nothing to show about it any more. */
export type ShowNotice = (about: NoticeSubject, title: string | null, text?: string) => void;

export function createNotice(root: HTMLElement): { element: HTMLElement; notice: ShowNotice } {
  const live = element("div", { class: "notice", role: "status", "aria-atomic": "false" });
  root.append(live);
  const show = createLiveRegion<NoticeSubject>(live);
  return {
    element: live,
    notice: (about, title, text = "") =>
      show(about, title === null ? null : element("p", {}, element("b", {}, title), text)),
  };
}
