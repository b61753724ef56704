/** Panel: where the needle is, how hard it pushes, how it leans, and what it is. */

import { BEVEL_ANGLE_DEG, firmForce, needleShape, radiusMm } from "../model/tool";
import type { Settings } from "../model/settings";
import type { Page } from "../page";
import { Choice } from "./choice";
import { button, element, panel } from "./dom";
import { perFrame } from "../per_frame";
import { NumberControl, type NumberOptions } from "./number_control";

type NumberKey = "forceMn" | "xMm" | "yMm" | "tiltDeg" | "leanDeg" | "rollDeg";

const NUMBERS: readonly (Omit<NumberOptions, "change"> & { key: NumberKey; fields: string[] })[] = [
  {
    key: "forceMn",
    label: "Force",
    unit: "mN",
    min: 0,
    max: 3,
    step: 0.005,
    fieldMax: 100,
    fields: ["force_mn"],
  },
  {
    key: "xMm",
    label: "Tip x",
    unit: "mm",
    min: -1,
    max: 1,
    step: 0.01,
    fields: ["needle.tip_mm"],
  },
  {
    key: "yMm",
    label: "Tip y",
    unit: "mm",
    min: -1,
    max: 1,
    step: 0.01,
    fields: ["needle.tip_mm"],
  },
  {
    key: "tiltDeg",
    label: "Tilt",
    unit: "°",
    min: 0,
    max: 75,
    step: 1,
    fields: ["needle.direction", "needle.orientation_xyzw"],
  },
  { key: "leanDeg", label: "Leans to", unit: "°", min: -180, max: 180, step: 1, fields: [] },
  { key: "rollDeg", label: "Roll", unit: "°", min: -180, max: 180, step: 1, fields: [] },
];

export function pressPanel({ settings, session, complaints }: Page): void {
  const body = panel("press");
  const controls = new Map<NumberKey, NumberControl>();
  for (const { key, fields, ...options } of NUMBERS) {
    const change = (value: number): void => settings.patch({ [key]: value });
    const control = new NumberControl({ ...options, change });
    complaints.register(control, ...fields);
    controls.set(key, control);
    body.append(control.root);
    if (key === "forceMn") body.append(lower({ settings, session }));
  }
  const gauge = new Choice("Gauge", [], (gauge) => settings.patch({ gauge }));
  complaints.register(gauge, "needle.gauge", "needle.radius_mm");
  const tip = new Choice<Settings["tip"]>(
    "Tip",
    [
      { value: "hemispherical", text: "round", hint: "half a ball of the needle's radius" },
      { value: "flat", text: "flat", hint: "cut straight across, with a rounded edge" },
      { value: "bevelled", text: "bevelled", hint: "cut obliquely, with a rounded edge" },
    ],
    (tip) => settings.patch({ tip }),
  );
  complaints.register(tip, "needle.tip");
  const along = new Choice<Settings["along"]>(
    "Push",
    [
      { value: "needle", text: "along the shaft" },
      { value: "inward", text: "straight in, −z" },
    ],
    (along) => settings.patch({ along }),
  );
  const shape = element("div");
  body.append(gauge.root, tip.root, shape, along.root);

  let offered: unknown;
  const show = perFrame(() => {
    const now = settings.get();
    const { catalog } = session.get();
    if (catalog && catalog !== offered) {
      offered = catalog;
      const options = catalog.gauges.gauges.map(({ name, outer_diameter_mm, source }) => ({
        value: name,
        text: name,
        hint: `${outer_diameter_mm} mm across (${source})`,
      }));
      gauge.offer(options);
    }
    if (catalog) {
      const firm = firmForce(radiusMm(now, catalog.gauges));
      controls.get("forceMn")?.setMax(Math.max(firm, now.forceMn));
    }
    for (const [key, control] of controls) control.set(now[key]);
    gauge.set(now.gauge);
    tip.set(now.tip);
    along.set(now.along);
  });
  settings.follow(show);
  session.follow(({ catalog }, before) => {
    if (catalog !== before.catalog) show();
  });
  tipNumbers(shape, { settings, session, complaints });
}

/** A way back when the needle would puncture: the server says how much it takes. */
function lower({ settings, session }: Pick<Page, "settings" | "session">): HTMLElement {
  let most = 0;
  const back = button("", () => settings.patch({ forceMn: most }));
  back.hidden = true;
  session.follow(({ problem }) => {
    const error = problem?.errors?.find(({ field }) => field === "force_mn");
    const limit = /at most ([\d.]+) mN/.exec(error?.allowed ?? "");
    back.hidden = !limit;
    if (!limit) return;
    // What counts is the part of the force into the tissue, which the server names: in that ratio, and a little less for rounding.
    const { forceMn } = settings.get();
    const named = typeof error?.value === "number" && error.value > 0 ? error.value : forceMn;
    most = +(0.99 * Number.parseFloat(limit[1] ?? "0") * (forceMn / named)).toPrecision(2);
    back.textContent = `Set the force to ${most} mN`;
  });
  return back;
}

/** The numbers of a flat or bevelled tip. */
function tipNumbers(
  place: HTMLElement,
  { settings, session, complaints }: Pick<Page, "settings" | "session" | "complaints">,
): void {
  const made = new Map<string, NumberControl>();
  const show = perFrame(() => {
    const { catalog } = session.get();
    const now = settings.get();
    const prefix = `needle.tip.${now.tip}.`;
    const listed = catalog?.scenes.parameters.filter(({ field }) => field.startsWith(prefix)) ?? [];
    if (!catalog) return;
    const shape = needleShape(now, catalog.gauges);
    const controls = listed.map((parameter) => {
      const { field, name, unit, min, max, source } = parameter;
      const isAngle = field.endsWith("angle_deg");
      const known = made.get(field);
      const control =
        known ??
        new NumberControl({
          label: name,
          unit: isAngle ? "°" : unit,
          min,
          max: isAngle ? max : Math.min(max, shape.radiusMm),
          step: isAngle ? 1 : 0.001,
          hint: source,
          change: (value) =>
            settings.patch({ parameters: { ...settings.get().parameters, [field]: value } }),
        });
      if (!known) {
        made.set(field, control);
        complaints.register(control, field);
      }
      if (!isAngle) control.setMax(Math.min(max, shape.radiusMm));
      control.set(isAngle ? (now.parameters[field] ?? BEVEL_ANGLE_DEG) : shape.edgeRadiusMm);
      return control.root;
    });
    if (controls.length !== place.childElementCount || controls[0] !== place.firstElementChild) {
      place.replaceChildren(...controls);
    }
  });
  settings.follow(show);
  session.follow(({ catalog }, before) => {
    if (catalog !== before.catalog) show();
  });
}
