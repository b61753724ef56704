/** A number with its unit: a slider for the hand, a field for the exact value. */

import { figures } from "../colour/scale";
import type { Complainer } from "./complaints";
import { element, newId } from "./dom";

export interface NumberOptions {
  label: string;
  unit: string;
  min: number;
  max: number;
  step: number;
  /** Bounds of the field where they are wider than the slider's. */
  fieldMax?: number;
  hint?: string;
  change: (value: number) => void;
}

/** Steps of a slider whose ends are orders of magnitude apart. */
const LOG_STEPS = 400;
/** Beyond this ratio of its ends a slider is logarithmic. */
const LOG_ABOVE = 60;

export class NumberControl implements Complainer {
  readonly root: HTMLElement;
  private readonly slider: HTMLInputElement;
  private readonly field: HTMLInputElement;
  private readonly complaint = element("p", { class: "complaint", hidden: true });
  private readonly logarithmic: boolean;

  constructor(private options: NumberOptions) {
    const { label, unit, min, max, hint, change } = options;
    const [id, complaintId] = [newId(), newId()];
    this.logarithmic = min > 0 && max / min > LOG_ABOVE;
    this.complaint.id = complaintId;
    const described = { "aria-describedby": complaintId };
    this.slider = element("input", {
      type: "range",
      "aria-label": `${label}, ${unit}`,
      ...described,
    });
    this.field = element("input", { type: "number", id, ...described });
    this.setMax(max);
    this.slider.addEventListener("input", () => change(this.fromSlider()));
    this.field.addEventListener("change", () => {
      const value = this.field.valueAsNumber;
      if (Number.isFinite(value)) change(value);
    });
    const title = hint ? { title: hint } : {};
    const name = element("label", { for: id, ...title }, label);
    const value = element("span", { class: "value" }, this.field, element("span", {}, unit));
    this.root = element("div", { class: "number" }, name, this.slider, value, this.complaint);
  }

  set(value: number): void {
    const { min } = this.options;
    const place = this.logarithmic
      ? (LOG_STEPS * Math.log(value / min)) / Math.log(this.options.max / min)
      : value;
    this.slider.value = String(place);
    if (document.activeElement !== this.field) this.field.value = figures(value, 4);
  }

  /** Moves the end of the slider. */
  setMax(max: number): void {
    this.options = { ...this.options, max };
    const { min, step, fieldMax } = this.options;
    const ends = this.logarithmic ? [0, LOG_STEPS, 1] : [min, max, step];
    [this.slider.min, this.slider.max, this.slider.step] = ends.map(String) as [
      string,
      string,
      string,
    ];
    this.field.min = String(min);
    this.field.max = String(fieldMax ?? max);
    this.field.step = "any";
  }

  complain(text: string | undefined): void {
    this.complaint.hidden = text === undefined;
    this.complaint.textContent = text ?? "";
    this.root.classList.toggle("wrong", text !== undefined);
  }

  private fromSlider(): number {
    const { min, max } = this.options;
    const place = this.slider.valueAsNumber;
    if (!this.logarithmic) return place;
    return +(min * (max / min) ** (place / LOG_STEPS)).toPrecision(3);
  }
}
