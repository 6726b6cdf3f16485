/** Section of the library that chooses between the puppet and the user's avatar for the selected performer. */
import { translate } from "../../i18n/translator";
import { element } from "../dom";
import { icon } from "../icon";
import type { LimbState } from "../limb-state";
import { createPerformerChooser } from "../strings/performer-chooser";

const AVATAR_FILE_TYPES = ".vrm,.glb";

export interface AvatarActions {
  /** Select a performer. */
  dancer(performer: number): void;
  /** Load an avatar file. */
  avatar(file: File): void;
  /** Show the avatar, or the puppet. */
  danceAs(avatar: boolean): void;
  removeAvatar(): void;
}

export interface AvatarState {
  /** Name of the avatar; null if there is none. */
  readonly name: string | null;
  /** True if the avatar is shown instead of the puppet. */
  readonly active: boolean;
  /** Name of the file that is being loaded. */
  readonly loadingFile: string | null;
}

export interface AvatarChooser {
  readonly element: HTMLElement;
  /** Show the avatar state of a performer. */
  render(performer: number, state: AvatarState): void;
  /** Show the state of the `selected` performer, and with several performers a button for each. */
  dancers(limbs: readonly LimbState[], selected: number): void;
}

const PUPPET_STATE: AvatarState = { name: null, active: false, loadingFile: null };

export function createAvatarChooser(actions: AvatarActions): AvatarChooser {
  const picker = element("input", { type: "file", accept: AVATAR_FILE_TYPES, hidden: true });
  picker.addEventListener("change", () => {
    const [file] = picker.files ?? [];
    picker.value = ""; // so that choosing the same file again is a change
    if (file) actions.avatar(file);
  });
  const radio = (avatar: boolean) =>
    element("input", { type: "radio", name: "dance-as", onChange: () => actions.danceAs(avatar) });
  const [puppet, avatar] = [radio(false), radio(true)];
  const avatarName = element("span", { class: "dance-as-name", dir: "auto" });
  const remove = element(
    "button",
    { class: "round-button dance-as-remove", type: "button", onClick: () => actions.removeAvatar() },
    icon("bin"),
  );
  const choices = element("div", { role: "radiogroup", "aria-labelledby": "dance-as", hidden: true });
  choices.append(
    element("label", {}, puppet, translate("The puppet")),
    element("div", {}, element("label", {}, avatar, avatarName), remove),
  );
  const choose = element("button", { class: "text-button", type: "button", onClick: () => picker.click() });
  const state = element("span", { role: "status", class: "muted" });
  const explanation = element(
    "p",
    { class: "muted" },
    translate(
      "A VRM file, or a GLB with humanoid bones. It stays in this browser; everyone else still sees the puppet.",
    ),
  );
  const section = element(
    "section",
    { class: "dance-as", "aria-labelledby": "dance-as" },
    element("h3", { id: "dance-as" }, translate("Dance as")),
  );
  const chooser = createPerformerChooser(actions.dancer);
  section.append(
    chooser.element,
    choices,
    element("div", { class: "dance-as-choose" }, choose, state),
    picker,
    explanation,
  );
  const states: AvatarState[] = [];
  let shown = 0;
  const show = () => {
    const { name, active, loadingFile } = states[shown] ?? PUPPET_STATE;
    choices.hidden = name === null;
    avatarName.textContent = name ?? "";
    remove.setAttribute("aria-label", translate("Remove the avatar {name}", { name: name ?? "" }));
    [puppet.checked, avatar.checked] = [!active, active];
    choose.textContent = translate(name === null ? "Choose your own avatar" : "Choose another avatar");
    state.textContent = loadingFile === null ? "" : translate("Reading {name}", { name: loadingFile });
  };
  return {
    element: section,
    render(performer, avatarState) {
      states[performer] = avatarState;
      if (performer === shown) show();
    },
    dancers(limbs, selected) {
      chooser.render(limbs, selected);
      if (selected === shown) return;
      shown = selected;
      show();
    },
  };
}
