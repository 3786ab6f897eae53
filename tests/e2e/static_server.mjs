// @ts-check
/**
 * A static host of the plainest kind: files of a folder under a path, their types, no other header.
 * `node tests/e2e/static_server.mjs FOLDER PORT` serves until it is stopped, and lets other sites read its files, as public hosts do.
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
 * @param {{ prefix?: string, port?: number, headers?: Record<string, string> }} [options] prefix: the path the folder lies under,
 *   `/a/b/`; headers: sent with every file
 * @returns {Promise<import('node:http').Server>}
 */
export async function serve(folder, { prefix = '/', port = 0, headers = {} } = {}) {
  const server = createServer(async (request, response) => {
    const { pathname } = new URL(request.url ?? '/', 'http://localhost');
    const { type, content } = await typeAndContent(folder, pathname, prefix);
    if (content === null) response.writeHead(404).end();
    else response.writeHead(200, { 'content-type': type, ...headers }).end(content);
  });
  await new Promise((resolve) => server.listen(port, 'localhost', () => resolve(undefined)));
  return server;
}

/**
 * What a host answers to an address: `content` null where there is no such file.
 * @param {string} folder
 * @param {string} pathname
 * @param {string} [prefix]
 */
export async function typeAndContent(folder, pathname, prefix = '/') {
  const inside = pathname.startsWith(prefix) ? decodeURIComponent(pathname.slice(prefix.length)) : '..';
  const path = inside === '' || inside.endsWith('/') ? `${inside}index.html` : inside;
  const content = normalize(path).startsWith('..') ? null : await read(join(folder, path));
  return { type: TYPES[extname(path)] ?? 'application/octet-stream', content };
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
  await serve(folder, { port: Number(port), headers: { 'access-control-allow-origin': '*' } });
}
