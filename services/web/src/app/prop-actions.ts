/** Actions of the props section: changes of the session, and requests to the engine. */
import { editSession } from "../client/api";
import { ProblemError } from "../client/problem";
import type { PropRefusalReason } from "../engine/prop-request";
import { type PlainMessageKey, translate } from "../i18n/translator";
import { limbHolders, limbName } from "../ui/limb-state";
import type { ShowToast } from "../ui/notification/toast";
import type { PropActions } from "../ui/strings/prop-section";
import type { StoredProps } from "../ui/strings/stored-prop-list";
import { MAX_PROPS } from "../wire/limbs";
import type { PropPresence } from "../wire/messages";
import type { RemotePlayback } from "./remote-playback";

export interface PropContext {
  readonly toast: ShowToast;
  readonly current: RemotePlayback | null;
  putProp(prop: number, limb: number | null): Promise<PropRefusalReason | null>;
  moveProp(): Promise<{ readonly limb: number | null; readonly refusal: PropRefusalReason | null }>;
}

const ALL_NUMBERS = Array.from({ length: MAX_PROPS }, (_, prop) => prop);

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
  /** Numbers of the props after the last edit of this page: the session may not have told them yet. */
  let known: readonly number[] = [];
  let lastEdit: Promise<unknown> = Promise.resolve();
  let stored: Promise<StoredProps> | null = null;
  /** Edit the session. Return true if it has accepted the edit. */
  const edit = async (props: Record<string, string | null>): Promise<boolean> => {
    const { current, toast } = context();
    if (!current) return false;
    try {
      const session = await editSession(current.id, { props });
      known = numbersOf(session.props);
      return true;
    } catch (error) {
      known = [];
      toast(error instanceof ProblemError ? translate("{title}: {detail}", error) : String(error));
      return false;
    }
  };
  const addNow = async (kind: string): Promise<boolean> => {
    const present = numbersOf(context().current?.presence?.props);
    const findFree = (...used: number[]) => ALL_NUMBERS.find((prop) => !used.includes(prop));
    const free = findFree(...present, ...known) ?? findFree(...present);
    if (free !== undefined) return edit({ [free]: kind });
    context().toast(translate("There is room for {count} props", { count: MAX_PROPS }));
    return false;
  };
  /** Add a prop after those before, so that each has its own number. Return true if it is there. */
  const add = (kind: string): Promise<boolean> => {
    const added = lastEdit.then(() => addNow(kind));
    lastEdit = added;
    return added;
  };
  return {
    add: (kind) => void add(kind),
    remove: (prop) => void edit({ [prop]: null }),
    async put(prop, limb) {
      const { current, putProp, toast } = context();
      const refusal = await putProp(prop, limb).catch(() => "no answer" as const);
      if (refusal && current) toast(describeRefusal(refusal, limb, current));
    },
    stored() {
      stored ??= import("./prop-library").then(
        ({ PropLibrary }) =>
          new PropLibrary({
            toast: (message) => context().toast(message),
            bring: add,
            confirm: (question) => confirm(question),
          }),
      );
      // The next call tries again.
      stored.catch(() => (stored = null));
      return stored;
    },
  };
}

function numbersOf(props: readonly PropPresence[] | null | undefined): number[] {
  return props?.map(({ prop }) => prop) ?? [];
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
