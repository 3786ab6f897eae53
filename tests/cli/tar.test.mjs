// @ts-check
/** Archives of tar, packed or not, and files that are packed by themselves: what tar and zlib wrote, and hostile ones. */
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { mkdirSync, readFileSync, symlinkSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { test } from 'node:test';
import { gunzipSync, gzipSync } from 'node:zlib';
import { bytesInMemory, openAnyArchive } from '../../npm/archive/open.js';
import { unpackedName, unpackWhole } from '../../npm/archive/packed.js';
import { isArchiveName } from '../../npm/files/kinds.js';
import { openTar } from '../../npm/archive/tar.js';
import { readReport, ROOM_FILES, scanstitch, temporaryFolder } from './support.mjs';

const LONG = `${'a folder of a hundred characters '.repeat(3)}/${'b'.repeat(120)}/scan.txt`;

/** A header and the bytes of one file. @param {string} path @param {Uint8Array} bytes @param {{ kind?: string, size?: number }} [changes] */
function entry(path, bytes, { kind = '0', size = bytes.length } = {}) {
  const block = Buffer.alloc(512 * (1 + Math.ceil(bytes.length / 512)));
  block.write(path, 0, 100, 'utf8');
  block.write('0000644\0', 100);
  block.write(`${size.toString(8).padStart(11, '0')}\0`, 124);
  block.write('        ', 148);
  block.write(kind, 156);
  block.write('ustar\x0000', 257);
  const sum = block.subarray(0, 512).reduce((total, byte) => total + byte, 0);
  block.write(`${sum.toString(8).padStart(6, '0')}\0 `, 148);
  block.set(bytes, 512);
  return block;
}

/** @param {Buffer[]} entries */
const archiveOf = (...entries) => Buffer.concat([...entries, Buffer.alloc(1024)]);
const text = (/** @type {string} */ words) => new TextEncoder().encode(words);
/** @param {Uint8Array} bytes */
const openBytes = (bytes, name = 'a.tar') => openAnyArchive(name, bytesInMemory(bytes));

test('what tar packs in each of its formats comes out as it went in', async (t) => {
  const folder = temporaryFolder(t);
  mkdirSync(join(folder, LONG, '..'), { recursive: true });
  const noise = Uint8Array.from({ length: 70_000 }, (_, i) => (i * 2654435761) >>> 13);
  writeFileSync(join(folder, LONG), noise);
  writeFileSync(join(folder, 'Zimmer ü.txt'), 'ü');
  writeFileSync(join(folder, 'empty'), '');
  symlinkSync('empty', join(folder, 'link'));
  for (const format of ['gnu', 'pax', 'ustar']) {
    const isShort = format === 'ustar'; // which has no room for the long path
    const files = isShort ? ['Zimmer ü.txt', 'empty', 'link'] : ['.'];
    const packed = join(folder, '..', `${process.pid}-${format}.tar`);
    execFileSync('tar', [`--format=${format}`, '-cf', packed, '-C', folder, ...files]);
    t.after(() => execFileSync('rm', [packed]));
    const archive = await openBytes(readFileSync(packed));
    const names = archive.files.map(({ path }) => path).sort();
    assert.deepEqual(names, ['Zimmer ü.txt', 'empty', ...(isShort ? [] : [LONG])].sort(), format);
    assert.deepEqual(
      archive.notes.map(({ file, reason }) => [file, reason]),
      [['link', 'not used: a link to another file']],
    );
    assert.equal(new TextDecoder().decode(await archive.read('Zimmer ü.txt')), 'ü');
    if (!isShort) {
      assert.deepEqual(Uint8Array.from(await archive.read(LONG)), noise);
      assert.deepEqual(Uint8Array.from(await archive.readHead(LONG, 10)), noise.subarray(0, 10));
    }
    const gzipped = await openBytes(gzipSync(readFileSync(packed)), 'a.tgz');
    assert.deepEqual(gzipped.files, archive.files);
  }
});

test('links, devices, paths that lead out, and damage are named, and the rest is used', async () => {
  const good = entry('good.txt', text('good'));
  const archive = await openBytes(
    archiveOf(
      entry('../out.txt', text('x')),
      entry('/etc/passwd', text('x')),
      entry('link', text(''), { kind: '2' }),
      entry('device', text(''), { kind: '3' }),
      entry('folder/', text(''), { kind: '5' }),
      entry('huge', text('x'), { size: 2 ** 31 }),
      good,
    ),
  );
  assert.deepEqual(archive.files, []);
  assert.deepEqual(
    archive.notes.map(({ file, reason }) => `${file}: ${reason}`),
    [
      '../out.txt: not used: its path leads out of a.tar',
      '/etc/passwd: not used: its path leads out of a.tar',
      'link: not used: a link to another file',
      'device: not used: a device',
      'huge: not used: it has 2.0 GB, and at most 1.0 GB are read',
    ],
  );
  const broken = Buffer.from(archiveOf(good, good, entry('second', text('x'))));
  broken.fill(7, 2048, 2500);
  const [told] = (await openBytes(broken)).notes;
  assert.match(told?.reason ?? '', /what follows byte 2048 is damaged/);
  const cut = archiveOf(good, entry('long.txt', new Uint8Array(5000))).subarray(0, 3000);
  const [file] = (await openBytes(cut)).notes;
  assert.match(`${file?.file}: ${file?.reason}`, /long\.txt: not used: it is cut off at the end of a\.tar/);
  await assert.rejects(openBytes(Buffer.alloc(2048, 1)), /This is not a tar archive/);
  const many = archiveOf(...Array.from({ length: 4 }, (_, i) => entry(`${i}`, text('x'))));
  const limits = { entries: 3, fileBytes: 100, totalBytes: 100, freeBytes: 100, ratio: 20 };
  await assert.rejects(openTar('a.tar', bytesInMemory(many), limits), /holds more than 3 files/);
});

test('a packed file comes out whole, or as far as it goes; what would fill the memory is refused', async () => {
  const bytes = Uint8Array.from({ length: 300_000 }, (_, i) => (i * 2654435761) >>> 13);
  const packed = gzipSync(bytes);
  const open = (/** @type {Uint8Array} */ data) => unpackWhole('a.gz', bytesInMemory(data));
  assert.deepEqual(await open(packed), { bytes, fault: null });
  const twice = await open(Buffer.concat([packed, gzipSync(text('end'))]));
  assert.deepEqual(twice.bytes.subarray(-3), text('end'));
  assert.deepEqual([twice.bytes.length, twice.fault], [300_003, null]);
  const cut = await open(packed.subarray(0, Math.floor((2 * packed.length) / 3)));
  assert.ok(cut.fault !== null && cut.bytes.length > 1000 && cut.bytes.length < 300_000, `${cut.fault}`);
  assert.deepEqual(cut.bytes, bytes.subarray(0, cut.bytes.length));
  const wrong = Uint8Array.from(packed);
  wrong[packed.length - 6] = (wrong[packed.length - 6] ?? 0) ^ 1;
  assert.match((await open(wrong)).fault ?? '', /checksum is wrong/);
  await assert.rejects(open(gzipSync(new Uint8Array(100_000_000))), /It unpacks to more than 6\d MB/);
  await assert.rejects(open(text('no gzip at all')), /packed neither by gzip/);
  assert.deepEqual(['a.tgz', 'a.csv.gz', 'b.db3.zstd', 'a.txt', 'x.tar.bz2'].map(unpackedName), [
    'a.tar',
    'a.csv',
    'b.db3',
    null,
    'x.tar',
  ]);
  for (const name of ['a.tar', 'A.TGZ', 'a.tar.gz', 'a.tar.bz2', 'a.tar.zst', 'a.zip'])
    assert.ok(isArchiveName(name), name);
  for (const name of ['a.gz', 'a.tar/b.ply', 'a.7z']) assert.ok(!isArchiveName(name), name);
});

test('flipped bytes of an archive are told or harmless', async () => {
  const tar = archiveOf(entry('a.txt', text('a'.repeat(700))), entry('b.txt', text('b')));
  for (let place = 0; place < tar.length; place += 7) {
    const copy = Buffer.from(tar);
    copy[place] = (copy[place] ?? 0) ^ 0xff;
    try {
      const archive = await openBytes(copy);
      for (const { path, size } of archive.files) assert.equal((await archive.read(path)).length, size);
    } catch (error) {
      assert.equal(/** @type {Error} */ (error).name, 'ScanstitchError');
    }
  }
});

test('scans in a tar and scans packed one by one are reconstructed', async (t) => {
  const folder = temporaryFolder(t);
  const entries = Object.entries(ROOM_FILES).map(([name, content]) => entry(`room/${name}`, text(content)));
  writeFileSync(join(folder, 'room.tar.gz'), gzipSync(archiveOf(...entries)));
  const scans = join(folder, 'packed');
  mkdirSync(scans);
  for (const [name, content] of Object.entries(ROOM_FILES)) writeFileSync(join(scans, `${name}.gz`), gzipSync(content));
  for (const input of ['room.tar.gz', 'packed']) {
    const out = join(folder, 'out');
    const { status, stderr } = await scanstitch(['reconstruct', join(folder, input), '--out', out]);
    assert.equal(status, 0, stderr);
    assert.equal(readReport(out).frames.length, 3);
  }
  assert.equal(gunzipSync(readFileSync(join(scans, '0.ply.gz'))).toString(), ROOM_FILES['0.ply']);
});

test('what is packed twice, and an archive in a folder, have the line that helps', async (t) => {
  const folder = temporaryFolder(t);
  writeFileSync(join(folder, 'a.ply.gz.gz'), gzipSync(gzipSync(ROOM_FILES['0.ply'] ?? '')));
  writeFileSync(join(folder, 'in.zip'), 'whatever');
  const { status, stderr } = await scanstitch(['reconstruct', folder]);
  assert.match(stderr, /a\.ply\.gz\.gz: not used: it is packed twice/);
  assert.match(stderr, /in\.zip: not used: an archive within an archive or a folder/);
  assert.equal(status, 1);
});
