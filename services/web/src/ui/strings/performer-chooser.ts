/** Which of several dancers the rows and keys act on: a button each, with who holds what of it at a glance. */

import { joinList, pageTranslator, translate } from "../../i18n/translator";
import { limbNumber } from "../../wire/limbs";
import { element, setAttribute } from "../dom";
import { LIMB_NAMES, LIMB_ORDER, type LimbState, performerCount } from "../limb-state";

export interface PerformerChooser {
  readonly element: HTMLElement;
  /** Shows the dancers of these limbs; hidden where there is but one. */
  render(limbs: readonly LimbState[], chosen: number): void;
}

export function createPerformerChooser(onChoose: (performer: number) => void): PerformerChooser {
  const chooser = element("div", { class: "dancers", role: "group", "aria-label": translate("Dancer"), hidden: true });
  const buttons: { button: HTMLElement; dots: HTMLElement[] }[] = [];
  const add = (performer: number) => {
    const dots = LIMB_ORDER.map(() => element("i"));
    const button = element(
      "button",
      { type: "button", onClick: () => onChoose(performer) },
      String(performer + 1),
      element("span", {}, ...dots),
    );
    buttons.push({ button, dots });
    chooser.append(button);
  };
  return {
    element: chooser,
    render(limbs, chosen) {
      const count = performerCount(limbs);
      chooser.hidden = count < 2;
      if (count < 2) return;
      while (buttons.length < count) add(buttons.length);
      buttons.forEach(({ button, dots }, performer) => {
        button.hidden = performer >= count;
        if (button.hidden) return;
        const held = LIMB_ORDER.map((part) => ({ part, holder: limbs[limbNumber(performer, part)].holder }));
        held.forEach(({ holder }, nth) =>
          setAttribute(dots[nth], "style", holder && `--colour: var(--holder-${holder.colour})`),
        );
        const told = held.flatMap(({ part, holder }) =>
          holder
            ? translate("{limb}: {name}", { limb: translate(LIMB_NAMES[part]).toLowerCase(), name: holder.name })
            : [],
        );
        button.setAttribute("aria-label", joinList([translate("Dancer {number}", { number: performer + 1 }), ...told]));
        button.setAttribute("aria-pressed", String(performer === chosen));
      });
    },
  };
}

/** A button of the dock: the chosen dancer's number; pressed, the next one is chosen. Hidden where there is but one. */
export function createNextPerformerButton(onPress: () => void, { translate } = pageTranslator): PerformerChooser {
  const button = element("button", { class: "next-dancer", type: "button", hidden: true, onClick: onPress });
  return {
    element: button,
    render(limbs, chosen) {
      const count = performerCount(limbs);
      button.hidden = count < 2;
      const number = chosen + 1;
      if (button.textContent !== String(number)) button.textContent = String(number);
      const name = translate("Dancer {number} of {count}: go to the next", { number, count });
      button.setAttribute("aria-label", name);
      button.title = name;
    },
  };
}
