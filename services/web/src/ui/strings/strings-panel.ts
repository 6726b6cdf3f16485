/** Strings panel: one row per limb with its holder, and the dock of four round buttons that replaces a closed panel. */
import { translate, translateToParts } from "../../i18n/translator";
import type { DigitalInput } from "../../input/digital-input";
import { isHand, limbNumber } from "../../wire/limbs";
import type { PropPresence } from "../../wire/messages";
import type { CrowdActions, CrowdControls } from "../crowd/crowd-controls";
import { element, setAttribute, setText } from "../dom";
import { limbIcon } from "../icon";
import { holderColour, isPulledHere, limbButtonName, openCrowd } from "../limb-display";
import {
  LIMB_NAMES,
  LIMB_ORDER,
  type LimbHolder,
  type LimbState,
  limbKey,
  limbName,
  performerCount,
} from "../limb-state";
import { createPanel, type Panel } from "../panel";
import type { DirectionPad } from "./direction-pad";
import { createNextPerformerButton, createPerformerChooser } from "./performer-chooser";
import type { PropActions, PropSection } from "./prop-section";

const NOTICE_DURATION_MS = 5_000;

export interface StringsPanel {
  readonly panel: Panel;
  /** Show the limbs of the `selected` performer, of all performers' limbs. Unless `ready`, no limb can be claimed. */
  render(limbs: readonly LimbState[], ready: boolean, selected?: number): void;
  /** Show the props of the session. */
  renderProps(props: readonly PropPresence[]): void;
  readonly dock: HTMLElement;
  /** Show a short message about an input that was not applied as sent. */
  notice(text: string): void;
  /** Load what is not needed until the panel opens. */
  load(): void;
}

export interface StringsActions {
  toggle(limb: number): void;
  ask(limb: number): void;
  withdraw(limb: number): void;
  give(limb: number): void;
  /** Join two held hands, or part joined ones. */
  join(): void;
  select(limb: number): void;
  focus(limb: number | null): void;
  /** Select a performer. */
  dancer(performer: number): void;
  nextDancer(): void;
  /** Report that a button for an input went down or came up. */
  press(input: DigitalInput, down: boolean): void;
  /**
   * Control the hands by camera, or stop it. `onChange` is told whether the camera is on. Rejects if it is not loaded.
   */
  useCamera(onChange: (isOn: boolean) => void): Promise<void>;
  /** Omitted if this page may not change the session. */
  props?: PropActions;
  /** Actions of the controls of the audience. Omitted if this page may not open limbs. */
  crowd?: CrowdActions;
}

/** Action of a limb's button. */
type LimbAction = "toggle" | "ask" | "withdraw" | "give";

