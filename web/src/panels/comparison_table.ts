/** The comparison as a table: every level at this pose, with time and error side by side. */

import { figures } from "../colour/scale";
import { poseKey, type Session } from "../model/session";
import { element } from "./dom";

const HEADINGS = ["level", "compute ms", "MAE µm", "p99 µm", "max µm"];

export function comparisonTable({ shown, comparison, comparisonProblem }: Session): HTMLElement[] {
  if (comparisonProblem) {
    return [element("p", { class: "complaint" }, `No reference: ${comparisonProblem.detail}`)];
  }
  if (!shown || !comparison) return [];
  if (comparison.key !== poseKey(shown.request)) {
    return [element("p", { class: "note" }, "The pose has moved since; compare again.")];
  }
  const head = HEADINGS.map((text) => element("th", { scope: "col" }, text));
  const rows = comparison.rows.map(({ level, computeMs, errors }) => {
    const cells = [computeMs, errors.meanUm, errors.p99Um, errors.maxUm].map((value) =>
      element("td", {}, figures(value)),
    );
    const current = level === shown.answer.accuracy.level;
    return element(
      "tr",
      { class: current ? "current" : "" },
      element("th", { scope: "row" }, level),
      ...cells,
    );
  });
  const nodes = shown.answer.surface.vertices_mm.length;
  const motion = `RMS displacement at this pose: ${figures(comparison.motionUm)} µm.`;
  return [
    element(
      "table",
      { id: "comparison" },
      element("thead", {}, element("tr", {}, ...head)),
      element("tbody", {}, ...rows),
    ),
    element(
      "p",
      { class: "note" },
      `Distance of the ${nodes} nodes from those of reference. ${motion}`,
    ),
  ];
}
