/** Creation of HTML and SVG elements. */

type Listener = (event: never) => void;
export type Attributes = Record<string, string | number | boolean | null | undefined | Listener>;

/**
 * Create an HTML element. Attributes that are `false` or `null` are omitted, `true` sets an empty attribute, and
 * functions named `on...` become event listeners.
 */
export function element<K extends keyof HTMLElementTagNameMap>(
  tag: K,
  attributes: Attributes = {},
  ...children: (Node | string)[]
): HTMLElementTagNameMap[K] {
  const created = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (typeof value === "function") created.addEventListener(name.slice(2).toLowerCase(), value as EventListener);
    else setAttribute(created, name, value);
  }
  created.append(...children);
  return created;
}

/**
 * Set an attribute, or remove it if the value is `false`, `null` or `undefined`. An unchanged value is not written
 * again: that would cost a style calculation.
 */
export function setAttribute(target: Element, name: string, value: string | number | boolean | null | undefined): void {
  const text = value === true ? "" : String(value);
  if (value === false || value === null || value === undefined) target.removeAttribute(name);
  // A style set by script is allowed under any content security policy of the embedding page.
  else if (name === "style") (target as HTMLElement).style.cssText = text;
  else if (target.getAttribute(name) !== text) target.setAttribute(name, text);
}

const SVG = "http://www.w3.org/2000/svg";

/** Create an SVG element. */
export function shape<K extends keyof SVGElementTagNameMap>(
  tag: K,
  attributes: Record<string, string | number> = {},
  ...children: Node[]
): SVGElementTagNameMap[K] {
  const created = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(attributes)) created.setAttribute(name, String(value));
  created.append(...children);
  return created;
}

/**
 * Set the text of a node. Unchanged text is not written again: that would cause a layout and a screen reader message.
 */
export function setText(target: Node, text: string): void {
  if (target.textContent !== text) target.textContent = text;
}
