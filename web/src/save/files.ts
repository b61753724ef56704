/** What can be saved, as text or picture. */

import { gradient } from "../colour/maps";
import { figures, LABELS, type Scale } from "../colour/scale";
import { errorsOnScreen } from "../compare";
import type { Session, Shown } from "../model/session";
import type { Quantity } from "../model/settings";

/** Hands a file to the browser. */
export function download(name: string, content: Blob): void {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(content);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
}

/** Request and answer, and the comparison when there is one. */
export function json({ shown, comparison }: Session): string {
  const { request, answer } = shown ?? {};
  return JSON.stringify({ request, answer, ...(comparison ? { comparison } : {}) }, null, 1);
}

/** The deformed surface, mm, with normals and each node's displacement (and error, when compared) in µm. */
export function ply(shown: Shown, session: Session): string {
  const { vertices_mm, normals, triangles, displacement_um } = shown.answer.surface;
  const errors = errorsOnScreen(session);
  const columns = [
    "x",
    "y",
    "z",
    "nx",
    "ny",
    "nz",
    "displacement_um",
    ...(errors ? ["error_um"] : []),
  ];
  const nodes = vertices_mm.map((node, index) => {
    const error = errors ? [errors[index] ?? 0] : [];
    return [...node, ...(normals[index] ?? []), displacement_um[index] ?? 0, ...error].join(" ");
  });
  return [
    "ply",
    "format ascii 1.0",
    `comment retina surface in mm, level ${shown.answer.accuracy.level}`,
    `element vertex ${nodes.length}`,
    ...columns.map((name) => `property double ${name}`),
    `element face ${triangles.length}`,
    "property list uchar int vertex_indices",
    "end_header",
    ...nodes,
    ...triangles.map((triangle) => `3 ${triangle.join(" ")}`),
    "",
  ].join("\n");
}

/** The view with its legend; `canvas` must just have been drawn. */
export async function png(
  canvas: HTMLCanvasElement,
  quantity: Quantity,
  scale: Scale,
  caption: string,
): Promise<Blob | null> {
  const picture = document.createElement("canvas");
  [picture.width, picture.height] = [canvas.width, canvas.height];
  const pen = picture.getContext("2d");
  if (!pen) return null;
  const style = getComputedStyle(document.body);
  pen.fillStyle = style.getPropertyValue("--stage");
  pen.fillRect(0, 0, picture.width, picture.height);
  pen.drawImage(canvas, 0, 0);
  const unit = canvas.width / canvas.clientWidth;
  pen.scale(unit, unit);
  const [left, top, width] = [16, picture.height / unit - 34, 220];
  const colours = gradient(quantity).match(/rgb\([^)]*\)/g) ?? [];
  const fill = pen.createLinearGradient(left, 0, left + width, 0);
  colours.forEach((colour, index) => fill.addColorStop(index / (colours.length - 1), colour));
  pen.fillStyle = fill;
  pen.fillRect(left, top, width, 10);
  pen.fillStyle = style.getPropertyValue("--ink");
  pen.font = `12px ${style.fontFamily}`;
  pen.fillText(`${LABELS[quantity].title}, ${LABELS[quantity].unit}`, left, top - 6);
  pen.fillText(figures(scale.min), left, top + 24);
  pen.textAlign = "right";
  pen.fillText(figures(scale.max), left + width, top + 24);
  pen.textAlign = "left";
  pen.fillText(caption, left, 24);
  return new Promise((resolve) => picture.toBlob(resolve));
}
