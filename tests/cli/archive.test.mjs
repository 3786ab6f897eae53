// @ts-check
/** ZIP archives: read in place, and hostile or damaged ones refused in plain words. */
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { readFileSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { test } from 'node:test';
import { deflateSync, zipSync } from 'fflate';
import { bytesOfBlob, openArchive } from '../../npm/archive/archive.js';
import { LIMITS } from '../../npm/archive/directory.js';
import { isArchiveName } from '../../npm/files/kinds.js';
import { temporaryFolder } from './support.mjs';

const NOISE = Uint8Array.from({ length: 300_000 }, (_, i) => (i * 2654435761) >>> 13);
const ZEROS = new Uint8Array(5_000_000);

/** What of the bytes was read. @param {Uint8Array} bytes */
function watched(bytes) {
  const source = {
    size: bytes.length,
    numRead: 0,
    read: async (/** @type {number} */ start, /** @type {number} */ end) => {
      const part = bytes.subarray(start, end);
      source.numRead += part.length;
      return part;
    },
  };
  return source;
}

/** Where the directory's record of a file begins. @param {Uint8Array} zip */
function recordOf(zip, index = 0) {
  let place = -1;
  for (let i = 0; i <= index; i += 1) place = Buffer.from(zip).indexOf('PK\x01\x02', place + 1, 'latin1');
  return place;
}

/** A copy with numbers written into it. @param {Uint8Array} zip @param {[place: number, value: number, bytes: 2 | 4][]} changes */
function changed(zip, changes) {
  const copy = zip.slice();
  const view = new DataView(copy.buffer);
  for (const [place, value, bytes] of changes) {
    if (bytes === 2) view.setUint16(place, value, true);
    else view.setUint32(place, value, true);
  }
  return copy;
}

/** @param {RegExp} message */
function told(message) {
  return (/** @type {unknown} */ error) => {
    assert.ok(error instanceof Error);
    assert.equal(error.name, 'ScanstitchError');
    assert.match(error.message, message);
    return true;
  };
}

test('files, stored and deflated, come out as they went in', async () => {
  const zip = zipSync({
    'floor/': new Uint8Array(),
    'floor/rgb/1.png': [NOISE, { level: 0 }],
    'floor/depth/1.png': [NOISE, { level: 9 }],
    'floor/zeros': ZEROS,
    'floor/Zimmer ü.txt': new TextEncoder().encode('ü'),
    'floor/empty': new Uint8Array(),
  });
  const archive = await openArchive('floor.zip', watched(zip));
  assert.deepEqual(archive.files, [
    { path: 'floor/rgb/1.png', size: NOISE.length },
    { path: 'floor/depth/1.png', size: NOISE.length },
    { path: 'floor/zeros', size: ZEROS.length },
    { path: 'floor/Zimmer ü.txt', size: 2 },
    { path: 'floor/empty', size: 0 },
  ]);
  assert.deepEqual(archive.notes, []);
  assert.deepEqual(await archive.read('floor/rgb/1.png'), NOISE);
  assert.deepEqual(await archive.read('floor/depth/1.png'), NOISE);
  assert.deepEqual(await archive.read('floor/zeros'), ZEROS);
  assert.deepEqual(await archive.read('floor/empty'), new Uint8Array());
  for (const path of ['floor/rgb/1.png', 'floor/depth/1.png']) {
    assert.deepEqual(await archive.readHead(path, 100), NOISE.subarray(0, 100));
    assert.deepEqual(await archive.readHead(path, 1e9), NOISE);
  }
  await assert.rejects(archive.read('floor'), told(/^floor: There is no such file in floor\.zip\.$/));
});

test('a platform that cannot unpack by itself reads the same bytes', async () => {
  const archive = await openArchive('a.zip', watched(zipSync({ noise: [NOISE, { level: 9 }] })));
  const own = globalThis.DecompressionStream;
  let numAsked = 0;
  const read = async (/** @type {typeof DecompressionStream} */ stream) => {
    globalThis.DecompressionStream = stream;
    try {
      assert.deepEqual(await archive.read('noise'), NOISE);
    } finally {
      globalThis.DecompressionStream = own;
    }
  };
  await read(
    class extends own {
      /** @param {CompressionFormat} format */
      constructor(format) {
        super(format);
        numAsked += 1;
      }
    },
  );
  assert.equal(numAsked, 1, 'it unpacks where it can');
  await read(
    class extends own {
      constructor() {
        super(/** @type {CompressionFormat} */ ('unknown'));
      }
    },
  );
});

test('what the zip command writes is read, and so is a File of the page', async (t) => {
  const folder = temporaryFolder(t);
  writeFileSync(join(folder, 'noise.bin'), NOISE);
  const script =
    'import zipfile; z = zipfile.ZipFile("a.zip", "w", zipfile.ZIP_DEFLATED); z.write("noise.bin"); z.close()';
  try {
    execFileSync('python3', ['-c', script], { cwd: folder });
  } catch (error) {
    if (/** @type {NodeJS.ErrnoException} */ (error).code !== 'ENOENT') throw error;
    t.skip('python3 is absent');
    return;
  }
  const blob = new Blob([readFileSync(join(folder, 'a.zip'))]);
  const archive = await openArchive('a.zip', bytesOfBlob(blob));
  assert.deepEqual(await archive.read('noise.bin'), NOISE);
});

test('opening and looking reads little of a large archive', async () => {
  const files = Object.fromEntries(
    Array.from({ length: 100 }, (_, i) => [`${i}.png`, /** @type {const} */ ([NOISE, { level: 1 }])]),
  );
  const source = watched(zipSync(/** @type {import('fflate').Zippable} */ (files)));
  const archive = await openArchive('big.zip', source);
  for (const { path } of archive.files.slice(0, 5)) await archive.readHead(path, 4096);
  assert.ok(source.numRead < 600_000, `${source.numRead} of ${source.size} bytes were read`);
});

test('an archive with something before it, and one of 64 bits', async () => {
  const zip = zipSync({ 'a.txt': NOISE });
  const shifted = await openArchive('a.exe', watched(Uint8Array.of(...new Uint8Array(1000), ...zip)));
  assert.deepEqual(await shifted.read('a.txt'), NOISE);

  const end = zip.length - 22;
  const view = new DataView(zip.buffer, zip.byteOffset);
  const record = new DataView(new ArrayBuffer(56 + 20));
  record.setUint32(0, 0x06064b50, true);
  record.setBigUint64(4, 44n, true);
  record.setBigUint64(24, 1n, true);
  record.setBigUint64(32, 1n, true);
  record.setBigUint64(40, BigInt(view.getUint32(end + 12, true)), true);
  record.setBigUint64(48, BigInt(view.getUint32(end + 16, true)), true);
  record.setUint32(56, 0x07064b50, true);
  record.setBigUint64(64, BigInt(end), true);
  const tail = changed(zip.slice(end), [
    [10, 0xffff, 2],
    [12, 0xffffffff, 4],
    [16, 0xffffffff, 4],
  ]);
  const zip64 = Buffer.concat([zip.slice(0, end), new Uint8Array(record.buffer), tail]);
  assert.deepEqual(await (await openArchive('a.zip', watched(zip64))).read('a.txt'), NOISE);
});

test('no archive at all, or a part of one', async () => {
  const zip = zipSync({ 'a.txt': NOISE });
  for (const bytes of [new Uint8Array(), NOISE, zip.subarray(0, zip.length - 5), zip.subarray(0, 1000)]) {
    await assert.rejects(
      openArchive('a.zip', watched(bytes)),
      told(/^a\.zip: This is not a ZIP archive, or its end is missing/),
    );
  }
  await assert.rejects(openArchive('a.zip', watched(zip.subarray(1000))), told(/^a\.zip: .*damaged/));
  const torn = changed(zip, [[recordOf(zip), 0, 4]]);
  await assert.rejects(openArchive('a.zip', watched(torn)), told(/ends after 0 of 1 files.*damaged/));
});

test('damaged contents are told, the other files are read', async () => {
  const zip = zipSync({ 'good.bin': NOISE, 'bad.bin': NOISE }, { level: 0 });
  zip[450_000] = (zip[450_000] ?? 0) ^ 1;
  const archive = await openArchive('a.zip', watched(zip));
  await assert.rejects(
    archive.read('bad.bin'),
    told(/^bad\.bin: Its checksum is not the one that a\.zip has for it\./),
  );
  assert.deepEqual(await archive.read('good.bin'), NOISE);

  const deflated = zipSync({ 'bad.bin': NOISE });
  deflated.fill(0xff, 40, 400);
  const broken = await openArchive('a.zip', watched(deflated));
  await assert.rejects(broken.read('bad.bin'), told(/^bad\.bin: .*damaged/));
});

/** The notes of an archive, of which the last file, `good.bin`, must be readable. @param {Uint8Array} zip @param {typeof LIMITS} [limits] */
async function leftAside(zip, limits) {
  const archive = await openArchive('a.zip', watched(zip), limits);
  assert.deepEqual(await archive.read('good.bin'), NOISE);
  assert.ok(archive.notes.every(({ is_loss }) => is_loss));
  return archive.notes.map(({ file, reason }) => `${file}: ${reason}`);
}

test('a password is told, and the other files are read', async () => {
  const zip = zipSync({ 'secret.png': NOISE, 'good.bin': NOISE });
  const locked = changed(zip, [[recordOf(zip) + 8, 1, 2]]);
  assert.deepEqual(await leftAside(locked), [
    'secret.png: not used: protected by a password; unpack the archive with it',
  ]);
});

test('a hundred names of 60,000 characters are left out in no time', async () => {
  const long = Array.from({ length: 100 }, (_, i) => [`${'1.'.repeat(30_000)}${i}`, new Uint8Array(3)]);
  const start = process.cpuUsage();
  const notes = await leftAside(zipSync({ ...Object.fromEntries(long), 'good.bin': NOISE }));
  assert.equal(notes.length, 100);
  assert.match(notes[0] ?? '', /its path has 60001 characters, and at most 4096 are read$/);
  const { user } = process.cpuUsage(start);
  assert.ok(user < 5e6, `${user} microseconds of the processor`);
});

test('another method of packing is told', async () => {
  const zip = zipSync({ 'a.bin': NOISE, 'good.bin': NOISE });
  for (const [method, packer] of /** @type {const} */ ([
    [9, 'Deflate64'],
    [14, 'LZMA'],
    [77, 'method 77'],
  ])) {
    assert.deepEqual(await leftAside(changed(zip, [[recordOf(zip) + 10, method, 2]])), [
      `a.bin: not used: packed by ${packer}, which is not read; pack it as an ordinary ZIP archive, or give the folder`,
    ]);
  }
});

test('a comment that looks like the end of an archive is a comment', async () => {
  const zip = zipSync({ 'good.bin': NOISE });
  const comment = Buffer.concat([Buffer.from([0x50, 0x4b, 5, 6]), Buffer.alloc(60)]);
  const commented = changed(Buffer.concat([zip, comment]), [[zip.length - 2, comment.length, 2]]);
  assert.deepEqual(await leftAside(commented), []);
});

test('paths that lead out, links and doubles are left out, and told', async () => {
  const names = ['../up.png', '/etc/passwd', 'C:\\windows.png', 'a/../../b.png', 'good/1.png', 'good\\2.png'];
  const zip = zipSync(Object.fromEntries(names.map((name) => [name, new Uint8Array(3)])), {
    os: 3,
    attrs: 0o644 << 16,
  });
  const archive = await openArchive('a.zip', watched(zip));
  assert.deepEqual(
    archive.files.map(({ path }) => path),
    ['good/1.png', 'good/2.png'],
  );
  assert.equal(archive.notes.length, 4);
  assert.ok(archive.notes.every(({ reason }) => reason === 'not used: its path leads out of a.zip'));

  const link = zipSync({ 'link.png': [new Uint8Array(3), { os: 3, attrs: 0o120777 * 0x10000 }] });
  assert.deepEqual((await openArchive('a.zip', watched(link))).notes, [
    { file: 'link.png', reason: 'not used: a link to another file', is_loss: true },
  ]);
  const pair = zipSync({ 'a.png': new Uint8Array(3), 'b.png': new Uint8Array(4) });
  pair[recordOf(pair, 1) + 46] = 'a'.charCodeAt(0);
  const doubled = await openArchive('a.zip', watched(pair));
  assert.deepEqual(doubled.files, [{ path: 'a.png', size: 3 }]);
  assert.deepEqual(doubled.notes, [{ file: 'a.png', reason: 'not used: in the archive twice' }]);
});

test('a bomb that says so is refused before anything is unpacked', async () => {
  const zip = zipSync({ 'zeros.png': ZEROS, 'good.bin': NOISE });
  const small = { ...LIMITS, fileBytes: 1_000_000 };
  assert.deepEqual(await leftAside(zip, small), [
    'zeros.png: not used: it would unpack to 5 MB, and at most 1 MB are read',
  ]);
  const [free] = await leftAside(zip, { ...LIMITS, freeBytes: 2 ** 20 });
  assert.match(free ?? '', /it would unpack from 1 MB to 5 MB, and at most 2 MB are accepted of so little/);
  assert.deepEqual(await leftAside(zip), []);
  const many = zipSync(Object.fromEntries(Array.from({ length: 10 }, (_, i) => [`${i}`, ZEROS])));
  const total = { ...LIMITS, totalBytes: 20_000_000 };
  await assert.rejects(
    openArchive('a.zip', watched(many), total),
    told(/would unpack to 48 MB, and at most 20 MB are read/),
  );
  const few = { ...LIMITS, entries: 9 };
  await assert.rejects(openArchive('a.zip', watched(many), few), told(/holds 10 files, and at most 9/));
});

test('a bomb that lies is stopped at the size it claims', async () => {
  const zip = zipSync({ 'zeros.png': ZEROS, 'good.bin': NOISE });
  const modest = changed(zip, [[recordOf(zip) + 24, 1000, 4]]);
  const archive = await openArchive('a.zip', watched(modest));
  await assert.rejects(archive.read('zeros.png'), told(/^zeros\.png: It unpacks to more than the 1000 bytes/));
  const boastful = changed(zip, [[recordOf(zip) + 24, 1_000_000_000, 4]]);
  assert.match((await leftAside(boastful)).join(), /claims to unpack from \d+ bytes to 954 MB, which is not possible/);
  const outside = changed(zip, [[recordOf(zip) + 20, 2 ** 29, 4]]);
  assert.match((await leftAside(outside)).join(), /claims that it lies outside the archive/);
  const short = changed(zip, [[recordOf(zip) + 24, ZEROS.length + 9, 4]]);
  await assert.rejects(
    (await openArchive('a.zip', watched(short))).read('zeros.png'),
    told(/Cut off in a\.zip after 5000000 of 5000009 bytes/),
  );
});

test('files that lie over one another are refused', async () => {
  const zip = zipSync({ 'a.png': NOISE, 'b.png': NOISE });
  const second = recordOf(zip, 1);
  const overlapping = changed(zip, [[second + 42, 0, 4]]);
  await assert.rejects(openArchive('a.zip', watched(overlapping)), told(/overlap in it/));
});

test('any archive with any byte changed is read or told, and never hangs', async () => {
  const contents = Uint8Array.from({ length: 400 }, (_, i) => i % 7);
  const zip = zipSync({ 'a.png': contents, 'folder/b.png': [contents, { level: 0 }] });
  assert.ok(deflateSync(contents).length < 400);
  for (let place = 0; place < zip.length; place += 1) {
    for (const flip of [1, 0x80, 0xff]) {
      const copy = zip.slice();
      copy[place] = (copy[place] ?? 0) ^ flip;
      try {
        const archive = await openArchive('a.zip', watched(copy));
        for (const { path } of archive.files) await archive.read(path);
      } catch (error) {
        assert.equal(
          /** @type {Error} */ (error).name,
          'ScanstitchError',
          `byte ${place}: ${/** @type {Error} */ (error).stack}`,
        );
      }
    }
  }
});

test('archives are told by their names', () => {
  assert.ok(isArchiveName('x/Floor.ZIP'));
  assert.ok(!isArchiveName('x.zip/1.png'));
});
