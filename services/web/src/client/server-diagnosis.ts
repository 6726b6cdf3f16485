/** Why a page has no word from a server: browsers say of every such failure only that it failed. */
import { pageTranslator } from "../i18n/translator";

/** In words for a person; `final` where to try again would not help. */
export interface ConnectionDiagnosis {
  title: string;
  text: string;
  isFinal: boolean;
}

/** Names of this machine, which browsers trust without TLS. */
const LOCAL_HOST = /^(localhost|127\.\d+\.\d+\.\d+|\[::1\]|.*\.localhost)$/;

/**
 * Why `server` (an origin) does not speak with a page of `origin`; null where it does. A page of the kind that may not read answers still learns whether
 * there are any.
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
        ? translate(
            "This page was opened from a file. The stage's server allows such pages only if BUNRAKU_ORIGINS contains null.",
          )
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

/** Whether an answer comes at all. */
async function isReachable(url: string, mode: RequestMode): Promise<boolean> {
  try {
    await fetch(url, { mode, cache: "no-store", credentials: "omit" });
    return true;
  } catch {
    return false;
  }
}
