/** Who dances on this page in the chosen dancer's place: the puppet, or an avatar of the person's own, which is brought and taken away here. */
import { translate } from "../../i18n/translator";
import { element } from "../dom";
import { icon } from "../icon";
import type { LimbState } from "../limb-state";
import { createPerformerChooser } from "../strings/performer-chooser";

/** File names that are taken for avatars, and what the chooser of files shows. */
const AVATAR_FILE_NAME = /\.(?:vrm|glb|gltf)$/i;
const AVATAR_FILE_TYPES = ".vrm,.glb";

export interface AvatarActions {
  /** Another dancer is chosen. */
  dancer(performer: number): void;
  /** A file to dance as. */
  avatar(file: File): void;
  /** Dances as the avatar, or as the puppet. */
  danceAs(avatar: boolean): void;
  /** Forgets the avatar. */
  removeAvatar(): void;
}

export interface AvatarState {
  /** The avatar's name; null where there is none. */
  readonly name: string | null;
  /** Whether it dances, and not the puppet. */
  readonly active: boolean;
  /** The name of a file that is being read. */
  readonly loadingFile: string | null;
}

export interface AvatarChooser {
  readonly element: HTMLElement;
  /** Tells who dances in the place of a dancer. */
  render(performer: number, state: AvatarState): void;
  /** Shows who dances in the place of the chosen dancer; of several with these limbs it is chosen here too. */
  dancers(limbs: readonly LimbState[], chosen: number): void;
}

const PUPPET_STATE: AvatarState = { name: null, active: false, loadingFile: null };

/** Whether a file is to dance as, and not to be danced. */
export function isAvatarFile(file: File): boolean {
  return AVATAR_FILE_NAME.test(file.name);
}

export function createAvatarChooser(actions: AvatarActions): AvatarChooser {
  const picker = element("input", { type: "file", accept: AVATAR_FILE_TYPES, hidden: true });
  picker.addEventListener("change", () => {
    const [file] = picker.files ?? [];
    picker.value = ""; // The same file may be chosen again.
    if (file) actions.avatar(file);
  });
  const radio = (avatar: boolean) =>
    element("input", { type: "radio", name: "dance-as", onChange: () => actions.danceAs(avatar) });
  const [puppet, own] = [radio(false), radio(true)];
  const called = element("span", { class: "dance-as-name" });
  const remove = element(
    "button",
    { class: "round-button dance-as-remove", type: "button", onClick: () => actions.removeAvatar() },
    icon("bin"),
  );
  const choices = element("div", { role: "radiogroup", "aria-labelledby": "dance-as", hidden: true });
  choices.append(
    element("label", {}, puppet, translate("The puppet")),
    element("div", {}, element("label", {}, own, called), remove),
  );
  const choose = element("button", { class: "text-button", type: "button", onClick: () => picker.click() });
  const state = element("span", { role: "status", class: "muted" });
  const words = element(
    "p",
    { class: "muted" },
    translate(
      "A VRM file, or a GLB with humanoid bones. It stays in this browser: nothing is uploaded, and everyone else still sees the puppet.",
    ),
  );
  const section = element(
    "section",
    { class: "dance-as", "aria-labelledby": "dance-as" },
    element("h3", { id: "dance-as" }, translate("Dance as")),
  );
  const chooser = createPerformerChooser(actions.dancer);
  section.append(chooser.element, choices, element("div", { class: "dance-as-choose" }, choose, state), picker, words);
  const states: AvatarState[] = [];
  let shown = 0;
  const show = () => {
    const { name, active: dancing, loadingFile: reading } = states[shown] ?? PUPPET_STATE;
    choices.hidden = name === null;
    called.textContent = name ?? "";
    remove.setAttribute("aria-label", translate("Remove the avatar {name}", { name: name ?? "" }));
    [puppet.checked, own.checked] = [!dancing, dancing];
    choose.textContent = translate(name === null ? "Choose your own avatar" : "Choose another avatar");
    state.textContent = reading === null ? "" : translate("Reading {name}", { name: reading });
  };
  return {
    element: section,
    render(performer, told) {
      states[performer] = told;
      if (performer === shown) show();
    },
    dancers(limbs, chosen) {
      chooser.render(limbs, chosen);
      if (chosen === shown) return;
      shown = chosen;
      show();
    },
  };
}
