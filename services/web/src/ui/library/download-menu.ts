/** Download menu of a motion: a button that opens a list of file types, and with several performers of whose motion. */
import type { ExportFormat } from "../../export/export-file";
import { joinList, type PlainMessageKey, translate } from "../../i18n/translator";
import { element } from "../dom";
import { icon } from "../icon";
import type { MotionItem } from "./motion-item";

/** File type offered for download. */
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
/** GLB file of several performers, all in their positions. The other types contain one performer each. */
const GLB_OF_ALL: FileType = { ...GLB, shortName: "all the puppets", description: "all the puppets and their dances" };

/** Callback for the chosen file type and the performers that the file shall contain. */
export type RequestDownload = (format: ExportFormat, performers: readonly number[]) => void;

export interface DownloadMenu {
  readonly button: HTMLElement;
  readonly choices: HTMLElement;
  /** Show the choices and focus the first one. */
  open(): void;
}

/** Create the menu. `onToggle` is called when it opens or closes; Escape closes it. */
export function createDownloadMenu(
  { name, performers }: MotionItem,
  initiallyOpen: boolean,
  onToggle: (open: boolean) => void,
  onChoose: RequestDownload,
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
  const createChoice = ({ format, label, shortName, description }: FileType, chosen: readonly number[]) => {
    const text = [element("b", {}, label), element("small", {}, translate(shortName))];
    return element(
      "button",
      {
        type: "button",
        "aria-label": joinList([label, translate(description)]),
        onClick: () => onChoose(format, chosen),
      },
      ...text,
    );
  };
  const all = Array.from({ length: performers }, (_, performer) => performer);
  if (performers === 1) {
    choices.append(...[BVH, GLB, VRMA].map((type) => createChoice(type, all)));
  } else {
    const groups = all.map((performer) => {
      const name = translate("Dancer {number}", { number: performer + 1 });
      const buttons = [BVH, VRMA].map((type) => createChoice(type, [performer]));
      return element(
        "div",
        { role: "group", "aria-label": name },
        element("span", { "aria-hidden": "true" }, name),
        ...buttons,
      );
    });
    choices.append(createChoice(GLB_OF_ALL, all), ...groups);
  }
  let open = initiallyOpen;
  const render = () => {
    choices.hidden = !open;
    button.setAttribute("aria-expanded", String(open));
  };
  const setOpen = (value: boolean) => {
    open = value;
    render();
    onToggle(value);
  };
  const closeOnEscape = (event: KeyboardEvent) => {
    if (event.key !== "Escape" || !open) return;
    // The library panel must stay open.
    event.stopPropagation();
    setOpen(false);
    button.focus();
  };
  button.addEventListener("click", () => setOpen(!open));
  button.addEventListener("keydown", closeOnEscape);
  choices.addEventListener("keydown", closeOnEscape);
  render();
  return {
    button,
    choices,
    open() {
      setOpen(true);
      choices.querySelector("button")?.focus();
    },
  };
}
