/** Dialog of keys and gamepad whose code is loaded when it is first opened. */
import { DEFAULT_MAPPING, type Mapping } from "../../input/mapping";
import type { MappingDialog } from "./mapping-dialog";

/** Create the dialog. `onShow` is called when it was opened, `onLoadError` if its code cannot be loaded. */
export function createLazyMappingDialog(
  root: HTMLElement,
  onChange: (mapping: Mapping) => void,
  onShow: () => void,
  onLoadError: () => void,
): MappingDialog {
  let dialog: MappingDialog | null = null;
  let loading: Promise<void> | null = null;
  let mapping = DEFAULT_MAPPING;
  const show = (shown: MappingDialog) => {
    shown.show();
    onShow();
  };
  const load = async () => {
    const { createMappingDialog } = await import("./mapping-dialog");
    dialog = createMappingDialog(root, onChange);
    dialog.setMapping(mapping);
    show(dialog);
  };
  return {
    show() {
      if (dialog) show(dialog);
      else
        loading ??= load()
          .catch(onLoadError)
          .finally(() => (loading = null));
    },
    get isOpen() {
      return dialog?.isOpen ?? false;
    },
    get isCapturing() {
      return dialog?.isCapturing ?? false;
    },
    updateGamepad: (pad) => dialog?.updateGamepad(pad),
    setMapping(current) {
      mapping = current;
      dialog?.setMapping(current);
    },
  };
}