/** Create panel and dock in `root`. */
export function createStringsPanel(
  root: HTMLElement,
  actions: StringsActions & { close(): void; keys(): void },
): StringsPanel {
  const panel = createPanel(root, "strings", translate("Strings"), actions.close);
  /** Selected performer, and the number of performers. */
  let [performer, performers] = [0, 1];
  const limbOf = (part: number) => limbNumber(performer, part);
  const focusEvents = (part: number) => ({
    onFocus: () => actions.focus(limbOf(part)),
    onBlur: () => actions.focus(null),
    onPointerenter: () => actions.focus(limbOf(part)),
    onPointerleave: () => actions.focus(null),
  });
  const rows = LIMB_ORDER.map((limb) => {
    const state = element("small");
    const glyph = element(
      "button",
      { class: "limb-glyph", type: "button", disabled: true, onClick: () => actions.select(limbOf(limb)) },
      limbIcon(limb),
    );
    let action: LimbAction = "toggle";
    const button = element("button", {
      class: "limb-action",
      type: "button",
      onClick: () => actions[action](limbOf(limb)),
      ...focusEvents(limb),
    });
    let pad: DirectionPad | null = null;
    let isMoved = false;
    const row = element(
      "li",
      {},
      glyph,
      element("span", {}, element("b", {}, translate(LIMB_NAMES[limb])), state),
      button,
    );
    const setPad = (created: DirectionPad) => {
      pad = created;
      row.append(pad.element);
      pad.setVisible(isMoved);
    };
    const render = (limbState: LimbState, ready: boolean) => {
      const { holder, selected } = limbState;
      const crowd = openCrowd(limbState);
      const mine = isPulledHere(limbState);
      setAttribute(row, "style", holderStyle(holder));
      const name = { limb: limbName(limbOf(limb), performers) };
      setText(state, limbStatus(limbState));
      if (!holder || crowd)
        state.append(element("span", { class: "key-hint" }, translate(", key {key}", { key: limbKey(limb) })));
      action = limbAction(limbState);
      const label = crowd
        ? mine
          ? "Let go"
          : "Pull"
        : action === "toggle"
          ? holder
            ? "Release"
            : "Take"
          : ({ give: "Give", ask: "Ask", withdraw: "Withdraw" } as const)[action];
      setText(button, translate(label));
      button.setAttribute("aria-label", translate(ACTION_LABELS[label], name));
      glyph.setAttribute("aria-label", translate("Move the {limb}", name));
      button.disabled = !ready;
      setAttribute(button, "data-mine", mine);
      glyph.disabled = !mine || !ready;
      setAttribute(glyph, "aria-pressed", mine ? String(selected) : null);
      // Also while disconnected: the limb is claimed again on reconnection, and a button that is held keeps working.
      isMoved = mine && selected;
      pad?.setVisible(isMoved);
    };
    return { limb, row, render, setPad };
  });
  const discs = LIMB_ORDER.map((limb) => {
    const name = element("span", { hidden: true, dir: "auto" });
    const disc = element(
      "button",
      { type: "button", onClick: () => actions.toggle(limbOf(limb)), ...focusEvents(limb) },
      limbIcon(limb),
      name,
    );
    return { limb, disc, name };
  });
  const hint = element(
    "p",
    { class: "strings-hint" },
    ...translateToParts("Drag a ring on the stage, or press {first} to {last}.", {
      first: element("kbd", {}, "1"),
      last: element("kbd", {}, "4"),
    }),
  );
  const notice = element("p", { class: "strings-notice", role: "status", "aria-live": "polite" });
  // A phone's header has no room for this button.
  const keys = element(
    "button",
    { class: "text-button", type: "button", onClick: actions.keys },
    translate("Touch, gamepad and keys"),
  );
  const join = element(
    "button",
    { class: "text-button join-hands", type: "button", hidden: true, onClick: actions.join },
    translate("Join hands"),
  );
  let loading: Promise<unknown> | null = null;
  /** Null while it is not loaded, and if this page may not change the session. */
  let propSection: PropSection | null = null;
  let props: readonly PropPresence[] = [];
  let isReady = false;
  const renderProps = () => propSection?.render(props, performers, isReady);
  let crowdControls: CrowdControls | null = null;
  let renderControls = () => {};
  const chooser = createPerformerChooser(actions.dancer);
  const next = createNextPerformerButton(actions.nextDancer);
  panel.body.append(
    chooser.element,
    element("ul", { class: "limbs" }, ...rows.map(({ row }) => row)),
    hint,
    notice,
    join,
    keys,
  );
  const dock = element(
    "nav",
    { class: "dock", "aria-label": translate("Take a string") },
    next.element,
    ...discs.map(({ disc }) => disc),
  );
  root.append(dock);
  let noticeTimer: ReturnType<typeof setTimeout> | undefined;
  return {
    panel,
    dock,
    load() {
      loading ??= import("./strings-controls").then(
        ({ createCameraButton, createCrowdControls, createDirectionPad, createPropSection }) => {
          for (const { limb, setPad } of rows) setPad(createDirectionPad(limb, actions.press));
          keys.before(createCameraButton(actions.useCamera));
          if (actions.crowd) {
            crowdControls = createCrowdControls(actions.crowd);
            panel.body.append(crowdControls.element);
            renderControls();
          }
          if (!actions.props) return;
          propSection = createPropSection(actions.props);
          panel.body.append(propSection.element);
          renderProps();
        },
        () => (loading = null),
      );
    },
    notice(text) {
      clearTimeout(noticeTimer);
      setText(notice, text);
      hint.hidden = true;
      noticeTimer = setTimeout(() => {
        setText(notice, "");
        hint.hidden = false;
      }, NOTICE_DURATION_MS);
    },
    renderProps(shown) {
      props = shown;
      renderProps();
    },
    render(limbs, ready, selected = 0) {
      [performer, performers] = [selected, performerCount(limbs)];
      isReady = ready;
      renderProps();
      for (const part of [chooser, next]) part.render(limbs, selected);
      for (const { limb, render } of rows) render(limbs[limbOf(limb)], ready);
      renderControls = () => crowdControls?.render(limbs, ready, selected);
      renderControls();
      // Only with a hand of one's own, so that the sheet of a phone leaves room for the performer's feet.
      join.hidden = !ready || !limbs.some(({ holder }, limb) => holder?.mine && isHand(limb));
      for (const { limb, disc, name } of discs) {
        const state = limbs[limbOf(limb)];
        const { holder } = state;
        setAttribute(disc, "style", holderStyle(holder));
        setAttribute(disc, "data-mine", isPulledHere(state));
        disc.setAttribute("aria-label", limbButtonName(state, limbName(limbOf(limb), performers)));
        disc.disabled = !ready;
        name.hidden = !holder;
        setText(name, holder?.name ?? "");
      }
    },
  };
}

const ACTION_LABELS = {
  Take: "Take {limb}",
  Release: "Release {limb}",
  Give: "Give {limb}",
  Ask: "Ask for {limb}",
  Withdraw: "Withdraw the request for {limb}",
  Pull: "Pull {limb}",
  "Let go": "Let go of {limb}",
} as const;

function holderStyle(holder: LimbHolder | null): string | null {
  return holder ? `--colour: ${holderColour(holder)}` : null;
}

function limbAction(state: LimbState): LimbAction {
  const { holder, requesters, requestedByMe } = state;
  if (!holder || openCrowd(state)) return "toggle";
  if (holder.mine) return requesters.length > 0 ? "give" : "toggle";
  return requestedByMe ? "withdraw" : "ask";
}

function limbStatus(state: LimbState): string {
  const { holder, requesters, requestedByMe } = state;
  const crowd = openCrowd(state);
  if (crowd) return crowd.isPulled ? translate("You pull this") : translate("Open to all");
  if (!holder) return translate("Free");
  if (holder.mine)
    return requesters.length > 0
      ? translate("{name} asks for it", { name: requesters[0].name })
      : translate("You hold this");
  return translate(requestedByMe ? "You ask {name} for it" : "{name} holds this", { name: holder.name });
}
