/** Downloading a dance: a button beside it that discloses which kinds of files there are, and of several dancers whose. */
import type { ExportFormat } from "../../export/export-file";
import { joinList, type PlainMessageKey, translate } from "../../i18n/translator";
import { element } from "../dom";
import { icon } from "../icon";
import type { MotionItem } from "./library-panel";

/** A kind of file, as people read it. */
interface FileType {
  format: ExportFormat;
  label: string;
  shortName: PlainMessageKey;
  description: PlainMessageKey;
}

const BVH: FileType = {
  format: "bvh",
  label: "BVH",
  shortName: "motion",
  description: "motion for animation programs",
};
const GLB: FileType = { format: "glb", label: "GLB", shortName: "puppet", description: "the puppet and its dance" };
const VRMA: FileType = { format: "vrma", label: "VRMA", shortName: "avatars", description: "motion for VRM avatars" };
/** Of several dancers, all in their places; the other kinds are of one figure each. */
const GLB_OF_ALL: FileType = { ...GLB, shortName: "all the puppets", description: "all the puppets and their dances" };

/** Told of the kind of file that is chosen, and of the performers who are to be in it. */
export type RequestDownload = (format: ExportFormat, performers: readonly number[]) => void;

export interface DownloadMenu {
  readonly button: HTMLElement;
  readonly choices: HTMLElement;
  /** Shows the choices and goes to the first of them. */
  open(): void;
}

/** The downloads of a dance, disclosed or not; `told` when that changes. Escape shuts them. */
export function createDownloadMenu(
  { name, performers }: MotionItem,
  initiallyOpen: boolean,
  onToggle: (disclosed: boolean) => void,
  choose: RequestDownload,
): DownloadMenu {
  const button = element(
    "button",
    { class: "round-button", type: "button", "aria-label": translate("Download {name}", { name }) },
    icon("download"),
  );
  const choices = element("div", {
    class: "downloads",
    role: "group",
    "aria-label": translate("Download {name} as", { name }),
  });
  const offer = ({ format, label, shortName: what, description: words }: FileType, whose: readonly number[]) => {
    const text = [element("b", {}, label), element("small", {}, translate(what))];
    return element(
      "button",
      { type: "button", "aria-label": joinList([label, translate(words)]), onClick: () => choose(format, whose) },
      ...text,
    );
  };
  const all = Array.from({ length: performers }, (_, performer) => performer);
  if (performers === 1) {
    choices.append(...[BVH, GLB, VRMA].map((kind) => offer(kind, all)));
  } else {
    const each = all.map((performer) => {
      const dancer = translate("Dancer {number}", { number: performer + 1 });
      const own = [BVH, VRMA].map((kind) => offer(kind, [performer]));
      return element(
        "div",
        { role: "group", "aria-label": dancer },
        element("span", { "aria-hidden": "true" }, dancer),
        ...own,
      );
    });
    choices.append(offer(GLB_OF_ALL, all), ...each);
  }
  let open = initiallyOpen;
  const show = () => {
    choices.hidden = !open;
    button.setAttribute("aria-expanded", String(open));
  };
  const set = (on: boolean) => {
    open = on;
    show();
    onToggle(on);
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
    open() {
      set(true);
      choices.querySelector("button")?.focus();
    },
  };
}
