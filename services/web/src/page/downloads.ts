/** Downloading a dance: a button beside it that discloses which kinds of files there are, and of several dancers whose. */
import type { Format } from "../export/file";
import { say, series, type Plain } from "../words/say";
import { element } from "./dom";
import { icon } from "./icons";
import type { Piece } from "./library";

/** A kind of file, as people read it. */
interface Kind {
  format: Format;
  label: string;
  what: Plain;
  told: Plain;
}

const BVH: Kind = { format: "bvh", label: "BVH", what: "motion", told: "motion for animation programs" };
const GLB: Kind = { format: "glb", label: "GLB", what: "puppet", told: "the puppet and its dance" };
const VRMA: Kind = { format: "vrma", label: "VRMA", what: "avatars", told: "motion for VRM avatars" };
/** Of several dancers, all in their places; the other kinds are of one figure each. */
const TOGETHER: Kind = { ...GLB, what: "all the puppets", told: "all the puppets and their dances" };

/** Told of the kind of file that is chosen, and of the performers who are to be in it. */
export type ChooseFile = (format: Format, performers: readonly number[]) => void;

export interface Downloads {
  readonly button: HTMLElement;
  readonly choices: HTMLElement;
  /** Shows the choices and goes to the first of them. */
  disclose(): void;
}

/** The downloads of a dance, disclosed or not; `told` when that changes. Escape shuts them. */
export function createDownloads({ name, performers }: Piece, disclosed: boolean, told: (disclosed: boolean) => void, choose: ChooseFile): Downloads {
  const button = element("button", { class: "round-button", type: "button", "aria-label": say("Download {name}", { name }) }, icon("download"));
  const choices = element("div", { class: "downloads", role: "group", "aria-label": say("Download {name} as", { name }) });
  const offer = ({ format, label, what, told: words }: Kind, whose: readonly number[]) => {
    const text = [element("b", {}, label), element("small", {}, say(what))];
    return element("button", { type: "button", "aria-label": series([label, say(words)]), onClick: () => choose(format, whose) }, ...text);
  };
  const all = Array.from({ length: performers }, (_, performer) => performer);
  if (performers === 1) {
    choices.append(...[BVH, GLB, VRMA].map((kind) => offer(kind, all)));
  } else {
    const each = all.map((performer) => {
      const dancer = say("Dancer {number}", { number: performer + 1 });
      const own = [BVH, VRMA].map((kind) => offer(kind, [performer]));
      return element("div", { role: "group", "aria-label": dancer }, element("span", { "aria-hidden": "true" }, dancer), ...own);
    });
    choices.append(offer(TOGETHER, all), ...each);
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
