/** Copying of a link to the session on the stage. */
import { pageAccess } from "../client/access";
import { shareSession } from "../client/api";
import { ProblemError } from "../client/problem";
import { formatTime } from "../i18n/number-format";
import { translate } from "../i18n/translator";

/**
 * Copy a link to the session, or to the page if `session` is null. On a server with access control the link carries a
 * token that allows viewing. `notify` receives the result, or the link itself if the clipboard is not available.
 */
export async function copyShareLink(session: string | null, notify: (message: string) => void): Promise<void> {
  const url = new URL(location.href);
  url.search = session === null ? "" : `?session=${encodeURIComponent(session)}`;
  let message = translate("Link copied");
  if (pageAccess.hasToken && session !== null) {
    try {
      const { link, expires } = await shareSession(session);
      url.href = new URL(link, location.href).href;
      message = translate("Link copied. Anyone who has it can watch until {time}", { time: formatTime(expires) });
    } catch (error) {
      if (!(error instanceof ProblemError)) throw error;
      notify(translate("{title}: {detail}", error));
      return;
    }
  }
  try {
    await navigator.clipboard.writeText(url.href);
    notify(message);
  } catch {
    notify(translate("Copy this link: {link}", { link: url.href }));
  }
}
