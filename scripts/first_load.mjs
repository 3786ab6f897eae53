// @ts-check
/**
 * Times the first load of the built page, from its address to the finished sample, in a fresh Chromium over a slow
 * connection with a slow processor: `node scripts/first_load.mjs [FOLDER]`, by default www/dist. Prints a table to stderr and
 * JSON to stdout: medians of three runs, and what came over the wire until then.
 *
 * The connection is slow in the server, not in the browser, which slows only what the page itself fetches and not what its
 * workers do: every answer waits for a round trip, and all of them share one line. Text and WebAssembly are compressed by
 * gzip, as static hosts do it.
 */
import { createServer } from 'node:http';
import { setTimeout as sleep } from 'node:timers/promises';
import { gzipSync } from 'node:zlib';
import { chromium } from '@playwright/test';
import { typeAndContent } from '../tests/e2e/static_server.mjs';
import { findChromium, readArguments, runMain, StepError } from './steps.mjs';

const RUNS = 3;
/** Of the line, in bits a second. */
const RATE = 10e6;
/** From a request to the beginning of its answer, ms. */
const ROUND_TRIP_MS = 40;
/** Slowdown of the page's processor; Chromium does not slow down workers. */
const CPU_SLOWDOWN = 4;
/** Bytes sent at a time, in less time than a round trip. */
const PIECE_BYTES = 4096;
/** Time that a browser needs to settle after its start: it loads pages of its own (ms). */
const SETTLING_MS = 3000;
/** Time after which an unfinished page counts as failed, ms. */
const PATIENCE_MS = 60_000;
/** What static hosts compress. */
const COMPRESSED = /^(text\/|application\/(json|wasm))/;

/** @typedef {{ path: string, bytes: number }} Answer */

/** A line of limited rate, which all answers share. */
class Line {
  #free = 0;

