/** Name tags of limb holders on the stage, each with an "Ask" button, and the invitation beside a hand. */
import { pageTranslator, type Translator } from "../../i18n/translator";
import { LIMBS } from "../../motion/skeleton";
import type { ScreenBox } from "../../stage/camera/screen-box";
import { CROWD, MAX_LIMBS } from "../../wire/limbs";
import { element, setAttribute, setText } from "../dom";
import { initialOf } from "../format";
import { holderColour } from "../limb-display";
import { type LimbHolder, type LimbState, limbName } from "../limb-state";
import type { LabelMetrics, LabelPosition, LabelPositions } from "./label-layout";
import type { Size } from "./tag-layout";

export interface NameTags {
  /** Write the tags of the limbs' holders. A new tag is shown once it has a position. */
  setLimbs(limbs: readonly LimbState[]): void;
  /** Set the boxes of other elements that cover the picture, in CSS pixels. */
  setObstacles(obstacles: readonly ScreenBox[]): void;
  /** Show the invitation once it has a position, and then call `onShown`. */
  invite(onShown: () => void): void;
  /** Hide the invitation. */
  endInvitation(): void;
  /** Move the labels to the positions that a `LabelLayout` has found for their metrics. */
  place(positions: LabelPositions): void;
}

/** Upper limit of tags on the page: the middle of the header. */
const TOP_MARGIN_PX = 32;
/** Forms of a tag from the longest to the shortest: name, limb and "Ask"; the name alone; its initial. */
const TAG_FORMS = ["whole", "name", "initial"] as const;

export interface NameTagOptions {
  /** Upper limit of tags, in CSS pixels. */
  top?: number;
  translator?: Translator;
}

/**
 * Create the layer of labels over the whole picture. `onRequest` is called for a press on "Ask", `onMeasure` whenever
 * the metrics of the labels have changed. Tags are hidden from assistive technology: the strings panel offers the same.
 */
export function createNameTags(
  root: ParentNode & Node,
  onRequest: (limb: number) => void,
  onMeasure: (metrics: LabelMetrics) => void,
  { top = TOP_MARGIN_PX, translator = pageTranslator }: NameTagOptions = {},
): NameTags {
  const layer = element("div", { class: "tags", "aria-hidden": "true" });
  root.append(layer);
  const tags = Array.from({ length: MAX_LIMBS }, (_, limb) => new NameTag(layer, limb, onRequest, translator));
  const invitation = element("div", { class: "tag invitation", hidden: true }, translator.translate("Take a hand"));
  layer.append(invitation);
  let viewport = { width: 0, height: 0, top };
  let obstacles: readonly ScreenBox[] = [];
  let invitationSize: Size | null = null;
  let invitationPosition: LabelPosition | null = null;
  let onInvitationShown: (() => void) | null = null;
  const publish = () =>
    onMeasure({ tags: tags.map(({ sizes }) => sizes), invitation: invitationSize, viewport, obstacles });
  const measureInvitation = (isInvited: boolean) => {
    invitation.hidden = !isInvited;
    invitationSize = isInvited ? sizeOf(invitation) : null;
    moveTo(invitation, invitationSize && invitationPosition);
  };
  // Observed instead of measured, since measuring would force a layout. Zero while a sheet hides the layer.
  new ResizeObserver(([{ contentRect }]) => {
    if (contentRect.width === 0) return;
    viewport = { width: contentRect.width, height: contentRect.height, top };
    // Another size may use other fonts.
    measureTags(tags);
    measureInvitation(invitationSize !== null);
    publish();
  }).observe(layer);
  return {
    setLimbs(limbs) {
      setAttribute(layer, "data-several", limbs.length > LIMBS.length);
      const changed = tags.filter((tag) => tag.write(limbs[tag.limb] ?? null, limbs.length));
      if (changed.length === 0) return;
      measureTags(changed);
      publish();
    },
    setObstacles(boxes) {
      obstacles = boxes;
      publish();
    },
    invite(onShown) {
      onInvitationShown = onShown;
      measureInvitation(true);
      publish();
    },
    endInvitation() {
      onInvitationShown = null;
      measureInvitation(false);
      publish();
    },
    place(positions) {
      for (const tag of tags) tag.place(positions.tags[tag.limb] ?? null);
      invitationPosition = positions.invitation;
      moveTo(invitation, invitationSize && invitationPosition);
      if (!invitationSize || !invitationPosition) return;
      onInvitationShown?.();
      onInvitationShown = null;
    },
  };
}

