/** Downloading a dance: a button beside it that discloses which kinds of files there are. */
import type { Format } from "../export/file";
import { say, series, type Plain } from "../words/say";
import { element } from "./dom";
import { icon } from "./icons";

/** The kinds of files, as people read them. */
export const FORMATS: readonly { format: Format; label: string; what: Plain; told: Plain }[] = [
  { format: "bvh", label: "BVH", what: "motion", told: "motion for animation programs" },
  { format: "glb", label: "GLB", what: "puppet", told: "the puppet and its dance" },
  { format: "vrma", label: "VRMA", what: "avatars", told: "motion for VRM avatars" },
];

export interface Downloads {
  readonly button: HTMLElement;
  readonly choices: HTMLElement;
  /** Shows the choices and goes to the first of them. */
  disclose(): void;
}

/** The downloads of the dance of this `name`, disclosed or not; `told` when that changes. Escape shuts them. */
export function createDownloads(name: string, disclosed: boolean, told: (disclosed: boolean) => void, choose: (format: Format) => void): Downloads {
  const button = element("button", { class: "round-button", type: "button", "aria-label": say("Download {name}", { name }) }, icon("download"));
  const choices = element("div", { class: "downloads", role: "group", "aria-label": say("Download {name} as", { name }) });
  for (const { format, label, what, told: words } of FORMATS) {
    const text = [element("b", {}, label), element("small", {}, say(what))];
    choices.append(element("button", { type: "button", "aria-label": series([label, say(words)]), onClick: () => choose(format) }, ...text));
  }
  let open = disclosed;
  const show = () => {
    choices.hidden = !open;
    button.setAttribute("aria-expanded", String(open));
  };
  const set = (on: boolean) => {
    open = on;
    show();
    told(on);
  };
  const escape = (event: KeyboardEvent) => {
    if (event.key !== "Escape" || !open) return;
    // the library stays open
    event.stopPropagation();
    set(false);
    button.focus();
  };
  button.addEventListener("click", () => set(!open));
  button.addEventListener("keydown", escape);
  choices.addEventListener("keydown", escape);
  show();
  return {
    button,
    choices,
    disclose() {
      set(true);
      choices.querySelector("button")?.focus();
    },
  };
}
