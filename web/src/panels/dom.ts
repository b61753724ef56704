/** Small parts that panels are made of. */

/** An element with attributes and children; a boolean attribute is there or not. */
export function element<K extends keyof HTMLElementTagNameMap>(
  name: K,
  attributes: Readonly<Record<string, string | boolean>> = {},
  ...children: (Node | string)[]
): HTMLElementTagNameMap[K] {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) {
    if (typeof value === "string") made.setAttribute(key, value);
    else made.toggleAttribute(key, value);
  }
  made.append(...children);
  return made;
}

/** The element with that id, which the page has. */
export function byId(id: string): HTMLElement {
  const found = document.getElementById(id);
  if (!found) throw new Error(`the page has no #${id}`);
  return found;
}

/** The body of a panel of the page. */
export function panel(name: string): HTMLElement {
  const details = document.querySelector(`[data-panel="${name}"]`);
  if (!details) throw new Error(`the page has no panel ${name}`);
  return details.appendChild(element("div", { class: "body" }));
}

/** Sets text only where it changed, so that nothing is laid out in vain. */
export function setText(where: Element, text: string): void {
  if (where.textContent !== text) where.textContent = text;
}

let ids = 0;
export const newId = (): string => `control-${++ids}`;

/** A button. */
export function button(text: string, press: () => void, hint?: string): HTMLButtonElement {
  const made = element("button", { type: "button", ...(hint ? { title: hint } : {}) }, text);
  made.addEventListener("click", press);
  return made;
}

/** A switch with its label. */
export function checkbox(
  text: string,
  change: (on: boolean) => void,
): { root: HTMLElement; set: (on: boolean) => void } {
  const box = element("input", { type: "checkbox" });
  box.addEventListener("change", () => change(box.checked));
  return { root: element("label", { class: "check" }, box, text), set: (on) => (box.checked = on) };
}
