import { defineConfig } from "vite";

const api = process.env["RETINA_SERVER"] ?? "http://127.0.0.1:8080";

export default defineConfig({
  build: {
    outDir: process.env["RETINA_PAGE_OUT"] ?? "dist",
    emptyOutDir: true,
    target: "es2022",
    // The page's content security policy allows neither data: scripts nor inline ones.
    assetsInlineLimit: 0,
    modulePreload: false,
    // Nearly all of it is three.js, which the page cannot do without.
    chunkSizeWarningLimit: 1000,
  },
  server: { proxy: { "/v1": api, "/healthz": api, "/openapi.json": api, "/docs": api } },
});
