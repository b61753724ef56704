/** `window.retina`: what the page shows, to be read by a test or in the browser's console. Nothing in it can be set. */

import { Matrix4, Vector3 } from "three";

import { errorsOnScreen } from "./compare";
import type { Comparison, Session } from "./model/session";
import type { Settings } from "./model/settings";
import type { PredictRequest, PredictResponse, Surface, Vector } from "./model/wire";
import type { Page } from "./page";
import type { Paint } from "./paint";

export interface Inspect {
  readonly settings: Settings;
  readonly connection: Session["connection"];
  /** The question that the surface on screen answers, and the answer. */
  readonly request: PredictRequest | undefined;
  readonly answer: PredictResponse | undefined;
  readonly rest: Surface | undefined;
  readonly problem: Session["problem"];
  readonly comparison: Comparison | undefined;
  /** Error of each node on screen, µm, where this pose was compared. */
  readonly errorsUm: number[] | undefined;
  /** Whether the newest settings were answered and the answer is drawn. */
  readonly settled: boolean;
  /** Answers taken and frames drawn so far. */
  readonly updates: number;
  readonly frames: number;
  /** Where the nodes stand in the 3-D scene, mm. */
  readonly drawnNodesMm: Vector[];
  /** Where a point of the scene is in the window, CSS pixels. */
  inWindow(pointMm: Vector): { x: number; y: number };
}

declare global {
  interface Window {
    retina: Inspect;
  }
}

export function inspect({ settings, session, stage, live }: Page, paint: Paint): void {
  window.retina = {
    get settings() {
      return settings.get();
    },
    get connection() {
      return session.get().connection;
    },
    get request() {
      return session.get().shown?.request;
    },
    get answer() {
      return session.get().shown?.answer;
    },
    get rest() {
      return session.get().shown?.rest;
    },
    get problem() {
      return session.get().problem;
    },
    get comparison() {
      return session.get().comparison;
    },
    get errorsUm() {
      return errorsOnScreen(session.get());
    },
    get settled() {
      const { shown } = session.get();
      return live.loop.idle && shown !== undefined && paint.drawn === shown;
    },
    get updates() {
      return session.get().updates;
    },
    get frames() {
      return stage.view.frames;
    },
    get drawnNodesMm() {
      const nodes = stage.drawnNodes();
      const [matrix, point] = [new Matrix4(), new Vector3()];
      return Array.from({ length: nodes?.count ?? 0 }, (_, index): Vector => {
        nodes?.getMatrixAt(index, matrix);
        return point.setFromMatrixPosition(matrix).toArray();
      });
    },
    inWindow(pointMm) {
      const { x, y } = stage.view.onCanvas(new Vector3(...pointMm));
      const box = stage.view.renderer.domElement.getBoundingClientRect();
      return { x: box.left + x, y: box.top + y };
    },
  };
}
