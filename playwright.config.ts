import { defineConfig, devices } from '@playwright/test';
import { findHeadlessChromium } from './scripts/steps.mjs';

/** The built page, as `npm run build` left it in www/dist, is what the end-to-end tests open. E2E_PORT tells them where. */
const PORT = Number(process.env.E2E_PORT ?? 4173);

export default defineConfig({
  testDir: 'tests/e2e',
  outputDir: 'test-results',
  // Bounds, no waits: on a machine with other work an answer takes long. The slowest test takes half a minute alone.
  timeout: 300_000,
  expect: { timeout: 30_000 },
  fullyParallel: true,
  workers: 2,
  forbidOnly: Boolean(process.env.CI),
  reporter: [['list'], ...(process.env.E2E_REPORT ? [['json', { outputFile: process.env.E2E_REPORT }] as const] : [])],
  use: {
    ...devices['Desktop Chrome'],
    baseURL: `http://localhost:${PORT}/`,
    // A trace of every test is a third of all work: `npx playwright test --trace on NAME` records one.
    trace: 'off',
    screenshot: 'only-on-failure',
    launchOptions: {
      executablePath: findHeadlessChromium() ?? 'chromium',
      // As root, as in most containers, Chromium's sandbox cannot start; the pages opened are our own.
      args: [
        '--no-sandbox',
        // Without a graphics card, drawing straight away costs less than emulating one.
        '--disable-gpu',
        '--disable-quic',
        // Pages on other hosts embed this one, as if it were a public host as well.
        `--ip-address-space-overrides=127.0.0.1:${PORT}=public,[::1]:${PORT}=public`,
        '--no-first-run',
        '--disable-background-networking',
        '--disable-component-update',
        '--disable-sync',
      ],
    },
  },
  webServer: {
    command: `node tests/e2e/static_server.mjs www/dist ${PORT}`,
    port: PORT,
    reuseExistingServer: false,
  },
});
