/** Live region with one message per cause. Each message is shown for as long as its cause lasts. */
/** Set the message of a cause, in place of its last one; null removes it. */
export type SetMessage<Cause extends string> = (cause: Cause, message: HTMLElement | null) => void;

export function createLiveRegion<Cause extends string>(root: HTMLElement): SetMessage<Cause> {
  const messages = new Map<Cause, HTMLElement>();
  return (cause, message) => {
    messages.get(cause)?.remove();
    messages.delete(cause);
    if (!message) return;
    messages.set(cause, message);
    root.append(message);
  };
}
