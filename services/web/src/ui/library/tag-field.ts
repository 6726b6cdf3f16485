/** Field for the tags of a motion: a button for each, which removes it, and an input that adds one. */
import { translate } from "../../i18n/translator";
import { element } from "../dom";
import { icon } from "../icon";

const MAX_TAGS = 16;
const MAX_TAG_LENGTH = 40;

/** Return `tags` with the words of an input, divided by commas: each once, whatever its case, and at most 16. */
export function addTags(tags: readonly string[], input: string): string[] {
  const result = [...tags];
  const isNew = (tag: string) => !result.some((other) => other.toLowerCase() === tag.toLowerCase());
  for (const part of input.split(/[,、，]/)) {
    const tag = part.trim().slice(0, MAX_TAG_LENGTH);
    if (tag && isNew(tag) && result.length < MAX_TAGS) result.push(tag);
  }
  return result;
}

/** Create the field. `onChange` saves the tags after each change; if it resolves to false, the change is taken back. */
export function createTagField(
  initial: readonly string[],
  onChange: (tags: readonly string[]) => Promise<boolean>,
): HTMLElement {
  let tags = initial;
  const list = element("div", { class: "tag-buttons" });
  const input = element("input", {
    class: "text-field",
    type: "text",
    "aria-label": translate("Add a tag"),
    placeholder: translate("Add a tag"),
    maxlength: MAX_TAG_LENGTH,
    autocomplete: "off",
    enterkeyhint: "done",
  });
  const change = (changed: readonly string[]) => {
    const previous = tags;
    if (changed.length === previous.length) return;
    tags = changed;
    render();
    void onChange(tags).then((isSaved) => {
      if (isSaved || tags !== changed) return;
      tags = previous;
      render();
    });
  };
  const render = () => {
    input.hidden = tags.length >= MAX_TAGS;
    list.hidden = tags.length === 0;
    list.replaceChildren(
      ...tags.map((tag) => {
        const remove = () => {
          change(tags.filter((other) => other !== tag));
          input.focus();
        };
        const label = translate("Remove the tag {tag}", { tag });
        return element(
          "button",
          { class: "tag-button", type: "button", "aria-label": label, title: label, onClick: remove },
          element("span", { dir: "auto" }, tag),
          icon("close"),
        );
      }),
    );
  };
  const add = () => {
    const text = input.value;
    input.value = "";
    change(addTags(tags, text));
  };
  input.addEventListener("change", add);
  input.addEventListener("keydown", (event) => {
    // Not while a word is being composed, as Japanese is.
    if (event.isComposing || (event.key !== "Enter" && event.key !== ",")) return;
    event.preventDefault();
    add();
  });
  render();
  return element(
    "div",
    { class: "field", role: "group", "aria-label": translate("Tags") },
    element("span", { "aria-hidden": "true" }, translate("Tags")),
    list,
    input,
  );
}
