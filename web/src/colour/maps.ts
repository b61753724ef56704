/** Colour maps: perceptually uniform for magnitudes, diverging for what has a sign. Values from 0 to 1. */

import type { Quantity } from "../model/settings";

export type Colour = readonly [number, number, number];

const parse = (hex: string): Colour => [
  Number.parseInt(hex.slice(0, 2), 16),
  Number.parseInt(hex.slice(2, 4), 16),
  Number.parseInt(hex.slice(4, 6), 16),
];
const stops = (text: string): Colour[] => text.split(" ").map(parse);

/**
 * Evenly spaced samples, in sRGB: mako, flare and rocket from light to dark, so that still tissue is light and its shading seen,
 * and blue to red over white.
 */
const MAPS: Record<Quantity, Colour[]> = {
  displacement: stops("def5e5 a8e1bc 60ceac 3baaa8 3487a6 37659e 413f7f 35264c 0b0405"),
  strain: stops("faf0dc f7d9a8 f3b87a ee935f e26953 cb4860 a63770 7b2d70 4b2362"),
  error: stops("faebdd f7c9aa f6a47b f37651 e84a3f cb1b4f a11a5b 701f57 35193e"),
  curvature: stops("2166ac 4393c3 92c5de d1e5f0 f7f7f7 fddbc7 f4a582 d6604d b2182b"),
};

/** The colour at `t`, sRGB from 0 to 255. */
export function colourAt(quantity: Quantity, t: number): Colour {
  const map = MAPS[quantity];
  const place = Math.min(1, Math.max(0, t)) * (map.length - 1);
  const index = Math.min(map.length - 2, Math.floor(place));
  const [low, high] = [map[index] ?? [0, 0, 0], map[index + 1] ?? [0, 0, 0]];
  const mix = (channel: 0 | 1 | 2): number =>
    Math.round(low[channel] + (place - index) * (high[channel] - low[channel]));
  return [mix(0), mix(1), mix(2)];
}

/** The same for a style sheet: the whole map from left to right. */
export function gradient(quantity: Quantity): string {
  const colours = MAPS[quantity].map((colour) => `rgb(${colour.join(" ")})`);
  return `linear-gradient(to right, ${colours.join(", ")})`;
}
