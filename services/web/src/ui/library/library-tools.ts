/** Parts of the library that load when it is first opened: search, pictures, editors of motions. */
import type { MotionQuery } from "../../client/api";
import { translate } from "../../i18n/translator";
import { element, setAttribute } from "../dom";
import { icon } from "../icon";
import { createLibrarySearch } from "./library-search";
import { createMotionEditor, type EditActions } from "./motion-editor";
import type { MotionItem } from "./motion-item";
import { MotionPictures } from "./motion-picture";

/** A device with a mouse. */
const HOVER = matchMedia("(hover: hover)");

/** What the library shows: the tags of all its motions, and whether only those of a search are listed. */
export interface LibraryFilter {
  readonly tags: readonly string[];
  readonly isFiltered: boolean;
}

export interface LibraryTools {
  readonly search: HTMLElement;
  /** Show the tags, and the number of found motions. */
  render(count: number, filter: LibraryFilter): void;
  /** Add picture and editor to the list entry of a motion. */
  extend(row: MotionRow, motion: MotionItem): void;
}

/** List entry of a motion, and the parts of it that are extended. */
export interface MotionRow {
  readonly item: HTMLElement;
  readonly glyph: HTMLElement;
  readonly tools: HTMLElement;
}

/** Actions of the tools. Without `edits`, motions cannot be edited. */
export interface ToolActions {
  search(query: MotionQuery): void;
  close(): void;
  readonly edits?: EditActions | undefined;
}

export function createLibraryTools({ search: onSearch, close, edits }: ToolActions): LibraryTools {
  const search = createLibrarySearch(onSearch, close);
  const pictures = new MotionPictures();
  /** Open editors by motion. They stay as they are when the list is rendered again. */
  const editors = new Map<string, HTMLElement>();

  const addEditor = ({ item, tools }: MotionRow, motion: MotionItem, actions: EditActions) => {
    const { id, name } = motion;
    const label = translate("Edit {name}", { name });
    const button = element(
      "button",
      { class: "round-button motion-edit", type: "button", "aria-label": label, title: label },
      icon("edit"),
    );
    const setOpen = (open: boolean) => {
      editors.get(id)?.remove();
      editors.delete(id);
      if (open) {
        const editor = createMotionEditor(motion, actions, () => {
          setOpen(false);
          button.focus();
        });
        editors.set(id, editor);
        item.append(editor);
        item.scrollIntoView({ block: "start" });
        // On a phone, the focus would open the keyboard over the editor.
        if (HOVER.matches) editor.querySelector("input")?.focus({ preventScroll: true });
      }
      setAttribute(button, "aria-expanded", String(open));
    };
    button.addEventListener("click", () => setOpen(!editors.has(id)));
    setAttribute(button, "aria-expanded", String(editors.has(id)));
    tools.prepend(button);
    const open = editors.get(id);
    if (open) item.append(open);
  };

  return {
    search: search.element,
    render(count, { tags, isFiltered }) {
      search.render(tags, isFiltered ? count : null);
      search.element.hidden = count === 0 && !isFiltered;
    },
    extend(row, motion) {
      pictures.show(row.glyph, motion.id);
      if (edits) addEditor(row, motion, edits);
    },
  };
}
