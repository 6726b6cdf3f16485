/** Who dances on this page: the puppet, or the person's own avatar, which is chosen and taken away here. */
import { say } from "../words/say";
import { element } from "./dom";
import { icon } from "./icons";

/** File names that are taken for avatars, and what the chooser of files shows. */
const ENDINGS = /\.(?:vrm|glb|gltf)$/i;
const AVATARS = ".vrm,.glb";

export interface DanceAsActions {
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
  render(state: DanceAsState): void;
}

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
  section.append(choices, element("div", { class: "dance-as-choose" }, choose, state), picker, words);
  return {
    element: section,
    render({ name, dancing, reading }) {
      choices.hidden = name === null;
      called.textContent = name ?? "";
      remove.setAttribute("aria-label", say("Remove the avatar {name}", { name: name ?? "" }));
      [puppet.checked, own.checked] = [!dancing, dancing];
      choose.textContent = say(name === null ? "Choose your own avatar" : "Choose another avatar");
      state.textContent = reading === null ? "" : say("Reading {name}", { name: reading });
    },
  };
}
