/** Section of the strings panel with the props on the stage: adds and removes them, and puts them into hands. */
import { pageTranslator } from "../../i18n/translator";
import { isPropKind, PROP_KINDS, type PropKind } from "../../motion/props";
import { limbNumber, MAX_PROPS } from "../../wire/limbs";
import type { PropPresence } from "../../wire/messages";
import { element, setText } from "../dom";
import { icon } from "../icon";
import { LIMB_ORDER, limbName } from "../limb-state";
import { createStoredPropList, type StoredPropList, type StoredProps } from "./stored-prop-list";

export interface PropActions {
  /** Add a prop: of a built-in kind, or of a stored one by its id. */
  add(kind: string): void;
  remove(prop: number): void;
  /** Put a prop into the hand of this number, or lay it down (null). Resolves when it is there or stays. */
  put(prop: number, limb: number | null): Promise<void>;
  /** Load the stored props. Rejects if their code cannot be loaded. */
  stored(): Promise<StoredProps>;
}

export interface PropSection {
  readonly element: HTMLElement;
  /** Show the props on a stage of so many performers. Unless `ready`, nothing can be changed. */
  render(props: readonly PropPresence[], performers: number, ready: boolean): void;
}

/** Names of the kinds; translate them before display. */
const KIND_NAMES = { fan: "Fan", umbrella: "Umbrella", ball: "Ball", branch: "Plum branch" } as const satisfies Record<
  PropKind,
  string
>;
/** Value of the option for the floor; those of hands are their numbers. */
const FLOOR = "floor";

/** Row of one prop. */
interface PropRow {
  readonly element: HTMLElement;
  render(prop: PropPresence, name: string, options: readonly PlaceOption[], ready: boolean): void;
}

interface PlaceOption {
  readonly value: string;
  readonly name: string;
  readonly isTaken: boolean;
}

/** Create the section, closed at first. */
export function createPropSection(actions: PropActions, translator = pageTranslator): PropSection {
  const { translate } = translator;
  const rows = new Map<number, PropRow>();
  const list = element("ul", { class: "prop-list" });
  const count = element("span", { class: "muted" });
  const adders = PROP_KINDS.map((kind) => {
    const name = translate(KIND_NAMES[kind]);
    const label = translate("Add: {prop}", { prop: name });
    const attributes = { class: "prop-add", type: "button", "aria-label": label, onClick: () => actions.add(kind) };
    return element("button", attributes, icon("add"), name);
  });
  const full = element(
    "p",
    { class: "strings-hint", hidden: true },
    translate("There is room for {count} props", { count: MAX_PROPS }),
  );
  const section = element(
    "details",
    { class: "props strings-section" },
    element("summary", {}, translate("Props"), count),
    list,
    element("div", { class: "prop-adders", role: "group", "aria-label": translate("Add a prop") }, ...adders),
    full,
  );
  /** Null until the section is opened. */
  let stored: StoredProps | null = null;
  let storedList: StoredPropList | null = null;
  let renderAgain = () => {};
  const showStored = async (loaded: StoredProps) => {
    if (stored !== loaded) {
      stored = loaded;
      storedList = createStoredPropList(loaded, actions.add, translator);
      full.before(storedList.element);
      loaded.onChange = () => renderAgain();
    }
    await loaded.refresh();
    showSection();
  };
  const showSection = () => section.open && section.scrollIntoView({ block: "nearest" });
  section.addEventListener("toggle", () => {
    if (!section.open) return;
    showSection();
    // If they cannot be loaded, the next opening tries again.
    actions.stored().then(showStored, () => undefined);
  });
  const removeRow = (prop: number, row: PropRow) => {
    const hadFocus = row.element.contains(document.activeElement);
    row.element.remove();
    rows.delete(prop);
    if (hadFocus) section.querySelector<HTMLElement>("summary")?.focus();
  };
  const render: PropSection["render"] = (props, performers, ready) => {
    renderAgain = () => render(props, performers, ready);
    const nameOf = ({ prop, kind }: PropPresence) =>
      isPropKind(kind)
        ? translate(KIND_NAMES[kind])
        : (stored?.nameOf(kind) ?? translate("Prop {number}", { number: prop + 1 }));
    setText(count, props.length > 0 ? String(props.length) : "");
    for (const [prop, row] of [...rows]) if (!props.some((one) => one.prop === prop)) removeRow(prop, row);
    const sorted = [...props].sort((a, b) => a.prop - b.prop);
    for (const prop of sorted) {
      let row = rows.get(prop.prop);
      if (!row) {
        row = createRow(prop.prop, actions, translate);
        rows.set(prop.prop, row);
        list.append(row.element);
      }
      row.render(prop, propName(prop, sorted, nameOf), placeOptions(prop, props, performers, translate), ready);
    }
    const hasRoom = props.length < MAX_PROPS;
    for (const adder of adders) adder.disabled = !ready || !hasRoom;
    storedList?.render(ready, hasRoom);
    full.hidden = hasRoom;
  };
  return { element: section, render };
}

type Translate = typeof pageTranslator.translate;

function createRow(prop: number, actions: PropActions, translate: Translate): PropRow {
  const label = element("span", { class: "prop-name" });
  const select = element("select", {});
  const remove = element(
    "button",
    { class: "round-button", type: "button", onClick: () => actions.remove(prop) },
    icon("bin"),
  );
  let shownOptions = "";
  let value = FLOOR;
  /** Number of requests that are not answered: until then the choice is shown. */
  let pending = 0;
  select.addEventListener("change", () => {
    pending++;
    void actions.put(prop, select.value === FLOOR ? null : Number(select.value)).finally(() => {
      if (--pending === 0) select.value = value;
    });
  });
  return {
    element: element("li", {}, label, select, remove),
    render({ limb }, name, options, ready) {
      setText(label, name);
      select.setAttribute("aria-label", translate("Where it is: {prop}", { prop: name }));
      const title = translate("Remove: {prop}", { prop: name });
      remove.setAttribute("aria-label", title);
      remove.title = title;
      const state = JSON.stringify(options);
      value = limb === null ? FLOOR : String(limb);
      const shown = pending > 0 ? select.value : value;
      // Other options would close the list while someone chooses.
      if (state !== shownOptions) {
        shownOptions = state;
        select.replaceChildren(
          ...options.map((one) => element("option", { value: one.value, disabled: one.isTaken }, one.name)),
        );
      }
      select.value = shown;
      select.disabled = remove.disabled = !ready;
    },
  };
}

/** Name a prop, with a number if there are others of its name. */
function propName(prop: PropPresence, props: readonly PropPresence[], nameOf: (prop: PropPresence) => string): string {
  const name = nameOf(prop);
  const same = props.filter((other) => nameOf(other) === name);
  return same.length > 1 ? `${name} ${same.indexOf(prop) + 1}` : name;
}

/** Return the places where a prop can be: the floor, and all hands in the order of their keys. */
function placeOptions(
  { prop }: PropPresence,
  props: readonly PropPresence[],
  performers: number,
  translate: Translate,
): PlaceOption[] {
  const hands = Array.from({ length: performers }, (_, performer) =>
    LIMB_ORDER.filter((part) => part < 2).map((part) => limbNumber(performer, part)),
  ).flat();
  const capitalise = (text: string) => text.charAt(0).toUpperCase() + text.slice(1);
  return [
    { value: FLOOR, name: translate("On the floor"), isTaken: false },
    ...hands.map((limb) => ({
      value: String(limb),
      name: capitalise(limbName(limb, performers)),
      isTaken: props.some((other) => other.prop !== prop && other.limb === limb),
    })),
  ];
}