  /** Over when the bytes have gone through. @param {number} bytes */
  async pass(bytes) {
    this.#free = Math.max(performance.now(), this.#free) + (bytes * 8000) / RATE;
    await sleep(this.#free - performance.now());
  }
}

/**
 * A static host at the far end of a slow line.
 * @param {string} folder
 */
async function serveSlowly(folder) {
  const line = new Line();
  /** @type {Answer[]} */
  const answers = [];
  /** @type {Map<string, Buffer>} */
  const packed = new Map();
  /** @type {import('node:net').Socket[]} */
  const sockets = [];
  const server = createServer(async (request, response) => {
    const path = new URL(request.url ?? '/', 'http://localhost').pathname;
    const { type, content } = await typeAndContent(folder, path);
    const is_packed = content !== null && COMPRESSED.test(type);
    const body = is_packed ? (packed.get(path) ?? gzipSync(content, { level: 9 })) : (content ?? Buffer.alloc(0));
    if (is_packed) packed.set(path, body);
    await sleep(ROUND_TRIP_MS);
    response.writeHead(content ? 200 : 404, {
      'content-type': type,
      'content-length': body.length,
      ...(is_packed && { 'content-encoding': 'gzip' }),
    });
    const answer = { path, bytes: 0 };
    answers.push(answer);
    for (let start = 0; start < body.length; start += PIECE_BYTES) {
      const piece = body.subarray(start, start + PIECE_BYTES);
      await line.pass(piece.length);
      response.write(piece);
      answer.bytes += piece.length;
    }
    response.end();
  });
  server.on('connection', (socket) => sockets.push(socket));
  await new Promise((resolve) => server.listen(0, 'localhost', () => resolve(undefined)));
  const address = server.address();
  if (typeof address !== 'object' || address === null) throw new StepError('The page is not served.');
  /** With the headers. */
  const numBytes = () => sockets.reduce((sum, socket) => sum + socket.bytesWritten, 0);
  return { server, answers, numBytes, url: `http://localhost:${address.port}/` };
}

/**
 * One first load: the times of the first paint and of the finished sample (ms), and what was transferred by then.
 * @param {string} folder
 */
async function load(folder) {
  const { server, answers, numBytes, url } = await serveSlowly(folder);
  const browser = await chromium.launch({
    executablePath: findChromium() ?? 'chromium',
    args: ['--no-sandbox', '--disable-gpu'],
  });
  try {
    const page = await browser.newPage();
    await page.addInitScript(() => {
      const stitched = new Promise((resolve) =>
        addEventListener('scanstitch-done', () => resolve(performance.now()), { once: true }),
      );
      Object.assign(window, { stitched });
    });
    const devtools = await page.context().newCDPSession(page);
    await devtools.send('Emulation.setCPUThrottlingRate', { rate: CPU_SLOWDOWN });
    await sleep(SETTLING_MS);
    await page.goto(url, { waitUntil: 'commit' });
    const finished = page.evaluate(
      () => /** @type {{ stitched: Promise<number> }} */ (/** @type {unknown} */ (window)).stitched,
    );
    const late = sleep(PATIENCE_MS, Number.NaN, { ref: false });
    const stitched_ms = await Promise.race([finished, late]);
    if (Number.isNaN(stitched_ms)) throw new StepError(`The sample was not finished after ${PATIENCE_MS / 1000} s.`);
    const [bytes, wire] = [numBytes(), answers.map(({ path, bytes }) => ({ path, bytes }))];
    const painted_ms = await page.evaluate(
      () => performance.getEntriesByName('first-contentful-paint')[0]?.startTime ?? Number.NaN,
    );
    return { painted_ms, stitched_ms, bytes, wire };
  } finally {
    await browser.close();
    server.closeAllConnections();
    server.close();
  }
}

/** What a file is, to those who look at the table. @param {string} path */
function kindOf(path) {
  if (path.endsWith('.wasm')) return 'engine';
  if (path.endsWith('.js')) return 'scripts';
  return path.endsWith('/') || path.endsWith('.html') ? 'page' : 'sample';
}

/** @param {Answer[]} wire */
function bytesByKind(wire) {
  /** @type {Record<string, number>} */
  const sums = {};
  for (const { path, bytes } of wire) sums[kindOf(path)] = (sums[kindOf(path)] ?? 0) + bytes;
  return sums;
}

/** @param {number[]} values */
const median = (values) => values.toSorted((a, b) => a - b)[values.length >> 1] ?? Number.NaN;

await runMain(async () => {
  const { positionals } = readArguments({ allowPositionals: true }, 'Usage: node scripts/first_load.mjs [FOLDER]');
  const [folder = 'www/dist'] = positionals;
  /** @type {{ painted_ms: number, stitched_ms: number, bytes: number, requests: number, bytes_by_kind: Record<string, number>, wire: Answer[] }[]} */
  const runs = [];
  for (let run = 0; run < RUNS; run++) {
    const { painted_ms, stitched_ms, bytes, wire } = await load(folder);
    runs.push({ painted_ms, stitched_ms, bytes, requests: wire.length, bytes_by_kind: bytesByKind(wire), wire });
    console.error(
      `finished after ${(stitched_ms / 1000).toFixed(2)} s, painted after ${(painted_ms / 1000).toFixed(2)} s, ` +
        `${(bytes / 1000).toFixed(0)} kB in ${wire.length} answers`,
    );
  }
  const over = (/** @type {(run: typeof runs[number]) => number} */ of) => median(runs.map(of));
  const medians = {
    painted_ms: Math.round(over((run) => run.painted_ms)),
    stitched_ms: Math.round(over((run) => run.stitched_ms)),
    bytes: over((run) => run.bytes),
  };
  const [first] = runs;
  for (const [kind, bytes] of Object.entries(first?.bytes_by_kind ?? {}))
    console.error(`${kind.padEnd(8)} ${(bytes / 1000).toFixed(1).padStart(8)} kB`);
  const throttling = { bits_per_second: RATE, round_trip_ms: ROUND_TRIP_MS, cpu_slowdown: CPU_SLOWDOWN };
  console.log(JSON.stringify({ throttling, medians, runs }, null, 2));
});
