/** Why a viewer shows what it shows, in words for a person (`proto/SPEC.md`, Choice). */

import { formatDecimal } from "../i18n/number-format";
import { type PlainMessageKey, pageTranslator } from "../i18n/translator";
import type { Choice } from "../wire/messages";

const CHOICE_REASONS: Readonly<Record<string, PlainMessageKey>> = {
  best: "the best available",
  line: "as much as the connection allows",
  hands: "so that controlled limbs arrive in time",
  machine: "since drawing is slow on this device",
  buffer: "until more is buffered",
  start: "raised once this level is stable",
  hidden: "since this tab is in the background",
  pinned: "pinned by the address",
};

/** How it stands: why the line is `closed` (null while it is open), messages that could not be read, and what is shown. */
export interface ViewerStatus {
  closeReason: string | null;
  damagedCount: number;
  hasPose: boolean;
  isStalled: boolean;
  choice: Choice | null;
  isPinned: boolean;
}

/** Why what is shown is as it is. */
export function describeStatus(status: ViewerStatus, { translate } = pageTranslator): string {
  const {
    closeReason: closed,
    damagedCount: damaged,
    hasPose: shown,
    isStalled: missing,
    choice,
    isPinned: pinned,
  } = status;
  if (closed !== null) return closed;
  if (damaged > 0)
    return damaged === 1
      ? translate("1 message could not be read")
      : translate("{count} messages could not be read", { count: formatDecimal(damaged, 0) });
  if (!shown) return translate("waiting for the first block");
  if (missing) return translate("waiting for a block");
  if (!choice) return translate(pinned ? CHOICE_REASONS.pinned : "chosen by the server");
  const reason = translate(CHOICE_REASONS[choice.reason] ?? "chosen by the server");
  return choice.line === null
    ? reason
    : translate("{reason} ({rate} kbit/s)", { reason, rate: formatDecimal(choice.line / 1000, 1) });
}
