/** The page of examples: its theme, its link's token, and the source of each as it would stand in another site's page. */
import { consumeUrlToken } from "./client/access";
import { createTheme } from "./ui/theme";

// first of all: the link's token leaves the address, and the stages come in by it
consumeUrlToken();
addEventListener("hashchange", () => consumeUrlToken() && location.reload());

const button = document.querySelector<HTMLButtonElement>(".theme") as HTMLButtonElement;
/** Stages that say no theme have the page's. */
const unthemedStages = document.querySelectorAll("bunraku-stage:not([theme])");
const theme = createTheme((now) => {
  button.textContent = now === "night" ? "Light theme" : "Dark theme";
  for (const stage of unthemedStages) stage.setAttribute("theme", now);
});
button.addEventListener("click", () => theme.toggle());

/** What stands at an address of this server. */
async function fetchText(address: string): Promise<string> {
  const answer = await fetch(address);
  if (!answer.ok) throw new Error(`${address} answers ${answer.status}`);
  return answer.text();
}

/** Addresses of this server as another site's page has to write them. */
function withAbsoluteUrls(source: string): string {
  return source.replace(/(src=|from )"\//g, `$1"${location.origin}/`).trim();
}

const sourceDocument = new DOMParser().parseFromString(await fetchText("./"), "text/html");
for (const code of document.querySelectorAll<HTMLElement>("code[data-of]")) {
  const stages = sourceDocument.querySelector(`#${code.dataset["of"]}`)?.innerHTML ?? "";
  const bare = stages.replaceAll('=""', "").trim();
  code.textContent = withAbsoluteUrls(`<script type="module" src="/embed/bunraku-stage.js"></script>\n${bare}`);
}
for (const code of document.querySelectorAll<HTMLElement>("code[data-from]"))
  code.textContent = withAbsoluteUrls(await fetchText(code.dataset["from"] ?? ""));
