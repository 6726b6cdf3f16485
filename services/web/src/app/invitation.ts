/** On a first visit, some seconds of invitation by the hand nearer to the audience; over for good once a limb was taken. */

import type { Stage } from "../stage/stage";
import { browserStorage, type WebStorage } from "../storage/web-storage";
import type { NameTags } from "../ui/strings/name-tag";

const INVITATION_SHOWN_KEY = "bunraku.invited";
/** Milliseconds. */
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

  /** The dance is on show at local `now`, milliseconds. */
  update(now: number, stage: Pick<Stage, "nearerHand" | "toScreen">): void {
    if (this.#finished) return;
    this.#startedAtMs ??= now;
    if (now - this.#startedAtMs > INVITATION_DURATION_MS) {
      this.finish();
      return;
    }
    const at = stage.nearerHand();
    this.tags.invite(at && stage.toScreen(at));
  }

  /** It was followed, or has been there for long enough. */
  finish(): void {
    if (this.#finished) return;
    this.#finished = true;
    this.tags.invite(null);
    this.storage.put(INVITATION_SHOWN_KEY, "yes");
  }
}
