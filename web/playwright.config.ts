import { defineConfig } from "@playwright/test";

import { browser } from "./tests/browser";

export default defineConfig({
  testDir: "tests",
  outputDir: "artefacts/results",
  // Two cores run server, browser and software rendering: pages beside each other would only wait for each other.
  workers: 1,
  timeout: 90_000,
  expect: { timeout: 20_000 },
  reporter: [["list"]],
  forbidOnly: true,
  use: {
    viewport: { width: 1280, height: 720 },
    launchOptions: browser,
    screenshot: "only-on-failure",
  },
});
