/** Section of the strings panel with the props on the stage: adds and removes them, and puts them into hands. */
import { pageTranslator } from "../../i18n/translator";
import { isPropKind, PROP_KINDS, type PropKind } from "../../motion/props";
import { limbNumber, MAX_PROPS } from "../../wire/limbs";
import type { PropPresence } from "../../wire/messages";
import { element, setText } from "../dom";
import { icon } from "../icon";
import { LIMB_ORDER, limbName } from "../limb-state";

export interface PropActions {
  add(kind: PropKind): void;
  remove(prop: number): void;
  /** Put a prop into the hand of this number, or lay it down (null). Resolves when it is there or stays. */
  put(prop: number, limb: number | null): Promise<void>;
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
export function createPropSection(actions: PropActions, { translate } = pageTranslator): PropSection {
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
  section.addEventListener("toggle", () => section.open && section.scrollIntoView({ block: "nearest" }));
  const removeRow = (prop: number, row: PropRow) => {
    const hadFocus = row.element.contains(document.activeElement);
    row.element.remove();
    rows.delete(prop);
    if (hadFocus) section.querySelector<HTMLElement>("summary")?.focus();
  };
  return {
    element: section,
    render(props, performers, ready) {
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
        row.render(prop, propName(prop, sorted, translate), placeOptions(prop, props, performers, translate), ready);
      }
      const hasRoom = props.length < MAX_PROPS;
      for (const adder of adders) adder.disabled = !ready || !hasRoom;
      full.hidden = hasRoom;
    },
  };
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

/** Name a prop, with a number if there are others of its kind. */
function propName({ prop, kind }: PropPresence, props: readonly PropPresence[], translate: Translate): string {
  // A kind that this page does not know can be removed all the same.
  const name = isPropKind(kind) ? translate(KIND_NAMES[kind]) : kind;
  const same = props.filter((other) => other.kind === kind);
  return same.length > 1 ? `${name} ${same.findIndex((other) => other.prop === prop) + 1}` : name;
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
