/**
 * Selection of the performer that rows and keys act on: one button each, with a dot per limb in its holder's colour.
 */
import { joinList, pageTranslator, translate } from "../../i18n/translator";
import { limbNumber } from "../../wire/limbs";
import { element, setAttribute } from "../dom";
import { holderColour } from "../limb-display";
import { LIMB_NAMES, LIMB_ORDER, type LimbState, performerCount } from "../limb-state";

export interface PerformerChooser {
  readonly element: HTMLElement;
  /** Show the performers of these limbs. Hidden with a single performer. */
  render(limbs: readonly LimbState[], selected: number): void;
}

/** Create a button for each performer. */
export function createPerformerChooser(onChoose: (performer: number) => void): PerformerChooser {
  const chooser = element("div", { class: "dancers", role: "group", "aria-label": translate("Dancer"), hidden: true });
  const buttons: { button: HTMLElement; dots: HTMLElement[] }[] = [];
  const addButton = (performer: number) => {
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
    render(limbs, selected) {
      const count = performerCount(limbs);
      chooser.hidden = count < 2;
      if (count < 2) return;
      while (buttons.length < count) addButton(buttons.length);
      buttons.forEach(({ button, dots }, performer) => {
        button.hidden = performer >= count;
        if (button.hidden) return;
        const holders = LIMB_ORDER.map((part) => ({ part, holder: limbs[limbNumber(performer, part)].holder }));
        holders.forEach(({ holder }, i) =>
          setAttribute(dots[i], "style", holder && `--colour: ${holderColour(holder)}`),
        );
        const limbTexts = holders.flatMap(({ part, holder }) =>
          holder
            ? translate("{limb}: {name}", { limb: translate(LIMB_NAMES[part]).toLowerCase(), name: holder.name })
            : [],
        );
        button.setAttribute(
          "aria-label",
          joinList([translate("Dancer {number}", { number: performer + 1 }), ...limbTexts]),
        );
        button.setAttribute("aria-pressed", String(performer === selected));
      });
    },
  };
}

/** Create a button that shows the selected performer's number and selects the next one. */
export function createNextPerformerButton(onPress: () => void, { translate } = pageTranslator): PerformerChooser {
  const button = element("button", { class: "next-dancer", type: "button", hidden: true, onClick: onPress });
  return {
    element: button,
    render(limbs, selected) {
      const count = performerCount(limbs);
      button.hidden = count < 2;
      const number = selected + 1;
      if (button.textContent !== String(number)) button.textContent = String(number);
      const name = translate("Dancer {number} of {count}: go to the next", { number, count });
      button.setAttribute("aria-label", name);
      button.title = name;
    },
  };
}
