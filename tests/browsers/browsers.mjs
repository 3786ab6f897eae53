// @ts-check
/** The browsers that are installed, and the page that they open. */
import { readFileSync } from 'node:fs';
import { createServer } from 'node:http';
import { join } from 'node:path';
import { chromium } from '@playwright/test';
import { findChromium, findProgram } from '../../scripts/steps.mjs';
import { typeAndContent } from '../e2e/static_server.mjs';
import { startFirefox } from './firefox.mjs';
import { findMiniBrowser, startWebKit } from './webkit.mjs';

/**
 * @typedef {object} Driver
 * @property {string} version
 * @property {number} rounding by which numbers may differ from Chromium's
 * @property {string[]} faults errors of the page's scripts that the browser tells
 * @property {(url: string) => Promise<unknown>} goto
 * @property {(script: string) => Promise<any>} evaluate an expression, awaited
 * @property {() => Promise<void>} close
 */

const PAGE = `<!doctype html><meta charset="utf-8"><title>Scanstitch</title>
  <body style="margin: 0"><scanstitch-app src="sample" style="height: 100vh"></scanstitch-app>
  <script src="in_page.js"></script><script type="module" src="scanstitch-app.js"></script>`;
const DIST = join(import.meta.dirname, '../../www/dist');
/** @returns {Promise<Driver>} */
async function startChromium() {
  const browser = await chromium.launch({
    executablePath: findChromium() ?? 'chromium',
    args: ['--no-sandbox', '--enable-unsafe-swiftshader'],
  });
  const page = await browser.newPage({ viewport: { width: 1280, height: 800 } });
  /** @type {string[]} */
  const faults = [];
  page.on('pageerror', ({ message }) => faults.push(message));
  return {
    version: `Chromium ${browser.version()}`,
    rounding: 0,
    faults,
    goto: (url) => page.goto(url),
    evaluate: (script) => page.evaluate(script),
    close: () => browser.close(),
  };
}

/** @type {{ name: string, start: (() => Promise<Driver>) | null }[]} */
export const browsers = [
  { name: 'Chromium', start: startChromium },
  { name: 'Firefox', start: starter(findProgram(['firefox-esr', 'firefox']), startFirefox) },
  { name: 'WebKit', start: starter(findProgram(['WebKitWebDriver']) && findMiniBrowser(), startWebKit) },
];

/** @param {string | undefined} program @param {(program: string) => Promise<Driver>} start */
function starter(program, start) {
  return program === undefined ? null : () => start(program);
}

/**
 * Serves the built page in a host of its own, with these files beside it, by their paths.
 * @param {Readonly<Record<string, string | Uint8Array>>} given
 */
export async function serveHost(given) {
  const own_files = {
    '/host.html': PAGE,
    '/in_page.js': readFileSync(join(import.meta.dirname, 'in_page.js')),
    ...given,
  };
  /** @type {Record<string, string | Uint8Array>} */
  const files = own_files;
  const server = createServer(async (request, response) => {
    const { pathname } = new URL(request.url ?? '/', 'http://localhost');
    const { type, content } = await typeAndContent(DIST, pathname, '/');
    const own = Object.hasOwn(files, pathname) ? files[pathname] : undefined;
    const own_type = pathname.endsWith('.html') ? 'text/html' : pathname.endsWith('.js') ? 'text/javascript' : type;
    const body = own ?? content;
    if (body === null) response.writeHead(404).end();
    else response.writeHead(200, { 'content-type': own === undefined ? type : own_type }).end(body);
  });
  await new Promise((resolve) => server.listen(0, 'localhost', () => resolve(undefined)));
  const address = server.address();
  if (typeof address !== 'object' || address === null) throw new Error('The page is not served.');
  return { url: `http://localhost:${address.port}/host.html`, close: () => server.close() };
}
