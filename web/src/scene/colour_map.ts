/** Colour maps as textures: numbers are interpolated between nodes, and only then become colours. */

import { DataTexture, LinearFilter, SRGBColorSpace } from "three";

import { colourAt } from "../colour/maps";
import type { Quantity } from "../model/settings";

const WIDTH = 256;
const textures = new Map<Quantity, DataTexture>();

export function colourMap(quantity: Quantity): DataTexture {
  const known = textures.get(quantity);
  if (known) return known;
  const pixels = new Uint8Array(4 * WIDTH);
  for (let x = 0; x < WIDTH; x++) pixels.set([...colourAt(quantity, x / (WIDTH - 1)), 255], 4 * x);
  const texture = new DataTexture(pixels, WIDTH, 1);
  texture.colorSpace = SRGBColorSpace;
  texture.minFilter = texture.magFilter = LinearFilter;
  texture.needsUpdate = true;
  textures.set(quantity, texture);
  return texture;
}
