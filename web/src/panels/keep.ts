/** Panel: the pose as a link; request and answer, surface and view as files. */

import type { Paint } from "../paint";
import type { Page } from "../page";
import { download, json, ply, png } from "../save/files";
import { button, element, panel } from "./dom";

export interface Keep {
  json: () => void;
  ply: () => void;
  png: () => Promise<void>;
  link: () => Promise<void>;
}

export function keepPanel({ settings, session, stage }: Page, paint: Paint): Keep {
  const said = element("p", { class: "note", role: "status" });
  const keep: Keep = {
    json: () => {
      if (session.get().shown)
        download("retina.json", new Blob([json(session.get())], { type: "application/json" }));
    },
    ply: () => {
      const { shown } = session.get();
      if (shown)
        download("retina.ply", new Blob([ply(shown, session.get())], { type: "text/plain" }));
    },
    png: async () => {
      const { shown } = session.get();
      if (!shown) return;
      stage.view.draw();
      const { request, answer } = shown;
      const force = Math.hypot(...(request.force_mn ?? [0])).toFixed(3);
      const caption = `${request.needle.gauge ?? ""}, ${force} mN, ${settings.get().scene}, level ${answer.accuracy.level}`;
      const { quantity, scale } = paint.current();
      const picture = await png(stage.view.renderer.domElement, quantity, scale, caption);
      if (picture) download("retina.png", picture);
    },
    link: async () => {
      try {
        await navigator.clipboard.writeText(location.href);
        said.textContent = "The link to this pose is in the clipboard.";
      } catch {
        said.textContent = "The address bar holds the link to this pose.";
      }
    },
  };
  const files = element(
    "div",
    { class: "buttons" },
    button("Copy link", () => void keep.link(), "the address of this page holds the whole pose"),
    button("JSON", keep.json, "request and answer"),
    button("PLY", keep.ply, "the deformed surface with normals and displacement"),
    button("PNG", () => void keep.png(), "the view with its colour scale"),
  );
  panel("keep").append(files, said);
  return keep;
}
