/** Who dances on this page in the chosen dancer's place: the puppet, or an avatar of the person's own, which is brought and taken away here. */
import { say } from "../words/say";
import { createDancerChooser } from "./dancer-chooser";
import { element } from "./dom";
import { icon } from "./icons";
import type { LimbState } from "./model";

/** File names that are taken for avatars, and what the chooser of files shows. */
const ENDINGS = /\.(?:vrm|glb|gltf)$/i;
const AVATARS = ".vrm,.glb";

export interface DanceAsActions {
  /** Another dancer is chosen. */
  dancer(performer: number): void;
  /** A file to dance as. */
  avatar(file: File): void;
  /** Dances as the avatar, or as the puppet. */
  danceAs(avatar: boolean): void;
  /** Forgets the avatar. */
  removeAvatar(): void;
}

export interface DanceAsState {
  /** The avatar's name; null where there is none. */
  readonly name: string | null;
  /** Whether it dances, and not the puppet. */
  readonly dancing: boolean;
  /** The name of a file that is being read. */
  readonly reading: string | null;
}

export interface DanceAs {
  readonly element: HTMLElement;
  /** Tells who dances in the place of a dancer. */
  render(performer: number, state: DanceAsState): void;
  /** Shows who dances in the place of the chosen dancer; of several with these limbs it is chosen here too. */
  dancers(limbs: readonly LimbState[], chosen: number): void;
}

const PUPPET: DanceAsState = { name: null, dancing: false, reading: null };

/** Whether a file is to dance as, and not to be danced. */
export function isAvatar(file: File): boolean {
  return ENDINGS.test(file.name);
}

export function createDanceAs(on: DanceAsActions): DanceAs {
  const picker = element("input", { type: "file", accept: AVATARS, hidden: true });
  picker.addEventListener("change", () => {
    const [file] = picker.files ?? [];
    picker.value = ""; // The same file may be chosen again.
    if (file) on.avatar(file);
  });
  const radio = (avatar: boolean) => element("input", { type: "radio", name: "dance-as", onChange: () => on.danceAs(avatar) });
  const [puppet, own] = [radio(false), radio(true)];
  const called = element("span", { class: "dance-as-name" });
  const remove = element("button", { class: "round-button dance-as-remove", type: "button", onClick: () => on.removeAvatar() }, icon("bin"));
  const choices = element("div", { role: "radiogroup", "aria-labelledby": "dance-as", hidden: true });
  choices.append(element("label", {}, puppet, say("The puppet")), element("div", {}, element("label", {}, own, called), remove));
  const choose = element("button", { class: "text-button", type: "button", onClick: () => picker.click() });
  const state = element("span", { role: "status", class: "muted" });
  const words = element("p", { class: "muted" }, say("A VRM file, or a GLB with humanoid bones. It stays in this browser: nothing is uploaded, and everyone else still sees the puppet."));
  const section = element("section", { class: "dance-as", "aria-labelledby": "dance-as" }, element("h3", { id: "dance-as" }, say("Dance as")));
  const chooser = createDancerChooser(on.dancer);
  section.append(chooser.element, choices, element("div", { class: "dance-as-choose" }, choose, state), picker, words);
  const states: DanceAsState[] = [];
  let shown = 0;
  const show = () => {
    const { name, dancing, reading } = states[shown] ?? PUPPET;
    choices.hidden = name === null;
    called.textContent = name ?? "";
    remove.setAttribute("aria-label", say("Remove the avatar {name}", { name: name ?? "" }));
    [puppet.checked, own.checked] = [!dancing, dancing];
    choose.textContent = say(name === null ? "Choose your own avatar" : "Choose another avatar");
    state.textContent = reading === null ? "" : say("Reading {name}", { name: reading });
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
