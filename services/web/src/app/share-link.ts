/** The link by which others come to the same stage, told and copied. */
import { guarded } from "../client/access";
import { shareSession } from "../client/api";
import { ProblemError } from "../client/problem";
import { translate } from "../i18n/translator";

/**
 * Copies the page's address with its session, null for none; where the server asks who comes it is one by which others may watch.
 * `toast` is told what became of it; where nothing may be copied, the link itself.
 */
export async function copyShareLink(session: string | null, notify: (message: string) => void): Promise<void> {
  const url = new URL(location.href);
  url.search = session === null ? "" : `?session=${encodeURIComponent(session)}`;
  let copied = translate("Link copied");
  if (guarded() && session !== null) {
    try {
      url.href = new URL(await shareSession(session), location.href).href;
      copied = translate("Link copied: who has it may watch, for a week");
    } catch (error) {
      if (!(error instanceof ProblemError)) throw error;
      notify(translate("{title}: {detail}", error));
      return;
    }
  }
  try {
    await navigator.clipboard.writeText(url.href);
    notify(copied);
  } catch {
    notify(translate("Copy this link: {link}", { link: url.href }));
  }
}
