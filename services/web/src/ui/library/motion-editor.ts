/** Editor of a motion: its name and tags, and a new motion that is a part of it, its mirror image or a loop. */
import type { MotionEdit, MotionLabels } from "../../client/motion-library";
import { translate } from "../../i18n/translator";
import { element } from "../dom";
import { createCutFields } from "./cut-fields";
import type { MotionItem } from "./motion-item";
import { createTagField } from "./tag-field";

/** Maximum number of characters of a name. */
const MAX_NAME_LENGTH = 200;

export interface EditActions {
  /** Change the name or tags of a motion. Resolves to false if it failed, and was reported. */
  label(motion: MotionItem, labels: MotionLabels): Promise<boolean>;
  /** Create an edited copy. */
  edit(motion: MotionItem, edit: MotionEdit): Promise<void>;
  /** Return the position of the stage in the motion, in seconds; null if the stage shows another one. */
  position(motion: MotionItem): number | null;
}

/** Create the editor. `onClose` is called when Escape is pressed in it. */
export function createMotionEditor(motion: MotionItem, actions: EditActions, onClose: () => void): HTMLElement {
  const { name } = motion;
  const nameField = element("input", {
    class: "text-field",
    type: "text",
    value: name,
    maxlength: MAX_NAME_LENGTH,
    dir: "auto",
    autocomplete: "off",
    spellcheck: "false",
  });
  let savedName = name;
  const saveName = () => {
    const [previous, changed] = [savedName, nameField.value.trim()];
    nameField.value = changed || previous;
    if (changed === "" || changed === previous) return;
    savedName = changed;
    void actions.label(motion, { name: changed }).then((isSaved) => {
      if (!isSaved) nameField.value = savedName = previous;
    });
  };
  nameField.addEventListener("change", saveName);
  const tagField = createTagField(motion.tags, (tags) => actions.label(motion, { tags }));
  const cut = createCutFields(motion.seconds, () => actions.position(motion));
  const make = element(
    "button",
    { class: "make-button", type: "button", disabled: true },
    translate("Make a new dance"),
  );
  make.addEventListener("click", () => {
    const { edit } = cut;
    if (!edit) return;
    make.disabled = true;
    void actions.edit(motion, edit).finally(() => (make.disabled = cut.edit === null));
  });
  cut.element.addEventListener("input", () => (make.disabled = cut.edit === null));
  cut.element.append(make);
  const editor = element(
    "div",
    { class: "motion-editor", role: "group", "aria-label": translate("Edit {name}", { name }) },
    element("label", { class: "field" }, element("span", {}, translate("Name")), nameField),
    tagField,
    cut.element,
  );
  editor.addEventListener("keydown", (event) => {
    if (event.key === "Enter" && event.target === nameField) saveName();
    if (event.key !== "Escape") return;
    // The library panel must stay open.
    event.stopPropagation();
    onClose();
  });
  return editor;
}
