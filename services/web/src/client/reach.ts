/** Why a page has no word from a server: browsers say of every such failure only that it failed. */
import { pageSpeech } from "../words/say";

/** In words for a person; `final` where to try again would not help. */
export interface Unreached {
  title: string;
  text: string;
  final: boolean;
}

/** Names of this machine, which browsers trust without TLS. */
const LOCAL = /^(localhost|127\.\d+\.\d+\.\d+|\[::1\]|.*\.localhost)$/;

/**
 * Why `server` (an origin) does not speak with a page of `origin`; null where it does. A page of the kind that may not read answers still learns whether
 * there are any.
 */
export async function whyUnreached(server: string, origin: string, { say } = pageSpeech): Promise<Unreached | null> {
  const health = `${server}/v1/health`;
  if (await answers(health, "cors")) return null;
  if (origin.startsWith("https:") && server.startsWith("http:") && !LOCAL.test(new URL(server).hostname)) {
    return { title: say("The stage cannot be shown here"), text: say("This page came over https, and browsers let it speak with no server that has none."), final: true };
  }
  if (await answers(health, "no-cors")) {
    const text =
      origin === "null"
        ? say("This page was opened from a file. The stage's server lets such pages in only if BUNRAKU_ORIGINS has null in it.")
        : say("The stage's server does not know this site. Its host can let it in: BUNRAKU_ORIGINS={origin}", { origin });
    return { title: say("The stage cannot be shown here"), text, final: true };
  }
  return { title: say("The stage does not answer"), text: say("Its server cannot be reached now. It is tried again and again."), final: false };
}

/** Whether an answer comes at all. */
async function answers(url: string, mode: RequestMode): Promise<boolean> {
  try {
    await fetch(url, { mode, cache: "no-store", credentials: "omit" });
    return true;
  } catch {
    return false;
  }
}
