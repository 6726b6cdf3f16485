/**
 * Page header: wordmark, motion name, live performers, viewers, and the buttons for sharing, keys, language and theme.
 */
import { isolateBidi } from "../i18n/bidi";
import { formatDecimal } from "../i18n/number-format";
import { joinList, pageLanguage, translate } from "../i18n/translator";
import type { Theme } from "../stage/scenery/look";
import { element, setText } from "./dom";
import { initialOf } from "./format";
import { icon } from "./icon";
import type { Presence } from "./limb-state";

/** Name of the other language in that language, and the button's label. */
const OTHER_LANGUAGE = {
  en: { lang: "ja", name: "日本語", createLabel: () => icon("hiragana") },
  ja: { lang: "en", name: "English", createLabel: () => "EN" },
} as const;

export interface Header {
  setMotionName(name: string): void;
  /** Show who watches, who holds the strings (`self` is this page's id), and who performs live. */
  renderPeople(presence: Presence | null, self: string | null): void;
  setTheme(theme: Theme): void;
  /** Elements of the header that cover the picture. */
  readonly parts: readonly HTMLElement[];
}

export function createHeader(
  root: HTMLElement,
  actions: { share(): void; keys(): void; language(): void; theme(): void },
): Header {
  const motionName = element("span", { class: "brand-piece", dir: "auto" });
  const brand = element(
    "a",
    { class: "brand", href: location.pathname, title: translate("Home") },
    element("span", { class: "seal" }),
  );
  brand.append(
    element(
      "span",
      {},
      element("b", { class: "brand-name" }, element("span", { class: "sr-only" }, "Bunraku")),
      motionName,
    ),
  );
  // present from the start, so that screen readers announce its changes
  const live = element("div", { class: "live", role: "status" });
  const count = element("span", { class: "people-count" });
  const avatars = element("span", { class: "avatars" });
  const people = element("div", { class: "people", role: "group", hidden: true }, count, avatars);
  const share = element(
    "button",
    { class: "share", type: "button", "aria-label": translate("Share link"), onClick: actions.share },
    icon("link"),
    element("span", {}, translate("Share link")),
  );
  const keys = element(
    "button",
    {
      class: "round-button keys-button",
      type: "button",
      "aria-label": translate("Keys and gamepad"),
      onClick: actions.keys,
    },
    icon("pad"),
  );
  const otherLanguage = OTHER_LANGUAGE[pageLanguage()];
  const language = element(
    "button",
    {
      class: "round-button language",
      type: "button",
      lang: otherLanguage.lang,
      "aria-label": otherLanguage.name,
      title: otherLanguage.name,
      onClick: actions.language,
    },
    otherLanguage.createLabel(),
  );
  const theme = element("button", { class: "round-button", type: "button", onClick: actions.theme }, icon("theme"));
  const right = element("div", { class: "header-right" }, people, share, keys, language, theme);
  root.append(element("header", { class: "header" }, element("div", { class: "header-left" }, brand, live), right));
  return {
    parts: [brand, live, right],
    setMotionName(name) {
      setText(motionName, name);
      document.title = name ? `${isolateBidi(name)} - Bunraku` : "Bunraku";
    },
    renderPeople(presence, self) {
      const performers = presence?.live ?? [];
      setText(
        live,
        performers[0] ? translate("Live {names}", { names: joinList(performers.map(({ name }) => name)) }) : "",
      );
      people.hidden = !presence || (presence.viewers < 1 && presence.puppeteers.length === 0);
      if (!presence) return;
      const viewers = Math.max(presence.viewers, presence.puppeteers.length);
      setText(count, translate("{count} here", { count: formatDecimal(viewers, 0) }));
      const names = presence.puppeteers.map(({ id, name }) => (id === self ? translate("you") : name));
      people.setAttribute(
        "aria-label",
        names.length
          ? translate("{count} watching; at the strings: {names}", {
              count: formatDecimal(viewers, 0),
              names: joinList(names),
            })
          : translate("{count} watching", { count: formatDecimal(viewers, 0) }),
      );
      avatars.replaceChildren(
        ...presence.puppeteers.slice(0, 5).map((one) =>
          element(
            "span",
            {
              style: `--colour: var(--holder-${one.colour})`,
              title: one.id === self ? translate("{name} (you)", { name: one.name }) : one.name,
            },
            initialOf(one.name),
          ),
        ),
      );
    },
    setTheme(current) {
      theme.setAttribute("aria-label", translate(current === "night" ? "Light theme" : "Dark theme"));
    },
  };
}
