/** Small parts that charts are made of. */

const NAMESPACE = "http://www.w3.org/2000/svg";

/** An SVG element with attributes and text. */
export function shape<K extends keyof SVGElementTagNameMap>(
  name: K,
  attributes: Readonly<Record<string, string | number>>,
  text?: string,
): SVGElementTagNameMap[K] {
  const made = document.createElementNS(NAMESPACE, name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, String(value));
  if (text !== undefined) made.textContent = text;
  return made;
}

/** Words at a place, anchored there by their start, middle or end. */
export function words(
  text: string,
  x: number,
  y: number,
  anchor: "start" | "middle" | "end",
): SVGTextElement {
  return shape("text", { x, y, "text-anchor": anchor }, text);
}
