/** Links to the session on the stage. */
import { pageAccess } from "../client/access";
import { shareSession } from "../client/api";
import { ProblemError } from "../client/problem";
import { formatTime } from "../i18n/number-format";
import { translate } from "../i18n/translator";

/** Link, and the time at which it expires if it carries a token. */
export interface ShareLink {
  readonly href: string;
  readonly expires: string | null;
}

/**
 * Return a link to the session, or to the page if `session` is null. On a server with access control the link carries a
 * token that allows viewing. If it cannot be made, `notify` receives the reason, and the result is null.
 */
export async function createShareLink(
  session: string | null,
  notify: (message: string) => void,
): Promise<ShareLink | null> {
  const url = new URL(location.href);
  url.search = session === null ? "" : `?session=${encodeURIComponent(session)}`;
  if (!pageAccess.hasToken || session === null) return { href: url.href, expires: null };
  try {
    const { link, expires } = await shareSession(session);
    return { href: new URL(link, location.href).href, expires };
  } catch (error) {
    if (!(error instanceof ProblemError)) throw error;
    notify(translate("{title}: {detail}", error));
    return null;
  }
}

/** Copy a link to the session. `notify` receives the result, or the link itself if the clipboard is not available. */
export async function copyShareLink(session: string | null, notify: (message: string) => void): Promise<void> {
  const created = await createShareLink(session, notify);
  if (!created) return;
  const { href, expires } = created;
  try {
    await navigator.clipboard.writeText(href);
    notify(
      expires === null
        ? translate("Link copied")
        : translate("Link copied. Anyone who has it can watch until {time}", { time: formatTime(expires) }),
    );
  } catch {
    notify(translate("Copy this link: {link}", { link: href }));
  }
}
