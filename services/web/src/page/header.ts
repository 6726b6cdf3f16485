/** Seal, wordmark and piece; who is here, the link to share, keys, theme. */
import { element, setText } from "./dom";
import { initial, isolated } from "./format";
import { icon } from "./icons";
import type { Presence } from "./model";
import type { Theme } from "../stage/look";

export interface Header {
  piece(name: string): void;
  people(presence: Presence | null, self: string | null): void;
  theme(theme: Theme): void;
}

export function createHeader(root: HTMLElement, on: { share(): void; keys(): void; theme(): void }): Header {
  const piece = element("span", { class: "brand-piece" });
  const brand = element("a", { class: "brand", href: location.pathname, title: "Home" }, element("span", { class: "seal" }));
  brand.append(element("span", {}, element("b", { class: "brand-name" }, element("span", { class: "sr-only" }, "Bunraku")), piece));
  const count = element("span", { class: "people-count" });
  const avatars = element("span", { class: "avatars" });
  const people = element("div", { class: "people", role: "group", hidden: true }, count, avatars);
  const share = element("button", { class: "share", type: "button", "aria-label": "Share link", onClick: on.share }, icon("link"), element("span", {}, "Share link"));
  const keys = element("button", { class: "round-button keys-button", type: "button", "aria-label": "Keys and gamepad", onClick: on.keys }, icon("pad"));
  const theme = element("button", { class: "round-button", type: "button", onClick: on.theme }, icon("theme"));
  root.append(element("header", { class: "header" }, brand, element("div", { class: "header-right" }, people, share, keys, theme)));
  return {
    piece(name) {
      setText(piece, name);
      document.title = name ? `${isolated(name)} - Bunraku` : "Bunraku";
    },
    people(presence, self) {
      people.hidden = !presence || (presence.viewers < 1 && presence.puppeteers.length === 0);
      if (!presence) return;
      const here = Math.max(presence.viewers, presence.puppeteers.length);
      setText(count, `${here} here`);
      const names = presence.puppeteers.map((one) => (one.id === self ? "you" : one.name));
      people.setAttribute("aria-label", `${here} watching${names.length ? `; at the strings: ${names.join(", ")}` : ""}`);
      avatars.replaceChildren(
        ...presence.puppeteers.slice(0, 5).map((one) =>
          element("span", { style: `--colour: var(--holder-${one.colour})`, title: one.id === self ? `${one.name} (you)` : one.name }, initial(one.name)),
        ),
      );
    },
    theme(now) {
      theme.setAttribute("aria-label", now === "night" ? "Light theme" : "Dark theme");
    },
  };
}
