/** Search of the library: a field for words of the name, a button for each tag, and a message about the result. */
import type { MotionQuery } from "../../client/api";
import { translate } from "../../i18n/translator";
import { element, setText } from "../dom";

/** Pause in typing after which the library is searched. */
const SEARCH_DELAY_MS = 250;
/** Number of tags that get a button. */
const MAX_TAG_BUTTONS = 12;
/** Maximum number of characters that the server searches for. */
const MAX_SEARCH_LENGTH = 200;

export interface LibrarySearch {
  readonly element: HTMLElement;
  /** Show the tags of the library, and how many motions were found; null without a search. */
  render(tags: readonly string[], found: number | null): void;
}

/** Create the search. `onSearch` is called with each new query, `onClose` when Escape is pressed in the empty field. */
export function createLibrarySearch(onSearch: (query: MotionQuery) => void, onClose: () => void): LibrarySearch {
  let tag = "";
  let timer: ReturnType<typeof setTimeout> | undefined;
  const field = element("input", {
    class: "text-field",
    type: "search",
    "aria-label": translate("Search the library"),
    placeholder: translate("Search"),
    maxlength: MAX_SEARCH_LENGTH,
    autocomplete: "off",
    spellcheck: "false",
    enterkeyhint: "search",
  });
  const tagButtons = element("div", { class: "tag-buttons", role: "group", "aria-label": translate("Tags") });
  const status = element("p", { class: "search-status", role: "status" });
  const search = () => {
    clearTimeout(timer);
    onSearch({ search: field.value.trim(), tag });
  };
  field.addEventListener("input", () => {
    clearTimeout(timer);
    timer = setTimeout(search, field.value === "" ? 0 : SEARCH_DELAY_MS);
  });
  field.addEventListener("keydown", (event) => {
    if (event.key === "Enter") search();
    if (event.key !== "Escape") return;
    event.preventDefault();
    if (field.value === "") {
      onClose();
      return;
    }
    field.value = "";
    search();
  });
  const createTagButton = (name: string) =>
    element(
      "button",
      {
        class: "tag-button",
        type: "button",
        dir: "auto",
        "aria-pressed": String(name === tag),
        onClick: () => {
          tag = name === tag ? "" : name;
          renderPressed();
          search();
        },
      },
      name,
    );
  const renderPressed = () => {
    for (const button of tagButtons.children) button.setAttribute("aria-pressed", String(button.textContent === tag));
  };
  let shownTags: readonly string[] = [];
  return {
    element: element("search", { class: "library-search" }, field, tagButtons, status),
    render(tags, found) {
      const shown = tags.slice(0, MAX_TAG_BUTTONS);
      // The tag of the search stays, so that it can be taken back.
      if (tag && !shown.includes(tag)) shown.push(tag);
      if (shown.join("\n") !== shownTags.join("\n")) {
        shownTags = shown;
        tagButtons.replaceChildren(...shown.map(createTagButton));
      }
      tagButtons.hidden = shown.length === 0;
      setText(status, found === null ? "" : describeResult(found, field.value.trim()));
    },
  };
}

function describeResult(found: number, text: string): string {
  if (found > 0) return translate("{count} found", { count: found });
  return text ? translate('Nothing found for "{text}"', { text }) : translate("Nothing found");
}
