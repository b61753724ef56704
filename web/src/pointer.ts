/** The hand: press the tissue to place the tip, drag down to push, with Shift to slide. Beside the tissue it turns the view. */

import { firmForce, radiusMm } from "./model/tool";
import type { Page } from "./page";

/** Pixels of a drag from no force to a firm one. */
const STROKE_PX = 320;
const round = (value: number, step: number): number =>
  +(Math.round(value / step) * step).toFixed(4);

export function pointer({ settings, session, stage }: Page): void {
  const canvas = stage.view.renderer.domElement;
  let drag: { id: number; y: number; force: number } | undefined;

  const place = (event: PointerEvent): void => {
    const point = stage.tissueAt(event.clientX, event.clientY);
    if (point) settings.patch({ xMm: round(point.x, 0.001), yMm: round(point.y, 0.001) });
  };
  // In the capture phase: the camera must not turn while the tissue is pressed.
  const begin = (event: PointerEvent): void => {
    if (event.button !== 0 || drag) return;
    const onNeedle = stage.needleAt(event.clientX, event.clientY);
    if (!onNeedle && !stage.tissueAt(event.clientX, event.clientY)) return;
    event.stopImmediatePropagation();
    canvas.focus({ preventScroll: true });
    canvas.setPointerCapture(event.pointerId);
    if (!onNeedle) place(event);
    drag = { id: event.pointerId, y: event.clientY, force: settings.get().forceMn };
  };
  const move = (event: PointerEvent): void => {
    const { catalog } = session.get();
    if (!catalog) return;
    if (!drag) {
      if (event.pointerType === "mouse" && event.buttons === 0) {
        const over =
          stage.needleAt(event.clientX, event.clientY) ||
          stage.tissueAt(event.clientX, event.clientY);
        canvas.style.cursor = over ? "crosshair" : "grab";
      }
      return;
    }
    if (event.pointerId !== drag.id) return;
    event.stopImmediatePropagation();
    if (event.shiftKey) {
      place(event);
      drag = { ...drag, y: event.clientY, force: settings.get().forceMn };
      return;
    }
    const firm = firmForce(radiusMm(settings.get(), catalog.gauges));
    const force = drag.force + ((event.clientY - drag.y) / STROKE_PX) * firm;
    settings.patch({ forceMn: round(Math.max(0, force), firm > 0.5 ? 0.005 : 0.0005) });
  };
  const end = (event: PointerEvent): void => {
    if (event.pointerId === drag?.id) drag = undefined;
  };
  canvas.addEventListener("pointerdown", begin, { capture: true });
  // Where the browser tells of the hand more often than it draws, the answer may follow more often too.
  const moves = "onpointerrawupdate" in canvas ? "pointerrawupdate" : "pointermove";
  canvas.addEventListener(moves as "pointermove", move, { capture: true });
  canvas.addEventListener("pointerup", end);
  canvas.addEventListener("pointercancel", end);
}
