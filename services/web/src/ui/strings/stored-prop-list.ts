/** Props that the server stores: each is added to the stage by a button, new ones are made of files. */
import type { StoredProp } from "../../client/stored-props";
import { formatPercent } from "../../i18n/number-format";
import { pageTranslator } from "../../i18n/translator";
import { element, setAttribute, setText } from "../dom";
import { icon } from "../icon";

/** Stored props as the page knows them. */
export interface StoredProps {
  /** The newest, in this order. */
  readonly items: readonly StoredProp[];
  /** True if this page may upload and delete props. */
  readonly canChange: boolean;
  /** Share of the current upload that is sent, 0..1; null if there is none. */
  readonly uploadShare: number | null;
  /** Called after each change of the other members. */
  onChange: () => void;
  /** Fetch the list again. */
  refresh(): Promise<void>;
  /** Return the name of a stored prop by its kind; null if it is not known, or not yet. */
  nameOf(kind: string): string | null;
  /** Store files, one after the other, and bring each on the stage. */
  upload(files: readonly File[]): Promise<void>;
  /** Delete a prop from the server if the user confirms it. */
  remove(prop: StoredProp): Promise<void>;
}

export interface StoredPropList {
  readonly element: HTMLElement;
  /** Show the list. Unless `ready`, nothing can be changed; unless `hasRoom`, nothing can be added. */
  render(ready: boolean, hasRoom: boolean): void;
}

/** Button of a prop, with the one that deletes it. */
interface Chip {
  readonly element: HTMLElement;
  readonly add: HTMLButtonElement;
  readonly bin: HTMLButtonElement | null;
}

const ACCEPTED_FILE_TYPES = ".glb,.gltf";

/** Create the list. `add` brings a prop of a kind on the stage. */
export function createStoredPropList(
  stored: StoredProps,
  add: (kind: string) => void,
  { translate } = pageTranslator,
): StoredPropList {
  const chips = new Map<string, Chip>();
  const list = element("ul", { class: "prop-adders", "aria-label": translate("Stored props") });
  const picker = element("input", { type: "file", accept: ACCEPTED_FILE_TYPES, multiple: true, hidden: true });
  picker.addEventListener("change", () => {
    void stored.upload([...(picker.files ?? [])]);
    picker.value = ""; // so that choosing the same file again is a change
  });
  const label = element("span", {});
  const upload = element(
    "button",
    { class: "prop-add prop-upload", type: "button", onClick: () => picker.click() },
    icon("upload"),
    label,
  );
  const createChip = (prop: StoredProp): Chip => {
    const title = translate("Delete from the server: {prop}", { prop: prop.name });
    const button = element(
      "button",
      {
        class: "prop-add",
        type: "button",
        title: prop.name,
        "aria-label": translate("Add: {prop}", { prop: prop.name }),
        onClick: () => add(prop.id),
      },
      icon("add"),
      element("span", { dir: "auto" }, prop.name),
    );
    const bin = stored.canChange
      ? element(
          "button",
          {
            class: "round-button",
            type: "button",
            title,
            "aria-label": title,
            onClick: () => void stored.remove(prop),
          },
          icon("bin"),
        )
      : null;
    return { element: element("li", {}, button, ...(bin ? [bin] : [])), add: button, bin };
  };
  /** Remove the chips of other props than these. The focus goes to the next chip, or to the button for files. */
  const removeChips = (kept: readonly StoredProp[]) => {
    for (const [id, { element: chip }] of [...chips]) {
      if (kept.some((prop) => prop.id === id)) continue;
      const hadFocus = chip.contains(document.activeElement);
      const neighbour = chip.nextElementSibling ?? chip.previousElementSibling;
      chip.remove();
      chips.delete(id);
      if (hadFocus) (neighbour?.querySelector<HTMLElement>(".round-button") ?? upload).focus();
    }
  };
  return {
    element: element("div", { class: "stored-props" }, ...(stored.canChange ? [upload, picker] : []), list),
    render(ready, hasRoom) {
      removeChips(stored.items);
      for (const prop of stored.items) {
        const chip = chips.get(prop.id) ?? createChip(prop);
        chips.set(prop.id, chip);
        chip.add.disabled = !ready || !hasRoom;
        if (chip.bin) chip.bin.disabled = !ready;
      }
      const order = stored.items.flatMap(({ id }) => chips.get(id)?.element ?? []);
      // Elements that are moved lose the focus.
      if (order.some((chip, at) => list.children[at] !== chip)) list.append(...order);
      list.hidden = order.length === 0;
      const { uploadShare } = stored;
      setAttribute(upload, "aria-busy", uploadShare === null ? null : "true");
      setText(
        label,
        uploadShare === null
          ? translate("From a file…")
          : translate("Uploading, {percent}", { percent: formatPercent(Math.floor(uploadShare * 100) / 100) }),
      );
      upload.disabled = !ready || !hasRoom;
    },
  };
}
