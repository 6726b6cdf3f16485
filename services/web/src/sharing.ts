/** The link by which others come to the same stage, told and copied. */
import { guarded } from "./client/access";
import { shareSession } from "./client/library";
import { ProblemError } from "./client/problem";
import { say } from "./words/say";

/**
 * Copies the page's address with its session, null for none; where the server asks who comes it is one by which others may watch.
 * `toast` is told what became of it; where nothing may be copied, the link itself.
 */
export async function share(session: string | null, toast: (message: string) => void): Promise<void> {
  const url = new URL(location.href);
  url.search = session === null ? "" : `?session=${encodeURIComponent(session)}`;
  let copied = say("Link copied");
  if (guarded() && session !== null) {
    try {
      url.href = new URL(await shareSession(session), location.href).href;
      copied = say("Link copied: who has it may watch, for a week");
    } catch (error) {
      if (!(error instanceof ProblemError)) throw error;
      toast(say("{title}: {detail}", error));
      return;
    }
  }
  try {
    await navigator.clipboard.writeText(url.href);
    toast(copied);
  } catch {
    toast(say("Copy this link: {link}", { link: url.href }));
  }
}
