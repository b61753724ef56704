/** Panel: what is painted on the surface, and which layers are drawn. */

import { LABELS } from "../colour/scale";
import { LAYERS, QUANTITIES, type Layer } from "../model/settings";
import type { Page } from "../page";
import { Choice } from "./choice";
import { checkbox, element, panel } from "./dom";

const LAYER_NAMES: Record<Layer, string> = {
  triangles: "triangles",
  nodes: "nodes",
  normals: "normals",
  rest: "rest surface",
  needle: "needle and force",
  curved: "curved between nodes",
};

export function colourPanel({ settings }: Page): void {
  const body = panel("colour");
  const options = QUANTITIES.map((value) => {
    const { title, unit, note } = LABELS[value];
    return {
      value,
      text: title.replace("Mean ", "").replace("Surface ", "").toLowerCase(),
      hint: `${note} (${unit})`,
    };
  });
  const quantity = new Choice("Colour", options, (quantity) => settings.patch({ quantity }));
  const boxes = LAYERS.map((layer) => {
    const box = checkbox(LAYER_NAMES[layer], (on) =>
      settings.patch({ layers: { ...settings.get().layers, [layer]: on } }),
    );
    return { layer, ...box };
  });
  const layers = element("div", { class: "checks" }, ...boxes.map(({ root }) => root));
  body.append(quantity.root, layers);
  settings.follow(({ quantity: chosen, layers }) => {
    quantity.set(chosen);
    for (const { layer, set } of boxes) set(layers[layer]);
  });
}
