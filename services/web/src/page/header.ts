/** Seal, wordmark and piece; who is here, the link to share, keys, theme. */
import { element, setText } from "./dom";
import { initial, isolated } from "./format";
import { icon } from "./icons";
import type { Presence } from "./model";
import type { Theme } from "../stage/look";
import { decimal } from "../words/numbers";
import { language, series, say } from "../words/say";

/** The other language's own name, and as few letters of it as can be known by. */
const OTHER = { en: { lang: "ja", name: "日本語", letter: "あ" }, ja: { lang: "en", name: "English", letter: "EN" } } as const;

export interface Header {
  piece(name: string): void;
  people(presence: Presence | null, self: string | null): void;
  theme(theme: Theme): void;
  /** What of it stands before the picture. */
  readonly parts: readonly HTMLElement[];
}

export function createHeader(root: HTMLElement, on: { share(): void; keys(): void; language(): void; theme(): void }): Header {
  const piece = element("span", { class: "brand-piece" });
  const brand = element("a", { class: "brand", href: location.pathname, title: say("Home") }, element("span", { class: "seal" }));
  brand.append(element("span", {}, element("b", { class: "brand-name" }, element("span", { class: "sr-only" }, "Bunraku")), piece));
  const count = element("span", { class: "people-count" });
  const avatars = element("span", { class: "avatars" });
  const people = element("div", { class: "people", role: "group", hidden: true }, count, avatars);
  const share = element("button", { class: "share", type: "button", "aria-label": say("Share link"), onClick: on.share }, icon("link"), element("span", {}, say("Share link")));
  const keys = element("button", { class: "round-button keys-button", type: "button", "aria-label": say("Keys and gamepad"), onClick: on.keys }, icon("pad"));
  const own = OTHER[language()];
  const other = element("button", { class: "round-button language", type: "button", lang: own.lang, "aria-label": own.name, title: own.name, onClick: on.language }, own.letter);
  const theme = element("button", { class: "round-button", type: "button", onClick: on.theme }, icon("theme"));
  const right = element("div", { class: "header-right" }, people, share, keys, other, theme);
  root.append(element("header", { class: "header" }, brand, right));
  return {
    parts: [brand, right],
    piece(name) {
      setText(piece, name);
      document.title = name ? `${isolated(name)} - Bunraku` : "Bunraku";
    },
    people(presence, self) {
      people.hidden = !presence || (presence.viewers < 1 && presence.puppeteers.length === 0);
      if (!presence) return;
      const here = Math.max(presence.viewers, presence.puppeteers.length);
      setText(count, say("{count} here", { count: decimal(here, 0) }));
      const names = presence.puppeteers.map((one) => (one.id === self ? say("you") : one.name));
      people.setAttribute("aria-label", names.length ? say("{count} watching; at the strings: {names}", { count: decimal(here, 0), names: series(names) }) : say("{count} watching", { count: decimal(here, 0) }));
      avatars.replaceChildren(
        ...presence.puppeteers.slice(0, 5).map((one) =>
          element("span", { style: `--colour: var(--holder-${one.colour})`, title: one.id === self ? say("{name} (you)", { name: one.name }) : one.name }, initial(one.name)),
        ),
      );
    },
    theme(now) {
      theme.setAttribute("aria-label", say(now === "night" ? "Light theme" : "Dark theme"));
    },
  };
}
