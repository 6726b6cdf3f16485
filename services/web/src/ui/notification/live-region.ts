/** What is said for as long as its cause lasts, in a live region: each cause takes away its own words, and no other's. */

/** Says something about a cause from now on, in place of what was said about it; null: the cause is gone. */
export type SetMessage<Cause extends string> = (about: Cause, said: HTMLElement | null) => void;

export function createLiveRegion<Cause extends string>(root: HTMLElement): SetMessage<Cause> {
  const standing = new Map<Cause, HTMLElement>();
  return (about, said) => {
    standing.get(about)?.remove();
    standing.delete(about);
    if (!said) return;
    standing.set(about, said);
    root.append(said);
  };
}