/** Tag of one limb. */
class NameTag {
  /** Sizes of its forms; null without a holder. */
  sizes: readonly Size[] | null = null;
  readonly #root: HTMLElement;
  readonly #name = element("b", { dir: "auto" });
  readonly #letter = element("i");
  readonly #limbText = element("span");
  readonly #askButton: HTMLElement;
  #holder: LimbHolder | null = null;
  #position: LabelPosition | null = null;
  #content = "";

  constructor(
    layer: HTMLElement,
    readonly limb: number,
    onRequest: (limb: number) => void,
    private readonly translator: Translator,
  ) {
    this.#askButton = element(
      "button",
      { class: "tag-ask", type: "button", tabindex: -1, hidden: true, onClick: () => onRequest(limb) },
      translator.translate("Ask"),
    );
    this.#root = element("div", { class: "tag", hidden: true });
    this.#root.append(this.#letter, this.#name, this.#limbText, this.#askButton);
    layer.append(this.#root);
  }

  /** Write the tag of the limb, one of `limbCount`. Return true if it must be measured again. */
  write(state: LimbState | null, limbCount: number): boolean {
    const { holder = null, requestedByMe = false } = state ?? {};
    const content = holder && [limbCount, holder.name, holder.colour, requestedByMe, holder.mine].join("\n");
    if ((content ?? "") === this.#content) return false;
    this.#content = content ?? "";
    this.#holder = holder;
    if (!holder) return true;
    setText(this.#name, holder.name);
    setText(this.#letter, initialOf(holder.name));
    // The performer is not named: the string shows it.
    const { translate } = this.translator;
    setText(this.#limbText, requestedByMe ? translate("asked") : limbName(this.limb, 1, this.translator));
    this.#askButton.hidden = holder.mine || requestedByMe || holder.id === CROWD;
    this.#root.style.setProperty("--colour", holderColour(holder));
    return true;
  }

  /** Show the tag in a form, so that it can be measured. */
  writeForm(form: number): void {
    this.#root.hidden = this.#holder === null;
    this.#root.dataset.written = TAG_FORMS[form];
  }

  get size(): Size {
    return sizeOf(this.#root);
  }

  /** Move the tag; null hides it. */
  place(position: LabelPosition | null): void {
    this.#position = position;
    this.show();
  }

  /** Show the tag at its position. */
  show(): void {
    const position = this.#holder && this.#position;
    const form = position && TAG_FORMS[position.form];
    if (form && this.#root.dataset.written !== form) this.#root.dataset.written = form;
    moveTo(this.#root, position);
  }
}

/** Measure all forms of these tags. This forces one layout per form. */
function measureTags(tags: readonly NameTag[]): void {
  const sizes = TAG_FORMS.map((_, form) => {
    for (const tag of tags) tag.writeForm(form);
    return tags.map(({ size }) => size);
  });
  tags.forEach((tag, i) => {
    // Without a holder, or while the layer is hidden, all sizes are zero.
    tag.sizes = sizes[0][i].width > 0 ? sizes.map((ofForm) => ofForm[i]) : null;
    tag.show();
  });
}

function sizeOf({ offsetWidth: width, offsetHeight: height }: HTMLElement): Size {
  return { width, height };
}

/** Show a label at a position; null hides it. Unchanged values are not written: that would cost a style calculation. */
function moveTo(label: HTMLElement, position: LabelPosition | null): void {
  if (label.hidden !== !position) label.hidden = !position;
  if (!position) return;
  const transform = `translate(${position.left}px, ${position.top}px)`;
  if (label.style.transform !== transform) label.style.transform = transform;
}
