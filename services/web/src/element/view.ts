/** Shadow tree of the element: canvas, notice, messages, name tags, and with controls a bar of buttons. */
import type { Translator } from "../i18n/translator";
import tokens from "../style/tokens.css?inline";
import { element, setAttribute } from "../ui/dom";
import { icon, limbIcon } from "../ui/icon";
import { capitalise, holderColour, isPulledHere, limbButtonName } from "../ui/limb-display";
import { LIMB_ORDER, type LimbState, limbKey, limbName, performerCount } from "../ui/limb-state";
import { createToast, type ToastController } from "../ui/notification/toast";
import { type LabelAnchors, LabelLayout } from "../ui/strings/label-layout";
import { createLimbRequests, type LimbRequests } from "../ui/strings/limb-request";
import { createNameTags } from "../ui/strings/name-tag";
import { createNextPerformerButton } from "../ui/strings/performer-chooser";
import { createSoundButton } from "../ui/transport/sound-control";
import { limbNumber } from "../wire/limbs";
import elementStyles from "./element.css?inline";

/** Upper limit of name tags. */
const TAG_TOP_MARGIN_PX = 8;

export interface ElementViewActions {
  play(): void;
  toggle(limb: number): void;
  focus(limb: number | null): void;
  ask(limb: number): void;
  give(limb: number): void;
  nextDancer(): void;
  sound(): void;
}

export interface ElementView {
  /** Container that receives key events: canvas, buttons and everything inside them. */
  readonly frame: HTMLElement;
  readonly canvas: HTMLCanvasElement;
  readonly limbRequests: LimbRequests;
  readonly toast: ToastController;
  readonly soundButton: HTMLElement;
  /** Show a notice instead of the motion; null hides it. */
  notice(title: string | null, text?: string): void;
  /** Show or hide the bar. `playing` is the state of the play button, null to hide that button. */
  setBar(shown: boolean, playing: boolean | null): void;
  /** Show whether the motion has sound, and whether it can be heard. */
  setSound(available: boolean, audible: boolean): void;
  /** Show the limbs of the `selected` performer. `canClaim` shows their buttons, `ready` enables them. */
  renderLimbs(limbs: readonly LimbState[], canClaim: boolean, ready: boolean, selected?: number): void;
  /** Place the name tags; `selected` is the performer whose tags are placed first, and `now` is in milliseconds. */
  placeNameTags(anchors: LabelAnchors, selected: number, now: number): void;
  remove(): void;
}

/** Selector of the light theme in the page's style sheet. Minification may remove the quotes. */
const LIGHT_THEME_SELECTOR = /:root\[data-theme=["']?day["']?\]/g;

let styleSheet: CSSStyleSheet | null = null;

/**
 * Return the style sheet that all elements share. Constructed style sheets are allowed under any content security
 * policy.
 */
function sharedStyleSheet(): CSSStyleSheet {
  if (!styleSheet) {
    styleSheet = new CSSStyleSheet();
    styleSheet.replaceSync(
      tokens.replace(LIGHT_THEME_SELECTOR, ':host([data-shown="day"])').replaceAll(":root", ":host") + elementStyles,
    );
  }
  return styleSheet;
}

/** Create the element's content in `root`, with texts from `translator`. */
export function createElementView(root: ShadowRoot, actions: ElementViewActions, translator: Translator): ElementView {
  const { translate } = translator;
  root.adoptedStyleSheets = [sharedStyleSheet()];
  const canvas = element("canvas", {
    role: "img",
    "aria-label": translate("A wooden puppet dancing on a stage before a disc of gold leaf"),
  });
  const frame = element("div", { class: "frame", part: "frame", lang: translator.language, tabindex: -1 }, canvas);
  root.append(frame);
  const labels = new LabelLayout();
  const nameTags = createNameTags(frame, actions.ask, (metrics) => (labels.metrics = metrics), {
    top: TAG_TOP_MARGIN_PX,
    translator,
  });
  const notice = element("div", { class: "notice", part: "notice", role: "status", hidden: true });
  const messages = element("div", { class: "messages" });
  frame.append(notice, messages);
  const limbRequests = createLimbRequests(messages, actions.give, translator);
  const toast = createToast(messages);
  const play = element(
    "button",
    { class: "play", type: "button", "aria-label": translate("Play"), onClick: actions.play },
    icon("play"),
  );
  const sound = createSoundButton(actions.sound, translator);
  sound.element.hidden = true;
  /** Performer whose limbs the buttons claim. */
  let performer = 0;
  const discs = LIMB_ORDER.map((limb) => {
    const focus = () => actions.focus(limbNumber(performer, limb));
    const focusEvents = {
      onFocus: focus,
      onBlur: () => actions.focus(null),
      onPointerenter: focus,
      onPointerleave: () => actions.focus(null),
    };
    return {
      limb,
      disc: element(
        "button",
        { type: "button", hidden: true, onClick: () => actions.toggle(limbNumber(performer, limb)), ...focusEvents },
        limbIcon(limb),
      ),
    };
  });
  const next = createNextPerformerButton(actions.nextDancer, translator);
  const buttons = [play, sound.element, next.element, ...discs.map(({ disc }) => disc)];
  const bar = element(
    "div",
    { class: "bar", part: "bar", role: "group", "aria-label": translate("The stage"), hidden: true },
    ...buttons,
  );
  frame.append(bar);
  const updateCount = () => bar.style.setProperty("--count", String(buttons.filter((button) => !button.hidden).length));
  let shownPlaying: boolean | null = false;
  return {
    frame,
    canvas,
    limbRequests,
    toast,
    soundButton: sound.element,
    notice(title, text = "") {
      notice.hidden = title === null;
      if (title !== null) notice.replaceChildren(element("b", {}, title), text);
    },
    setBar(shown, playing) {
      bar.hidden = !shown;
      play.hidden = playing === null;
      updateCount();
      if (playing === shownPlaying || playing === null) return;
      shownPlaying = playing;
      play.replaceChildren(icon(playing ? "pause" : "play"));
      play.setAttribute("aria-label", translate(playing ? "Pause" : "Play"));
    },
    setSound(available, audible) {
      sound.element.hidden = !available;
      sound.render(audible);
      updateCount();
    },
    renderLimbs(limbs, canClaim, ready, selected = 0) {
      performer = selected;
      nameTags.setLimbs(limbs);
      next.render(canClaim ? limbs : [], selected);
      for (const { limb, disc } of discs) {
        const number = limbNumber(selected, limb);
        const { holder } = limbs[number];
        const name = limbName(number, performerCount(limbs), translator);
        disc.hidden = !canClaim;
        disc.disabled = !ready;
        setAttribute(disc, "data-mine", isPulledHere(limbs[number]));
        disc.setAttribute("aria-label", limbButtonName(limbs[number], name, translator));
        disc.title = capitalise(name) + translate(", key {key}", { key: limbKey(limb) });
        if (holder) disc.style.setProperty("--colour", holderColour(holder));
        else disc.style.removeProperty("--colour");
      }
      updateCount();
    },
    placeNameTags: (...anchors) => nameTags.place(labels.update(...anchors)),
    remove() {
      frame.remove();
    },
  };
}
