/** Part of a panel: what a scene may have that calls for an effect: friction, the eye's pressure, the bond, fluid under the retina. */

import { figures } from "../colour/scale";
import { numberAt } from "../model/paths";
import type { Parameter } from "../model/wire";
import type { Page } from "../page";
import { element, setText } from "./dom";
import { NumberControl } from "./number_control";
import { perFrame } from "../per_frame";

/** One millimetre of mercury, kPa: pressures of eyes are told in mmHg. */
const MMHG_KPA = 0.133322;

interface Condition {
  field: string;
  label: string;
  unit: string;
  /** What one unit of the control is in the unit of the wire. */
  inWire: number;
  step: number;
  /** The server's name for nothing: the field is then left out, and what belongs to it. */
  none?: number;
}

const VOLUME = "scene.bleb.volume_mm3";
const RADIUS = "scene.bleb.radius_mm";

const CONDITIONS: readonly Condition[] = [
  {
    field: "scene.friction_coefficient",
    label: "Friction",
    unit: "",
    inWire: 1,
    step: 0.01,
  },
  {
    field: "scene.pressure_kpa",
    label: "Eye pressure",
    unit: "mmHg",
    inWire: MMHG_KPA,
    step: 0.5,
  },
  {
    field: "scene.rest_pressure_kpa",
    label: "Rest pressure",
    unit: "mmHg",
    inWire: MMHG_KPA,
    step: 0.5,
  },
  {
    field: "scene.tissue.bond.strength_kpa",
    label: "Bond strength",
    unit: "kPa",
    inWire: 1,
    step: 0.5,
  },
  {
    field: VOLUME,
    label: "Fluid volume",
    unit: "µl",
    inWire: 1,
    step: 0.005,
    none: 0,
  },
  { field: RADIUS, label: "Fluid radius", unit: "mm", inWire: 1, step: 0.05 },
];

/** Whether a number of the scene has its control here. */
export const isCondition = (field: string): boolean =>
  CONDITIONS.some((condition) => condition.field === field) || field.startsWith("scene.bleb.");

/** The controls, made when the server has told the ranges. */
export function conditions({ settings, session, complaints }: Page): HTMLElement {
  const root = element("section", { class: "conditions" }, element("h3", {}, "What the scene has"));
  const fluid = element("p", { class: "note", id: "fluid" });
  const made = new Map<Condition, { control: NumberControl; usual: number }>();

  const change = ({ field, inWire, none }: Condition, value: number): void => {
    const { [field]: _, ...others } = settings.get().parameters;
    if (value !== none) {
      settings.patch({ parameters: { ...others, [field]: +(value * inWire).toPrecision(6) } });
      return;
    }
    const { [RADIUS]: __, ...without } = others;
    settings.patch({ parameters: without });
  };
  const make = (listed: readonly Parameter[]): void => {
    for (const condition of CONDITIONS) {
      const parameter = listed.find(({ field }) => field === condition.field);
      if (!parameter || made.has(condition)) continue;
      const { label, unit, inWire, step, none } = condition;
      const [min, max] = [parameter.min / inWire, parameter.max / inWire];
      const control = new NumberControl({
        label,
        unit,
        min: +min.toPrecision(4),
        max: +max.toPrecision(4),
        step,
        hint: `${parameter.name}: ${+min.toPrecision(3)} to ${+max.toPrecision(3)} ${unit}. ${parameter.source}`,
        change: (value) => change(condition, value),
      });
      complaints.register(control, condition.field);
      made.set(condition, { control, usual: none ?? parameter.default });
      root.append(control.root, fluid);
    }
  };
  const show = perFrame(() => {
    const { catalog } = session.get();
    if (!catalog) return;
    make(catalog.scenes.parameters);
    const { scene, parameters } = settings.get();
    const spec = catalog.scenes.scenes.find(({ name }) => name === scene)?.scene ?? {};
    for (const [{ field, inWire }, { control, usual }] of made) {
      control.set((parameters[field] ?? numberAt(spec, field) ?? usual) / inWire);
      if (field === RADIUS) control.root.hidden = parameters[VOLUME] === undefined;
    }
    const bleb = session.get().shown?.answer.contact.bleb;
    setText(
      fluid,
      bleb
        ? `Fluid of ${figures(bleb.volume_mm3)} µl, ${figures(bleb.pressure_mmhg)} mmHg (${figures(bleb.pressure_kpa)} kPa) above the eye`
        : "",
    );
  });
  settings.follow(show);
  session.follow(({ catalog, shown }, before) => {
    if (catalog !== before.catalog || shown !== before.shown) show();
  });
  return root;
}
