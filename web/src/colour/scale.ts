/** The numbers at the ends of a colour scale: round ones, that do not flicker while the hand moves. */

import type { Quantity } from "../model/settings";

export interface Scale {
  min: number;
  max: number;
}

export const LABELS: Record<Quantity, { title: string; unit: string; note: string }> = {
  displacement: { title: "Displacement", unit: "µm", note: "how far each node moved from rest" },
  curvature: {
    title: "Mean curvature",
    unit: "1/mm",
    note: "positive where hollow towards the vitreous",
  },
  strain: {
    title: "Surface strain",
    unit: "%",
    note: "largest principal strain of the drawn triangles against rest",
  },
  error: {
    title: "Error",
    unit: "µm",
    note: "distance of each node from level reference at this pose",
  },
};

/** A scale shrinks only when less than this share of it is used. */
const SHRINK_BELOW = 0.35;

/** Values below these are noise and do not deserve the whole colour map. */
const SMALLEST: Record<Quantity, number> = {
  displacement: 1,
  curvature: 0.2,
  strain: 0.5,
  error: 0.1,
};

/** The next of 1, 1.5, 2, 3, 5, 7, 10 … that is not below `value`. */
export function roundUp(value: number): number {
  const power = 10 ** Math.floor(Math.log10(value));
  const step = [1, 1.5, 2, 3, 5, 7].find((step) => step * power >= value * (1 - 1e-9));
  return (step ?? 10) * power;
}

/** The scale for these values after one that was shown before. */
export function scaleFor(
  quantity: Quantity,
  values: readonly number[],
  before: Scale | undefined,
): Scale {
  const largest = values.reduce((most, value) => Math.max(most, Math.abs(value)), 0);
  const used = Math.max(largest, SMALLEST[quantity]);
  const keep = before !== undefined && used <= before.max && used >= SHRINK_BELOW * before.max;
  const max = keep ? before.max : roundUp(used);
  return { min: quantity === "curvature" ? -max : 0, max };
}

/** A number as a person writes it: three figures, no needless zeros. */
export function figures(value: number, count = 3): string {
  if (value === 0) return "0";
  const text = Math.abs(value) >= 10 ** count ? value.toFixed(0) : value.toPrecision(count);
  return text.includes(".") && !text.includes("e") ? text.replace(/\.?0+$/, "") : text;
}
