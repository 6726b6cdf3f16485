/** Diagnosis of an unreachable server: browsers give pages no reason for a failed request. */

import { type PlainMessageKey, pageTranslator } from "../i18n/translator";

/** Texts for the user; `isFinal` if a retry cannot succeed. */
export interface ConnectionDiagnosis {
  title: string;
  text: string;
  isFinal: boolean;
}

/** Text for a page without an origin. */
const FILE_PAGE_TEXT: PlainMessageKey =
  "This page was opened from a file. The stage's server allows such pages only if BUNRAKU_ORIGINS contains null.";

/** Host names of this machine, to which https pages may connect without TLS. */
const LOCAL_HOST = /^(localhost|127\.\d+\.\d+\.\d+|\[::1\]|.*\.localhost)$/;

/**
 * Determine why a page of `origin` cannot use `server` (an origin); null if it can. A page that CORS does not allow to
 * read responses still learns by a `no-cors` request that the server answers.
 */
export async function diagnoseUnreachable(
  server: string,
  origin: string,
  { translate } = pageTranslator,
): Promise<ConnectionDiagnosis | null> {
  const health = `${server}/v1/health`;
  if (await isReachable(health, "cors")) return null;
  if (origin.startsWith("https:") && server.startsWith("http:") && !LOCAL_HOST.test(new URL(server).hostname)) {
    return {
      title: translate("The stage cannot be shown here"),
      text: translate("This page uses https, so browsers do not let it connect to a server without https."),
      isFinal: true,
    };
  }
  if (await isReachable(health, "no-cors")) {
    const text =
      origin === "null"
        ? translate(FILE_PAGE_TEXT)
        : translate(
            "The stage's server does not allow this site. Its operator can allow it: BUNRAKU_ORIGINS={origin}",
            {
              origin,
            },
          );
    return { title: translate("The stage cannot be shown here"), text, isFinal: true };
  }
  return {
    title: translate("The stage does not answer"),
    text: translate("The server cannot be reached now. Retrying automatically."),
    isFinal: false,
  };
}

async function isReachable(url: string, mode: RequestMode): Promise<boolean> {
  try {
    await fetch(url, { mode, cache: "no-store", credentials: "omit" });
    return true;
  } catch {
    return false;
  }
}
