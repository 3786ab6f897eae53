// @ts-check
/**
 * What the page weighs: every file of the built page before and after compression, and what the engine's two files are made
 * of. `node scripts/sizes.mjs` prints tables of www/dist as it is; `npm run bench` has the same as JSON.
 */
import { existsSync, readdirSync, readFileSync } from 'node:fs';
import { basename, extname, join } from 'node:path';
import { brotliCompressSync, gzipSync } from 'node:zlib';
import { ROOT, StepError, TARGET_DIR, WASM_TARGET } from './steps.mjs';

const DIST = join(ROOT, 'www', 'dist');
/** The engine as it was linked, with the names of its functions. */
const ENGINES = ['small/scanstitch_planar', 'release/scanstitch'].map((path) => ({
  name: basename(path),
  linked: join(TARGET_DIR, WASM_TARGET, `${path}.linked.wasm`),
}));
/** Sections of a WebAssembly module. */
const [CUSTOM, IMPORT, CODE] = [0, 2, 10];
/** Kinds of imports, and how many numbers describe each. */
const [FUNCTION, TABLE, MEMORY] = [0, 1, 2];

/** @typedef {{ file: string, bytes: number, gzip: number, brotli: number }} FileSize */

/** The scripts and the engine's files, the largest first. @returns {FileSize[]} */
export function fileSizes() {
  if (!existsSync(DIST)) throw new StepError('There is no built page: npm run build');
  const names = readdirSync(DIST, { recursive: true, encoding: 'utf8' });
  const parts = names.filter((name) => ['.js', '.wasm', '.html'].includes(extname(name)) && !name.startsWith('module'));
  const sizes = parts.map((file) => {
    const content = readFileSync(join(DIST, file));
    const [gzip, brotli] = [gzipSync(content, { level: 9 }), brotliCompressSync(content)];
    return { file: file.replaceAll('\\', '/'), bytes: content.length, gzip: gzip.length, brotli: brotli.length };
  });
  return sizes.sort((a, b) => b.gzip - a.gzip);
}

/** Bytes of code by part, before compression, of each of the engine's files that was built here. */
export function engineParts() {
  const built = ENGINES.filter(({ linked }) => existsSync(linked));
  return Object.fromEntries(built.map(({ name, linked }) => [name, partsOf(readFileSync(linked))]));
}

/** Reads numbers and names of a module. */
class Reader {
  /** @param {Buffer} bytes @param {number} [at] */
  constructor(bytes, at = 0) {
    this.bytes = bytes;
    this.at = at;
  }

  byte() {
    return this.bytes[this.at++] ?? 0;
  }

  /** Of variable length, seven bits a byte. */
  number() {
    let [value, shift] = [0, 1];
    for (;;) {
      const byte = this.byte();
      value += (byte & 127) * shift;
      shift *= 128;
      if (byte < 128) return value;
    }
  }

  name() {
    const length = this.number();
    this.at += length;
    return this.bytes.toString('utf8', this.at - length, this.at);
  }
}

/** @param {Buffer} module @returns {Record<string, number>} */
function partsOf(module) {
  let num_imported = 0;
  /** @type {number[]} */
  let sizes = [];
  /** @type {Map<number, string>} */
  let names = new Map();
  const reader = new Reader(module, 8);
  while (reader.at < module.length) {
    const [section, length] = [reader.byte(), reader.number()];
    const end = reader.at + length;
    if (section === IMPORT) num_imported = importedFunctions(reader);
    else if (section === CODE) sizes = functionSizes(reader);
    else if (section === CUSTOM && reader.name() === 'name') names = functionNames(reader, end);
    reader.at = end;
  }
  /** @type {Map<string, number>} */
  const parts = new Map();
  for (const [index, size] of sizes.entries()) {
    const part = partOf(names.get(index + num_imported) ?? '');
    if (part !== null) parts.set(part, (parts.get(part) ?? 0) + size);
  }
  return Object.fromEntries([...parts].sort((a, b) => b[1] - a[1]));
}

/** @param {Reader} reader */
function importedFunctions(reader) {
  let count = 0;
  for (let left = reader.number(); left > 0; left--) {
    reader.name();
    reader.name();
    const kind = reader.byte();
    if (kind === FUNCTION) count++;
    if (kind === TABLE) reader.byte();
    const has_most = kind === TABLE || kind === MEMORY ? (reader.number() & 1) === 1 : false;
    reader.number();
    if (has_most) reader.number();
  }
  return count;
}

/** @param {Reader} reader */
function functionSizes(reader) {
  return Array.from({ length: reader.number() }, () => {
    const size = reader.number();
    reader.at += size;
    return size;
  });
}

/** @param {Reader} reader @param {number} end */
function functionNames(reader, end) {
  const FUNCTION_NAMES = 1;
  /** @type {Map<number, string>} */
  const names = new Map();
  while (reader.at < end) {
    const [kind, length] = [reader.byte(), reader.number()];
    const next = reader.at + length;
    if (kind === FUNCTION_NAMES)
      for (let left = reader.number(); left > 0; left--) names.set(reader.number(), reader.name());
    reader.at = next;
  }
  return names;
}

const STD = ['core', 'alloc', 'std', 'compiler_builtins', 'dlmalloc', 'hashbrown'];

/**
 * The part that a function belongs to, by its mangled name: a room of the crate, or another crate. Null: left out by
 * wasm-bindgen, which such functions speak to.
 * @param {string} name
 */
export function partOf(name) {
  if (name.includes('__wbindgen_describe')) return null;
  if (/^[a-z_]+$/.test(name) || /_[0-9a-f]{16}$/.test(name)) return 'wasm';
  // A type of the crate that something generic was made for counts as the crate: `scanstitch..room` or `10scanstitch4room`.
  const of_type = /scanstitch\.\.([a-z_]+)/.exec(name);
  if (of_type) return of_type[1] ?? '';
  const of_path = /10scanstitch(\d+)(\w+)/.exec(name);
  if (of_path) return of_path[2]?.slice(0, Number(of_path[1])) ?? '';
  const [, length = '0', rest = ''] = /(?:^_ZN|_)(\d+)([a-z]\w*)/.exec(name) ?? [];
  const crate_name = rest.slice(0, Number(length));
  return STD.includes(crate_name) || name.startsWith('mem') ? 'std' : crate_name || 'std';
}

if (process.argv[1] === import.meta.filename) {
  const show = (/** @type {number} */ bytes) => (bytes / 1000).toFixed(1).padStart(9);
  console.log(`${'kB'.padEnd(44)}${'raw'.padStart(9)}${'gzip'.padStart(9)}${'brotli'.padStart(9)}`);
  for (const { file, bytes, gzip, brotli } of fileSizes())
    console.log(`${file.padEnd(44)}${show(bytes)}${show(gzip)}${show(brotli)}`);
  for (const [engine, parts] of Object.entries(engineParts())) {
    console.log(`\n${engine}, code in kB before compression`);
    for (const [part, bytes] of Object.entries(parts))
      if (bytes > 1000) console.log(`${part.padEnd(44)}${show(bytes)}`);
  }
}
