/** The mesh of the puppet. It needs no renderer: it can be built while that is still loading. */
import type { BufferGeometry } from "three";
import { type Figure, figureKey } from "../../motion/skeleton";
import { BONES } from "./bones";
import { fitToFigure } from "./figure-fit";
import { GeometryBuilder } from "./geometry-builder";
import { addArms } from "./parts/arms";
import { addBodice } from "./parts/bodice";
import { addHakama } from "./parts/hakama";
import { addHands } from "./parts/hands";
import { addHead } from "./parts/head";
import { addLegs } from "./parts/legs";
import { addSleeves } from "./parts/sleeves";
import type { Detail } from "./surface";

/** Mesh that was built ahead, and what it was built for. */
let prepared: { readonly key: string; readonly geometry: BufferGeometry } | null = null;

/** Build all parts on a figure in its rest pose. */
export function buildPuppetGeometry(figure: Figure, detail: Detail): BufferGeometry {
  const builder = new GeometryBuilder(BONES, fitToFigure(figure), detail);
  for (const add of [addLegs, addArms, addHands, addHead, addBodice, addHakama, addSleeves]) add(builder);
  return builder.build();
}

/** Build the mesh that `takePuppetGeometry` will be asked for first. */
export function preparePuppetGeometry(figure: Figure, detail: Detail): void {
  const key = keyOf(figure, detail);
  if (prepared?.key !== key) prepared = { key, geometry: buildPuppetGeometry(figure, detail) };
}

/** Return a new mesh, or the prepared one, once. */
export function takePuppetGeometry(figure: Figure, detail: Detail): BufferGeometry {
  const ahead = prepared;
  prepared = null;
  return ahead?.key === keyOf(figure, detail) ? ahead.geometry : buildPuppetGeometry(figure, detail);
}

function keyOf(figure: Figure, detail: Detail): string {
  return `${detail} ${figureKey(figure)}`;
}
