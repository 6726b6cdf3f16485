/** Invitation to take a hand, shown on a first visit beside the hand nearer to the audience. */
import { browserStorage, type WebStorage } from "../storage/web-storage";
import type { NameTags } from "../ui/strings/name-tag";

const INVITATION_SHOWN_KEY = "bunraku.invited";
const INVITATION_DURATION_MS = 6_000;

export class Invitation {
  #started = false;
  #finished: boolean;
  #timer: ReturnType<typeof setTimeout> | undefined;

  constructor(
    private readonly tags: Pick<NameTags, "invite" | "endInvitation">,
    private readonly storage: Pick<WebStorage, "get" | "put"> = browserStorage,
  ) {
    this.#finished = storage.get(INVITATION_SHOWN_KEY) !== null;
  }

  /**
   * Show the invitation for its duration, which begins once it is seen: a page may be busy before. Called once there is
   * a hand to take.
   */
  start(): void {
    if (this.#started || this.#finished) return;
    this.#started = true;
    this.tags.invite(() => {
      this.#timer = setTimeout(() => this.finish(), INVITATION_DURATION_MS);
    });
  }

  /** Hide the invitation, and never show it again in this browser. */
  finish(): void {
    if (this.#finished) return;
    this.#finished = true;
    clearTimeout(this.#timer);
    this.tags.endInvitation();
    this.storage.put(INVITATION_SHOWN_KEY, "yes");
  }
}
