/** Words on an empty stage: why nothing dances on it. */
import { element } from "./dom";
import { createStanding } from "./standing";

/** What a notice is about: who may come in, what draws the stage, or who dances on it. */
export type Subject = "access" | "graphics" | "dance";

/** Says something about a subject in place of what was said about it; a title of null: there is nothing to say about it any more. */
export type Notice = (about: Subject, title: string | null, text?: string) => void;

export function createNotice(root: HTMLElement): { element: HTMLElement; notice: Notice } {
  const live = element("div", { class: "notice", role: "status", "aria-atomic": "false" });
  root.append(live);
  const say = createStanding<Subject>(live);
  return { element: live, notice: (about, title, text = "") => say(about, title === null ? null : element("p", {}, element("b", {}, title), text)) };
}
