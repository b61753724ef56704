import { defineConfig } from "@playwright/test";

import tests from "./playwright.config";

/** Takes the picture of the README. */
export default defineConfig(tests, {
  testDir: "picture",
  use: { viewport: { width: 1120, height: 660 } },
});
