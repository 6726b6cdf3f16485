/** Display of limbs on the page: names of their buttons, colours of their holders. */
import { pageTranslator } from "../i18n/translator";
import { CROWD } from "../wire/limbs";
import type { LimbCrowd, LimbHolder, LimbState } from "./limb-state";

/** Return the audience of a limb that can be pulled with it now: a puppeteer who holds the limb keeps it. */
export function openCrowd({ holder, crowd }: LimbState): LimbCrowd | null {
  return crowd && (!holder || holder.id === CROWD) ? crowd : null;
}

/** Return whether this page holds a limb, or pulls it with the audience. */
export function isPulledHere(state: LimbState): boolean {
  return openCrowd(state)?.isPulled ?? state.holder?.mine ?? false;
}

/** Name a button that takes or releases a limb, or says who holds it. `name` is the limb's within a sentence. */
export function limbButtonName(state: LimbState, name: string, { translate } = pageTranslator): string {
  const { holder, requestedByMe } = state;
  if (openCrowd(state))
    return translate(isPulledHere(state) ? "Let go of the {limb}" : "Pull the {limb} with the audience", {
      limb: name,
    });
  if (!holder) return translate("Take the {limb}", { limb: name });
  if (holder.mine) return translate("Release the {limb}, held by you", { limb: name });
  return translate(requestedByMe ? "{limb}, held by {name}, asked for" : "{limb}, held by {name}", {
    limb: capitalise(name),
    name: holder.name,
  });
}

/** Return a text with a capital letter. */
export function capitalise(text: string): string {
  return text.charAt(0).toUpperCase() + text.slice(1);
}

/** Return the colour of a limb's holder, of the audience that of the text. */
export function holderColour({ id, colour }: LimbHolder): string {
  return `var(--${id === CROWD ? "text" : `holder-${colour}`})`;
}
