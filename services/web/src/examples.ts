/** Page of examples: theme button, access token, and the source of each example as another site would write it. */
import { consumeUrlToken } from "./client/access";
import { createTheme } from "./ui/theme";

// Remove the token from the address before anything else; the stages use it for access.
consumeUrlToken();
addEventListener("hashchange", () => consumeUrlToken() && location.reload());

const button = document.querySelector<HTMLButtonElement>(".theme") as HTMLButtonElement;
/** Stages without a theme attribute, which follow the page's. */
const unthemedStages = document.querySelectorAll("bunraku-stage:not([theme])");
const theme = createTheme((current) => {
  button.textContent = current === "night" ? "Light theme" : "Dark theme";
  for (const stage of unthemedStages) stage.setAttribute("theme", current);
});
button.addEventListener("click", () => theme.toggle());

/** Fetch a text from this server. */
async function fetchText(address: string): Promise<string> {
  const response = await fetch(address);
  if (!response.ok) throw new Error(`Request for ${address} failed with status ${response.status}.`);
  return response.text();
}

/** Replace addresses relative to this server by absolute ones, as another site has to write them. */
function withAbsoluteUrls(source: string): string {
  return source.replace(/(src=|from )"\//g, `$1"${location.origin}/`).trim();
}

const sourceDocument = new DOMParser().parseFromString(await fetchText("./"), "text/html");
for (const code of document.querySelectorAll<HTMLElement>("code[data-of]")) {
  const stages = sourceDocument.querySelector(`#${code.dataset["of"]}`)?.innerHTML ?? "";
  const markup = stages.replaceAll('=""', "").trim();
  code.textContent = withAbsoluteUrls(`<script type="module" src="/embed/bunraku-stage.js"></script>\n${markup}`);
}
for (const code of document.querySelectorAll<HTMLElement>("code[data-from]"))
  code.textContent = withAbsoluteUrls(await fetchText(code.dataset["from"] ?? ""));
