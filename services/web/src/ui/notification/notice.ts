/** Notice on an empty stage: why there is no motion on it. */
import { element } from "../dom";
import { createLiveRegion } from "./live-region";

/** Subject of a notice: access to the server, rendering, or the motion on the stage. */
export type NoticeSubject = "access" | "graphics" | "dance";

/** Show a notice about a subject, in place of its last one; a `title` of null removes it. */
export type ShowNotice = (subject: NoticeSubject, title: string | null, text?: string) => void;

export function createNotice(root: HTMLElement): { element: HTMLElement; notice: ShowNotice } {
  const live = element("div", { class: "notice", role: "status", "aria-atomic": "false" });
  root.append(live);
  const show = createLiveRegion<NoticeSubject>(live);
  return {
    element: live,
    notice: (subject, title, text = "") =>
      show(subject, title === null ? null : element("p", {}, element("b", {}, title), text)),
  };
}
