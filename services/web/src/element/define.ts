/** The script of `<bunraku-stage>`: makes the element known to the page, once. */
import { BunrakuStage } from "./stage-element";

if (!customElements.get("bunraku-stage")) customElements.define("bunraku-stage", BunrakuStage);

export { BunrakuStage };
