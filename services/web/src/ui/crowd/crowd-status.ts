/** Status of the limbs that are open to the audience, for everybody who watches. Loaded with the first of them. */
import { translate } from "../../i18n/translator";
import { element, setText } from "../dom";
import { capitalise, openCrowd } from "../limb-display";
import { type LimbCrowd, type LimbState, limbName, performerCount } from "../limb-state";
import { describePolicy, describePulls, secondsOfTurn } from "./crowd-text";

/** Most limbs with a row each. */
const MAX_ROWS = 2;
/** Interval at which the time that is left of a turn is renewed, in milliseconds. */
const TURN_REFRESH_MS = 250;

export interface CrowdStatus {
  /** Show the open limbs among these. */
  render(limbs: readonly LimbState[]): void;
}

interface OpenLimb {
  readonly limb: number;
  readonly crowd: LimbCrowd;
}

/**
 * Create the status in the message area `root`. `getClock` returns the clock time that the stage shows, in
 * microseconds, and `toast` shows that a limb was opened or closed.
 */
export function createCrowdStatus(
  root: HTMLElement,
  getClock: () => number,
  toast: (message: string) => void,
): CrowdStatus {
  const rows = Array.from({ length: MAX_ROWS }, () => {
    const [name, pulls, policy] = [element("b"), element("span"), element("small")];
    return { name, pulls, policy, root: element("p", {}, name, pulls, policy) };
  });
  const more = element("small");
  // Not a live region: the numbers change all the time.
  const status = element(
    "section",
    { class: "crowd-status", "aria-label": translate("The audience"), hidden: true },
    ...rows.map((row) => row.root),
    more,
  );
  const announcement = element("p", { class: "sr-only", role: "status", "aria-live": "polite" });
  root.prepend(element("div", {}, status, announcement));
  let known: ReadonlySet<number> = new Set();
  let shown: readonly OpenLimb[] = [];
  let performers = 1;
  let timer: ReturnType<typeof setInterval> | undefined;
  const write = () => {
    const seconds = secondsOfTurn(getClock());
    rows.forEach((row, index) => {
      const open = shown[index];
      row.root.hidden = !open;
      if (!open) return;
      setText(row.name, capitalise(limbName(open.limb, performers)));
      setText(row.pulls, ` ${describePulls(open.crowd)}`);
      const text = describePolicy(open.limb, open.crowd, seconds);
      // Said once for all.
      setText(row.policy, index > 0 && text === rows[0].policy.textContent ? "" : text);
    });
    const count = shown.length - MAX_ROWS;
    more.hidden = count <= 0;
    setText(more, count === 1 ? translate("and 1 more limb") : translate("and {count} more limbs", { count }));
    status.hidden = shown.length === 0;
  };
  const announce = (limbs: readonly LimbState[]) => {
    const open = new Set(limbs.flatMap(({ crowd }, limb) => (crowd ? limb : [])));
    const report = (
      text: "The {limb} is open to the audience" | "The {limb} is closed to the audience",
      limb: number,
    ) => toast(translate(text, { limb: limbName(limb, performers) }));
    for (const limb of open) if (!known.has(limb)) report("The {limb} is open to the audience", limb);
    for (const limb of known) if (!open.has(limb)) report("The {limb} is closed to the audience", limb);
    known = open;
    const turn = limbs.findIndex(({ crowd }) => crowd?.hasTurn && crowd.isPulled);
    setText(announcement, turn < 0 ? "" : translate("It is your turn: {limb}", { limb: limbName(turn, performers) }));
  };
  return {
    render(limbs) {
      performers = performerCount(limbs);
      announce(limbs);
      shown = limbs
        .flatMap((state, limb): OpenLimb[] => {
          const crowd = openCrowd(state);
          return crowd ? [{ limb, crowd }] : [];
        })
        .sort((a, b) => Number(b.crowd.isPulled) - Number(a.crowd.isPulled) || b.crowd.pulls - a.crowd.pulls);
      const hasTurns = shown.some(({ crowd }) => crowd.policy === "turns" && (crowd.pulls > 0 || crowd.isPulled));
      if (!hasTurns) {
        clearInterval(timer);
        timer = undefined;
      } else timer ??= setInterval(write, TURN_REFRESH_MS);
      write();
    },
  };
}
