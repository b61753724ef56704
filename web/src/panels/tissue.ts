/** Panel: the scene and the numbers of its tissue, as the server lists them. */

import { numberAt } from "../model/paths";
import type { Parameter, SceneSpec } from "../model/wire";
import type { Page } from "../page";
import { Choice } from "./choice";
import { isCondition } from "./conditions";
import { button, checkbox, element, panel } from "./dom";
import { perFrame } from "../per_frame";
import { NumberControl } from "./number_control";

/** What depends on time has no part in a single equilibrium, which is all that the page asks for. */
const OF_TIME = "scene.tissue.rate.";
const MEMBRANE = "scene.tissue.inner_limiting_membrane.";

/** `scene.tissue.retina.thickness_mm` belongs to `retina`. */
const groupOf = (field: string): string => field.split(".").at(-2)?.replaceAll("_", " ") ?? "";

export function tissuePanel(page: Page): void {
  const { settings, session, complaints } = page;
  const body = panel("tissue");
  const scenes = new Choice("Scene", [], (scene) => settings.patch({ scene, parameters: {} }));
  complaints.register(scenes, "scene");
  const membrane = checkbox("with an inner limiting membrane", (on) => {
    const others = Object.entries(settings.get().parameters).filter(
      ([f]) => !f.startsWith(MEMBRANE),
    );
    const listed = session.get().catalog?.scenes.parameters ?? [];
    const added = listed.filter(({ field }) => on && field.startsWith(MEMBRANE));
    const numbers = added.map(({ field, default: value }) => [field, value] as const);
    settings.patch({ parameters: Object.fromEntries([...others, ...numbers]) });
  });
  const numbers = element("div");
  const reset = button("The scene's own numbers", () => settings.patch({ parameters: {} }));
  body.append(scenes.root, membrane.root, numbers, reset);

  const made = new Map<string, NumberControl>();
  let key = "";
  const show = perFrame(() => {
    const { catalog } = session.get();
    if (!catalog) return;
    const now = settings.get();
    const spec = catalog.scenes.scenes.find(({ name }) => name === now.scene)?.scene ?? {};
    const hasMembrane = Object.keys(now.parameters).some((field) => field.startsWith(MEMBRANE));
    const listed = catalog.scenes.parameters.filter(
      ({ field }) =>
        !field.startsWith(OF_TIME) &&
        !isCondition(field) &&
        (numberAt(spec, field) !== undefined || (hasMembrane && field.startsWith(MEMBRANE))),
    );
    const wanted = [now.scene, ...listed.map(({ field }) => field)].join(" ");
    if (wanted !== key) {
      key = wanted;
      scenes.offer(catalog.scenes.scenes.map(({ name }) => ({ value: name, text: name })));
      numbers.replaceChildren(
        ...groups(listed, (parameter) => control(page, made, parameter).root),
      );
    }
    scenes.set(now.scene);
    membrane.set(hasMembrane);
    reset.disabled = Object.keys(now.parameters).length === 0;
    for (const { field, default: usual } of listed)
      made.get(field)?.set(value(now.parameters, spec, field, usual));
  });
  settings.follow(show);
  session.follow(({ catalog }, before) => {
    if (catalog !== before.catalog) show();
  });
}

const value = (
  changed: Readonly<Record<string, number>>,
  spec: SceneSpec,
  field: string,
  usual: number,
): number => changed[field] ?? numberAt(spec, field) ?? usual;

function control(
  { settings, complaints }: Page,
  made: Map<string, NumberControl>,
  parameter: Parameter,
): NumberControl {
  const { field, name, unit, min, max, source } = parameter;
  const known = made.get(field);
  if (known) return known;
  const control = new NumberControl({
    label: name,
    unit: unit === "1" ? "" : unit,
    min,
    max,
    step: 10 ** Math.floor(Math.log10((max - min) / 100)),
    hint: `${min} to ${max} ${unit === "1" ? "" : unit}. ${source}`,
    change: (value) =>
      settings.patch({ parameters: { ...settings.get().parameters, [field]: value } }),
  });
  complaints.register(control, field);
  made.set(field, control);
  return control;
}

/** The parameters under a heading for each layer. */
function groups(
  listed: readonly Parameter[],
  make: (parameter: Parameter) => HTMLElement,
): HTMLElement[] {
  const names = [...new Set(listed.map(({ field }) => groupOf(field)))];
  return names.map((name) => {
    const members = listed.filter(({ field }) => groupOf(field) === name).map(make);
    return element("section", {}, element("h3", {}, name), ...members);
  });
}
