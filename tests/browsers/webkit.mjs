// @ts-check
/** WebKit (WebKitGTK's MiniBrowser) by WebDriver (https://www.w3.org/TR/webdriver2/), on a screen of its own (Xvfb). */
import { spawn } from 'node:child_process';
import { existsSync, readdirSync } from 'node:fs';
import { createServer } from 'node:net';
import { join } from 'node:path';

const START_MS = 60_000;
const SCRIPT_MS = 300_000;
const POLL_MS = 100;
/**
 * On a busy machine one run in some fifty of the same engine on the same images differs in the last bit: 9e-17 m of 0.3 m were seen. Node, Chromium
 * and Firefox never differ, in whatever order frames are prepared, added and drawn.
 */
const ROUNDING = 1e-12;

/** Debian's folders of WebKitGTK's own programs. */
export function findMiniBrowser() {
  const libraries = '/usr/lib/x86_64-linux-gnu';
  const folders = existsSync(libraries) ? readdirSync(libraries).filter((name) => name.startsWith('webkit2gtk-')) : [];
  return folders.map((name) => join(libraries, name, 'MiniBrowser')).find((path) => existsSync(path));
}

/** @param {string} browser its MiniBrowser @returns {Promise<import('./browsers.mjs').Driver>} */
export async function startWebKit(browser) {
  const port = await freePort();
  const driver = spawn('xvfb-run', ['--auto-servernum', 'WebKitWebDriver', `--port=${port}`], {
    stdio: 'ignore',
    detached: true,
    // Graphics are emulated, and there is no sandbox for who is root.
    env: { ...process.env, LIBGL_ALWAYS_SOFTWARE: '1', WEBKIT_DISABLE_SANDBOX_THIS_IS_DANGEROUS: '1' },
  });
  /** @param {string} method @param {string} path @param {object} [body] @returns {Promise<any>} */
  const send = async (method, path, body) => {
    const response = await fetch(`http://127.0.0.1:${port}${path}`, {
      method,
      ...(body && { body: JSON.stringify(body), headers: { 'content-type': 'application/json' } }),
    });
    const { value } = /** @type {any} */ (await response.json());
    if (value?.error) throw new Error(`${value.error}: ${value.message}`);
    return value;
  };
  const until = Date.now() + START_MS;
  while (!(await send('GET', '/status').catch(() => null))?.ready) {
    if (Date.now() > until) throw new Error('WebKit does not start');
    await new Promise((resolve) => setTimeout(resolve, POLL_MS));
  }
  const options = { 'webkitgtk:browserOptions': { binary: browser, args: ['--automation'] } };
  const { sessionId, capabilities } = await send('POST', '/session', { capabilities: { alwaysMatch: options } });
  const session = `/session/${sessionId}`;
  await send('POST', `${session}/timeouts`, { script: SCRIPT_MS });
  return {
    version: `WebKit (${capabilities.browserName} ${capabilities.browserVersion})`,
    rounding: ROUNDING,
    faults: [],
    goto: (url) => send('POST', `${session}/url`, { url }),
    async evaluate(script) {
      const answer = await send('POST', `${session}/execute/async`, {
        script: `const done = arguments[arguments.length - 1];
          Promise.resolve(${script}).then((value) => done(JSON.stringify({ value })), (error) => done(JSON.stringify({ error: String(error) })));`,
        args: [],
      });
      const { value, error } = JSON.parse(answer);
      if (error !== undefined) throw new Error(error);
      return value;
    },
    async close() {
      await send('DELETE', session).catch(() => undefined);
      if (driver.pid) process.kill(-driver.pid);
    },
  };
}

/** @returns {Promise<number>} */
function freePort() {
  return new Promise((resolve) => {
    const server = createServer().listen(0, '127.0.0.1', () => {
      const address = server.address();
      server.close(() => resolve(typeof address === 'object' && address ? address.port : 0));
    });
  });
}
