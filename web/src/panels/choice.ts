/** One of a few: buttons side by side, of which one is down. */

import type { Complainer } from "./complaints";
import { element, newId } from "./dom";

export interface Option<T extends string> {
  value: T;
  text: string;
  hint?: string;
}

export class Choice<T extends string> implements Complainer {
  readonly root: HTMLElement;
  private readonly inputs = new Map<T, HTMLInputElement>();
  private readonly row: HTMLElement;
  private readonly name = newId();
  private readonly complaint = element("p", { class: "complaint", hidden: true });

  constructor(
    label: string,
    options: readonly Option<T>[],
    private readonly change: (value: T) => void,
  ) {
    this.row = element("div", { class: "options" });
    const group = { class: "choice", role: "radiogroup", "aria-label": label };
    this.root = element("div", group, element("span", {}, label), this.row, this.complaint);
    this.offer(options);
  }

  /** Replaces what there is to choose from. */
  offer(options: readonly Option<T>[]): void {
    this.inputs.clear();
    const labels = options.map(({ value, text, hint }) => {
      const input = element("input", { type: "radio", name: this.name, value });
      input.addEventListener("change", () => this.change(value));
      this.inputs.set(value, input);
      return element("label", hint ? { title: hint } : {}, input, element("span", {}, text));
    });
    this.row.replaceChildren(...labels);
  }

  set(value: T | undefined): void {
    for (const [option, input] of this.inputs) input.checked = option === value;
  }

  complain(text: string | undefined): void {
    this.complaint.hidden = text === undefined;
    this.complaint.textContent = text ?? "";
  }
}
