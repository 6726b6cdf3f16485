/** Actions of the props section: changes of the session, and requests to the engine. */
import { editSession } from "../client/api";
import { ProblemError } from "../client/problem";
import type { PropRefusalReason } from "../engine/prop-request";
import { type PlainMessageKey, translate } from "../i18n/translator";
import type { PropKind } from "../motion/props";
import { limbHolders, limbName } from "../ui/limb-state";
import type { ShowToast } from "../ui/notification/toast";
import type { PropActions } from "../ui/strings/prop-section";
import { MAX_PROPS } from "../wire/limbs";
import type { RemotePlayback } from "./remote-playback";

export interface PropContext {
  readonly toast: ShowToast;
  readonly current: RemotePlayback | null;
  putProp(prop: number, limb: number | null): Promise<PropRefusalReason | null>;
  moveProp(): Promise<{ readonly limb: number | null; readonly refusal: PropRefusalReason | null }>;
}

/** Texts for refusals that do not depend on the hand. */
const REFUSAL_TEXTS: Partial<Record<PropRefusalReason, PlainMessageKey>> = {
  "none near": "Bring a hand that you hold near a prop",
  unknown: "This prop is no longer on the stage",
  "no answer": "Not connected. Try again when the connection is back",
};

/** Put the nearest prop into a held hand, or lay down the one that is in it. */
export async function moveNearestProp({ current, moveProp, toast }: PropContext): Promise<void> {
  if (!current) return;
  const { limb, refusal } = await moveProp().catch(() => ({ limb: null, refusal: "no answer" as const }));
  if (refusal) toast(describeRefusal(refusal, limb, current));
}

/** Return the actions; `context` is read at each of them. */
export function createPropActions(context: () => PropContext): PropActions {
  const edit = (props: Record<string, PropKind | null>) => {
    const { current, toast } = context();
    if (!current) return;
    editSession(current.id, { props }).catch((error: unknown) =>
      toast(error instanceof ProblemError ? translate("{title}: {detail}", error) : String(error)),
    );
  };
  return {
    add(kind) {
      const used = context().current?.presence?.props?.map(({ prop }) => prop) ?? [];
      const free = Array.from({ length: MAX_PROPS }, (_, prop) => prop).find((prop) => !used.includes(prop));
      if (free !== undefined) edit({ [free]: kind });
    },
    remove: (prop) => edit({ [prop]: null }),
    async put(prop, limb) {
      const { current, putProp, toast } = context();
      const refusal = await putProp(prop, limb).catch(() => "no answer" as const);
      if (refusal && current) toast(describeRefusal(refusal, limb, current));
    },
  };
}

function describeRefusal(
  refusal: PropRefusalReason,
  limb: number | null,
  { presence, performerCount, puppeteerId }: RemotePlayback,
): string {
  const text = REFUSAL_TEXTS[refusal];
  if (text) return translate(text);
  const name = limb === null ? "" : limbName(limb, performerCount);
  if (refusal === "full") return translate("The {limb} has another prop", { limb: name });
  const holder = limb === null ? null : limbHolders(presence, puppeteerId, performerCount)[limb];
  if (holder && !holder.mine) return translate("{name} holds the {limb}", { name: holder.name, limb: name });
  return translate("Someone else holds the hand with this prop");
}
