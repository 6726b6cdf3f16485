/** On a first visit, some seconds of invitation by the hand nearer to the audience; over for good once a limb was taken. */
import type { Tags } from "./page/tags";
import type { Stage } from "./stage/stage";
import { browserStore, type Store } from "./storage/store";

const INVITED = "bunraku.invited";
/** Milliseconds. */
const INVITATION = 6_000;

export class Inviting {
  #over: boolean;
  #since: number | null = null;

  constructor(private readonly tags: Pick<Tags, "invite">, private readonly store: Pick<Store, "get" | "put"> = browserStore) {
    this.#over = store.get(INVITED) !== null;
  }

  /** The dance is on show at local `now`, milliseconds. */
  update(now: number, stage: Pick<Stage, "nearerHand" | "toScreen">): void {
    if (this.#over) return;
    this.#since ??= now;
    if (now - this.#since > INVITATION) {
      this.end();
      return;
    }
    const at = stage.nearerHand();
    this.tags.invite(at && stage.toScreen(at));
  }

  /** It was followed, or has been there for long enough. */
  end(): void {
    if (this.#over) return;
    this.#over = true;
    this.tags.invite(null);
    this.store.put(INVITED, "yes");
  }
}
