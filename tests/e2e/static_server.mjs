// @ts-check
/**
 * A static host of the plainest kind: files of a folder under a path, their types, no other header.
 * `node tests/e2e/static_server.mjs FOLDER PORT` serves until it is stopped.
 */
import { readFile } from 'node:fs/promises';
import { createServer } from 'node:http';
import { extname, join, normalize } from 'node:path';

/** @type {Record<string, string>} */
const TYPES = {
  '.css': 'text/css',
  '.html': 'text/html; charset=utf-8',
  '.js': 'text/javascript',
  '.json': 'application/json',
  '.png': 'image/png',
  '.svg': 'image/svg+xml',
  '.wasm': 'application/wasm',
};

/**
 * Starts serving on localhost; port 0 takes a free one.
 * @param {string} folder
 * @param {{ prefix?: string, port?: number, files?: Record<string, string | Uint8Array> }} [options] prefix: the path the
 *   folder lies under, `/a/b/`; files: more of them, by their paths in the folder
 * @returns {Promise<import('node:http').Server>}
 */
export async function serve(folder, { prefix = '/', port = 0, files = {} } = {}) {
  const server = createServer(async (request, response) => {
    const { pathname } = new URL(request.url ?? '/', 'http://localhost');
    const inside = pathname.startsWith(prefix) ? decodeURIComponent(pathname.slice(prefix.length)) : undefined;
    const path = inside === '' || inside?.endsWith('/') ? `${inside}index.html` : inside;
    const is_inside = path !== undefined && !normalize(path).startsWith('..');
    const body = is_inside ? (Object.hasOwn(files, path) ? files[path] : await read(join(folder, path))) : null;
    if (body === null || body === undefined || path === undefined) {
      response.writeHead(404).end();
      return;
    }
    response.writeHead(200, { 'content-type': TYPES[extname(path)] ?? 'application/octet-stream' }).end(body);
  });
  await new Promise((resolve) => server.listen(port, 'localhost', () => resolve(undefined)));
  return server;
}

/** @param {string} path */
async function read(path) {
  try {
    return await readFile(path);
  } catch {
    return null;
  }
}

if (process.argv[1] === import.meta.filename) {
  const [, , folder = '.', port = '0'] = process.argv;
  await serve(folder, { port: Number(port) });
}
