import { expect, type InputFile, ply, room, sampleScans, test } from './scanstitch_page.js';

const cut_off = ply(room(8, 6)).split('\n').slice(0, 100).join('\n');
const binary_header = ply([]).replace('ascii', 'binary_little_endian').replace('vertex 0', 'vertex 4000000000');
const not_finite = ply(room(8, 6).map(() => [Number.NaN, Number.NaN, 0]));
const in_space = ply(room(8, 6).map(([x, y], i) => [x, y, i / 100]));

/** Each file, and what its message must say. */
const BAD_FILES: { what: string; file: InputFile; says: RegExp[] }[] = [
  { what: 'a cut-off file', file: { name: 'cut.ply', content: cut_off }, says: [/cut\.ply, line \d+/, /cut off/] },
  {
    what: 'a header that claims 4 billion points',
    file: { name: 'huge.ply', content: binary_header },
    says: [/huge\.ply, (byte|line) \d+/, /4000000000|4 ?billion/],
  },
  {
    what: 'a text file named .ply',
    file: { name: 'letter.ply', content: 'Dear all,\nplease find attached' },
    says: [/letter\.ply, line 1/, /Dear all/],
  },
  { what: 'an empty file', file: { name: 'empty.ply', content: '' }, says: [/empty\.ply/] },
  { what: 'an empty cloud', file: { name: 'nothing.ply', content: ply([]) }, says: [/nothing\.ply/, /no points/] },
  {
    what: 'coordinates that are no numbers',
    file: { name: 'nan.ply', content: not_finite },
    says: [/nan\.ply/, /finite/],
  },
  { what: 'a cloud in space', file: { name: 'space.ply', content: in_space }, says: [/space\.ply/, /planar/] },
];

test('each bad file gets a message of its own, and the scans beside them are stitched', async ({ empty: app }) => {
  await app.drop([...sampleScans().slice(0, 3), ...BAD_FILES.map(({ file }) => file)]);
  const { result } = await app.stitched();
  expect(result.frames).toHaveLength(3);
  const rows = app.messages.getByRole('listitem');
  await expect(rows).toHaveCount(BAD_FILES.length);
  for (const { what, file, says } of BAD_FILES) {
    for (const words of says) await expect(rows.filter({ hasText: file.name }), what).toContainText(words);
  }
  await expect(app.page.getByLabel('Result in figures')).toContainText(`${BAD_FILES.length} files not read`);
});

test('a single scan is shown, and said to be alone; returns that are no numbers are dropped and counted', async ({
  empty: app,
}) => {
  await app.drop([{ name: 'alone.ply', content: ply(room(8, 6)) }]);
  const { result } = await app.stitched();
  expect(result.frames).toHaveLength(1);
  await expect(app.why).toContainText('A single scan');
  expect(await app.numPainted()).toBeGreaterThan(100);
  const points = room(8, 6).map(([x, y], i): [number, number, number] => (i < 5 ? [Number.NaN, y, 0] : [x, y, 0]));
  await app.drop([{ name: 'some.ply', content: ply(points) }]);
  const cleaned = (await app.stitched()).result;
  expect(cleaned.frames[0]?.cleaning.non_finite).toBe(5);
  await expect(app.page.getByLabel('Result in figures')).toContainText('5 not a number');
});

test('several bad files are listed one by one, and what was on the page stays', async ({ app }) => {
  await app.drop(BAD_FILES.map(({ file }) => file));
  for (const { file } of BAD_FILES) await expect(app.messages).toContainText(file.name);
  await expect(app.messages).toContainText('the result on the page stays');
  expect(await app.scanNames()).toHaveLength(10);
  await app.row('3.ply').click();
  await expect(app.why).toContainText('were matched');
});

test('a trajectory that is bad or does not fit is told, and the scans are stitched without it', async ({
  empty: app,
}) => {
  await app.drop([...sampleScans().slice(0, 3), { name: 'path.tum', content: '0 0 0 0 0 0 0 1\n1 one 0 0 0 0 0 1\n' }]);
  const { result } = await app.stitched();
  expect(result.frames).toHaveLength(3);
  expect(result.comparison).toBeNull();
  await expect(app.messages).toContainText(/path\.tum, line 2/);

  await app.drop([...sampleScans().slice(0, 4), { name: 'short.txt', content: '0 0 0\n0 1 0\n' }]);
  const other = (await app.stitched()).result;
  expect(other.frames).toHaveLength(4);
  expect(other.comparison).toBeNull();
  await expect(app.messages).toContainText('short.txt');
  await expect(app.messages).toContainText('2 poses');
});

test('files that are neither scans nor a trajectory are named with the reason', async ({ app }) => {
  await app.drop([
    { name: 'photo.png', content: 'x' },
    { name: 'poses.npy', content: 'x' },
    { name: 'scans.zip', content: 'x' },
    { name: 'readme.txt', content: 'Read this first.' },
  ]);
  for (const words of ['None of the 4 files can be used', 'photo.png', 'poses.npy', 'scans.zip', 'readme.txt']) {
    await expect(app.messages).toContainText(words);
  }
  // A lone PNG is called so, with what to do.
  const signature = Buffer.from([0x89, 0x50, 0x4e, 0x47, 0x0d, 0x0a, 0x1a, 0x0a]);
  await app.drop([{ name: 'depth.png', content: signature }]);
  await expect(app.messages).toContainText('depth.png');
  await expect(app.messages).toContainText(/PNG cannot be read: it is cut off at byte 8; copy or export it again/);
  await app.drop([{ name: 'letter.png', content: 'Dear all' }]);
  await expect(app.messages).toContainText('letter.png');
  await expect(app.messages).toContainText(/PNG cannot be read: at byte 0 it begins with .Dear all./);
  await expect(app.messages).not.toContainText('not a laser scan');
  // Another run before this one would be the next to be told.
  await app.setting('Strategy').selectOption('scan_to_map');
  expect((await app.stitched()).result.settings.strategy).toBe('scan_to_map');
});

test('two scans of different rooms: the second is lost or doubtful, and the page says why', async ({ empty: app }) => {
  const elsewhere = room(3, 40).map(([x, y]): [number, number, number] => [x + 20, y - 22, 0]);
  await app.drop([
    { name: 'here.ply', content: ply(room(8, 6)) },
    { name: 'there.ply', content: ply(elsewhere) },
  ]);
  const { result } = await app.stitched();
  const frame = result.frames[1];
  expect(frame?.status).not.toBe('good');
  await app.row('there.ply').click();
  await expect(app.why).toContainText(frame?.reason ?? 'no reason', { ignoreCase: true });
  await expect(app.page.getByLabel('Result in figures')).toContainText(`1 ${frame?.status}`);
});
