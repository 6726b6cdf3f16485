/** Invitation to take a hand, shown on a first visit beside the hand nearer to the audience. */
import type { ScreenPosition } from "../stage/camera/screen-projection";
import { browserStorage, type WebStorage } from "../storage/web-storage";
import type { NameTags } from "../ui/strings/name-tag";

const INVITATION_SHOWN_KEY = "bunraku.invited";
const INVITATION_DURATION_MS = 6_000;

export class Invitation {
  #finished: boolean;
  #startedAtMs: number | null = null;

  constructor(
    private readonly tags: Pick<NameTags, "invite">,
    private readonly storage: Pick<WebStorage, "get" | "put"> = browserStorage,
  ) {
    this.#finished = storage.get(INVITATION_SHOWN_KEY) !== null;
  }

  /** Show the invitation beside `hand` at local time `now` in milliseconds, or end it after its duration. */
  update(now: number, hand: ScreenPosition | null): void {
    if (this.#finished) return;
    this.#startedAtMs ??= now;
    if (now - this.#startedAtMs > INVITATION_DURATION_MS) {
      this.finish();
      return;
    }
    this.tags.invite(hand);
  }

  /** Hide the invitation, and never show it again in this browser. */
  finish(): void {
    if (this.#finished) return;
    this.#finished = true;
    this.tags.invite(null);
    this.storage.put(INVITATION_SHOWN_KEY, "yes");
  }
}
