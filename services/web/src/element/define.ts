/** Script that registers `<bunraku-stage>`, once per page. */
import { BunrakuStage } from "./stage-element";

if (!customElements.get("bunraku-stage")) customElements.define("bunraku-stage", BunrakuStage);

export { BunrakuStage };
