/** The pure parts of the page, without a browser: numbers in, numbers and words out. */
import { expect, test } from '@playwright/test';
import { classify } from '../../npm/recording/classify.js';
import type { Dataset } from '../../www/src/datasets/dataset.js';
import { combine, type Intake } from '../../www/src/datasets/take-in.js';
import { compareNaturally } from '../../npm/base/natural_order.js';
import { formatCount, formatDuration, formatFixed, formatLength } from '../../www/src/views/format.js';
import { formatAngle, formatStep } from '../../www/src/views/pose-format.js';
import { lookDirection } from '../../www/src/views/look-direction.js';
import { type Rgb, framePalette } from '../../www/src/views/palette.js';
import { nearestFrame } from '../../www/src/views/point-layer.js';
import { changeWords, fromScreen, parseSettings, toScreen, writeSettings } from '../../www/src/views/setting-fields.js';
import { zeroWord } from '../../www/src/views/setting-form.js';
import { mapBounds } from '../../www/src/views/map-bounds.js';
import { linearAxis } from '../../www/src/views/axes.js';
import { drawSeries } from '../../www/src/views/figures.js';
import { SvgPen } from '../../www/src/views/pen.js';
import { sorted } from '../../www/src/views/sorted.js';
import {
  bestTurns,
  fitted,
  panned,
  roundLength,
  toScreenX,
  toScreenY,
  toWorld,
  type Turns,
  zoomedAt,
} from '../../www/src/views/viewport.js';
import { longestPairs } from '../../www/src/views/longest-pairs.js';
import { certainPieces, pieceColors, uncertainLinks } from '../../www/src/views/pieces.js';
import { cleaningWords, directionWords } from '../../www/src/views/frame-words.js';

const SIZE = { width: 640, height: 480 };
const TURNS: Turns[] = [0, 1, 2, 3];
const MARGIN = { top: 10, right: 40, bottom: 30, left: 20 };

test('screen and world are each other inverse, however the map is turned', () => {
  for (const turns of TURNS) {
    const view = { centerX: 3, centerY: -2, scale: 37, turns };
    const { x, y } = toWorld(view, SIZE, 123, 45);
    expect(toScreenX(view, SIZE, x, y)).toBeCloseTo(123, 9);
    expect(toScreenY(view, SIZE, x, y)).toBeCloseTo(45, 9);
  }
  // Not turned: x to the right, y up.
  const view = { centerX: 0, centerY: 0, scale: 10, turns: 0 as const };
  expect([toScreenX(view, SIZE, 1, 0), toScreenY(view, SIZE, 0, 1)]).toEqual([330, 230]);
});

test('what lies under the cursor stays there while zooming, and moves with the hand while dragging', () => {
  for (const turns of TURNS) {
    const view = { centerX: 1, centerY: 2, scale: 50, turns };
    const before = toWorld(view, SIZE, 100, 300);
    const zoomed = toWorld(zoomedAt(view, SIZE, 100, 300, 3.7), SIZE, 100, 300);
    expect([zoomed.x, zoomed.y].map((v) => v.toFixed(9))).toEqual([before.x, before.y].map((v) => v.toFixed(9)));
    const dragged = toWorld(panned(view, 25, -40), SIZE, 125, 260);
    expect([dragged.x, dragged.y].map((v) => v.toFixed(9))).toEqual([before.x, before.y].map((v) => v.toFixed(9)));
  }
});

test('fitting shows all, within the margins, and lays a corridor along the screen', () => {
  const corridor = { minX: -2, maxX: 2, minY: 0, maxY: 30 };
  expect(bestTurns(corridor, { width: 900, height: 480 })).toBe(3);
  expect(bestTurns(corridor, { width: 360, height: 640 })).toBe(0);
  for (const turns of TURNS) {
    const view = fitted(corridor, SIZE, MARGIN, turns);
    for (const x of [corridor.minX, corridor.maxX]) {
      for (const y of [corridor.minY, corridor.maxY]) {
        expect(toScreenX(view, SIZE, x, y)).toBeGreaterThanOrEqual(MARGIN.left - 1e-6);
        expect(toScreenX(view, SIZE, x, y)).toBeLessThanOrEqual(SIZE.width - MARGIN.right + 1e-6);
        expect(toScreenY(view, SIZE, x, y)).toBeGreaterThanOrEqual(MARGIN.top - 1e-6);
        expect(toScreenY(view, SIZE, x, y)).toBeLessThanOrEqual(SIZE.height - MARGIN.bottom + 1e-6);
      }
    }
  }
});

test('far returns do not shrink the map; the trajectory and all of a room are inside', () => {
  // A room of 2 m about the scanner, and every twentieth beam goes through its door, 30 m far.
  const points = Float32Array.from({ length: 2000 }, (_, i) => {
    const angle = Math.floor(i / 2);
    const far = angle % 20 === 0 ? 15 : 1;
    return 2 * far * (i % 2 === 0 ? Math.cos(angle) : Math.sin(angle));
  });
  const set = { points, offsets: Uint32Array.of(0, 1000) };
  const bounds = mapBounds(set, [{ x: 0, y: 0 }], [{ x: 5, y: 0 }]);
  expect(bounds?.maxX).toBe(5);
  expect(bounds?.minX).toBeCloseTo(-2, 1);
  expect(bounds?.minY).toBeCloseTo(-2, 1);
  expect(bounds?.maxY).toBeCloseTo(2, 1);
  // The corners of a long room are 1.9 times as far as most of its walls.
  const room = Float32Array.of(1, 0, -1, 0, 0, 1, 0, -1, 1.9, 0.1);
  expect(mapBounds({ points: room, offsets: Uint32Array.of(0, 5) }, [{ x: 0, y: 0 }])?.maxX).toBeCloseTo(1.9, 5);
  expect(mapBounds({ points: new Float32Array(0), offsets: Uint32Array.of(0) }, [])).toBeNull();
});

test('a piece of the map has bounds of its own', () => {
  const set = { points: Float32Array.of(0, 0, 1, 1, 50, 50, 51, 52), offsets: Uint32Array.of(0, 2, 4) };
  const poses = [{ x: 0, y: 1 }, { x: 50, y: 51 }]; // prettier-ignore
  expect(mapBounds(set, poses, [], [1])).toEqual({ minX: 50, maxX: 51, minY: 50, maxY: 52 });
});

test('a map in pieces: the main one first, small ones together, links between pieces and of lost scans uncertain', () => {
  const frames = (piece: number, count: number, status: 'good' | 'doubtful' | 'lost' = 'doubtful') =>
    Array.from({ length: count }, () => ({ piece, status }));
  const log = [...frames(1, 2), ...frames(0, 6, 'good'), ...frames(0, 1, 'lost'), ...frames(2, 9), ...frames(3, 1)];
  const pieces = certainPieces(log, false);
  expect(pieces.map(({ label, numPieces, frames: { length } }) => [label, numPieces, length])).toEqual([
    // By size, the engine's main piece among them; the numbers have no gap.
    ['Main piece', 1, 9],
    ['Piece of the first scan', 1, 6],
    ['2 small pieces', 2, 3],
  ]);
  expect(pieces.map(({ exported }) => exported)).toEqual(['map_piece_2', 'map', '']);
  const colors = pieceColors(pieces, log.length, false);
  expect(colors[2]).toEqual(pieces[1]?.color);
  expect(colors[0]).toEqual(pieces[2]?.color);
  expect(new Set(colors.map(String)).size).toBe(3);
  const uncertain = uncertainLinks(log).flatMap((isUncertain, frame) => (isUncertain ? [frame] : []));
  expect(uncertain).toEqual([2, 8, 9, 18]);
  // Within the main piece a doubtful scan hangs loosely; a map of one piece has no list of pieces.
  const one = [...frames(0, 2, 'good'), ...frames(0, 1), ...frames(0, 2, 'good')];
  expect(uncertainLinks(one)).toEqual([false, false, true, false, false]);
  expect(certainPieces(one, false)).toEqual([]);
});

test('the longest tenth of the pairs, and its share of the squares', () => {
  const pairs = Float32Array.from(
    Array.from({ length: 20 }, (_, i) => [0, 0, 3 * (i < 2 ? 5 : 1), 4 * (i < 2 ? 5 : 1)]).flat(),
  );
  const { drawn, count, total, longest, median, share } = longestPairs(pairs);
  expect([count, total, longest, median]).toEqual([2, 20, 25, 5]);
  expect(share).toBeCloseTo((2 * 625) / (2 * 625 + 18 * 25), 9);
  expect([...drawn]).toEqual([0, 0, 15, 20, 0, 0, 15, 20]);
  expect(longestPairs(new Float32Array())).toMatchObject({ count: 0, total: 0, share: 0 });
});

test('lengths of the scale bar are round', () => {
  for (const scale of [0.05, 1, 7, 40, 333, 9000]) {
    const length = roundLength({ centerX: 0, centerY: 0, scale, turns: 0 }, 150);
    expect(length * scale).toBeLessThanOrEqual(150);
    expect(length * scale).toBeGreaterThan(150 / 2.6);
    expect(Number(length.toExponential().split('e')[0])).toBeCloseTo(Math.round(Number(length.toExponential()[0])), 9);
  }
});

test('the nearest point tells its frame', () => {
  const set = { points: Float32Array.of(1, 1, 3, 3, 0, 0, 2, 2), offsets: Uint32Array.of(0, 1, 2, 4, 4) };
  expect(nearestFrame(set, 4, 2.9, 3, 0.5)).toBe(1);
  expect(nearestFrame(set, 4, 2.1, 2, 0.5)).toBe(2);
  expect(nearestFrame(set, 1, 2.9, 3, 0.5)).toBeNull();
  expect(nearestFrame(set, 4, 50, 50, 1)).toBeNull();
});

test('a scanner that sees half the circle looks to its middle, one that sees all looks along x', () => {
  const ring = (from: number, to: number, pose: { x: number; y: number; theta: number }): Float32Array =>
    Float32Array.from({ length: 360 }, (_, i) => {
      const angle = pose.theta + from + (Math.floor(i / 2) / 179) * (to - from);
      return i % 2 === 0 ? pose.x + 4 * Math.cos(angle) : pose.y + 4 * Math.sin(angle);
    });
  const pose = { x: 3, y: -1, theta: 2 };
  const seen = (from: number, to: number): number =>
    lookDirection({ points: ring(from, to, pose), offsets: Uint32Array.of(0, 180) }, [pose]);
  expect(seen(0, Math.PI)).toBeCloseTo(Math.PI / 2, 1);
  expect(seen(-Math.PI / 2, Math.PI / 2)).toBeCloseTo(0, 1);
  expect(seen(-Math.PI, Math.PI)).toBe(0);
  expect(lookDirection({ points: new Float32Array(0), offsets: Uint32Array.of(0, 0) }, [pose])).toBe(0);
});

test('colours keep a contrast to the background and rise in lightness', () => {
  const luminance = ([r, g, b]: Rgb): number => {
    const linear = (v: number): number => (v / 255 <= 0.04045 ? v / 255 / 12.92 : ((v / 255 + 0.055) / 1.055) ** 2.4);
    return 0.2126 * linear(r) + 0.7152 * linear(g) + 0.0722 * linear(b);
  };
  for (const [isDark, background] of [
    [false, 0.97],
    [true, 0.005],
  ] as const) {
    const lights = framePalette(20, isDark).map(luminance);
    for (const light of lights) {
      const ratio = (Math.max(light, background) + 0.05) / (Math.min(light, background) + 0.05);
      expect(ratio).toBeGreaterThan(2.8);
    }
    expect(lights).toEqual([...lights].sort((a, b) => a - b));
  }
});

test('files are put in the order people mean', () => {
  const names = ['b/1.ply', 'a/10.ply', 'a/2.ply', 'scan-9.ply', 'a/2/1.ply', 'scan-10.ply'];
  expect(names.sort(compareNaturally)).toEqual([
    'a/2/1.ply',
    'a/2.ply',
    'a/10.ply',
    'b/1.ply',
    'scan-9.ply',
    'scan-10.ply',
  ]);
});

test('what a file is for is told by its name and its first bytes', () => {
  const role = (name: string, text = ''): string => classify(name, new TextEncoder().encode(text)).role;
  expect(role('a/B.PLY')).toBe('scan');
  expect(role('no_extension', 'ply\r\nformat ascii 1.0')).toBe('scan');
  expect(role('truth.tum')).toBe('reference');
  expect(role('gt.txt', '# t x y z\n0 1 2 3\n1 1 2 3\n')).toBe('reference');
  expect(role('gt.csv', 'x,y,z\n1.5,2,0\n2,2,0\n')).toBe('reference');
  expect(role('one_line.txt', '1 2 3')).toBe('reference');
  expect(role('readme.txt', 'Scan 1 and 2 were taken\nin the hall\n')).toBe('ignored');
  for (const name of ['x.npy', 'x.pcd', 'x.png', 'x.zip', 'x.doc']) expect(role(name)).toBe('ignored');
  expect(classify('.DS_Store', new Uint8Array())).toEqual({ role: 'ignored', reason: null });
  expect(classify('__MACOSX/0.ply', new Uint8Array())).toEqual({ role: 'ignored', reason: null });
});

test('scans replace what is open, or join own scans where they are to; a reference joins either', () => {
  const file = (name: string) => ({ name, bytes: new ArrayBuffer(0) });
  const intake = (...names: string[]): Intake => ({
    scans: names.map(file),
    reference: null,
    odometry: null,
    notes: [],
  });
  const sample: Dataset = {
    title: 'Sample',
    origin: 'sample' as const,
    scans: [file('s.ply')],
    reference: file('truth.tum'),
    odometry: null,
  };

  const own = combine(sample, intake('walk/2.ply', 'walk/10.ply'), true);
  expect(own.scans.map(({ name }) => name)).toEqual(['walk/2.ply', 'walk/10.ply']);
  expect([own.title, own.origin, own.reference]).toEqual(['walk', 'user', null]);
  const other = combine(own, intake('walk/3.ply', 'walk/2.ply'), false);
  expect(other.scans.map(({ name }) => name)).toEqual(['walk/3.ply', 'walk/2.ply'].sort());
  const more = combine(own, intake('walk/3.ply', 'walk/2.ply'), true);
  expect(more.scans.map(({ name }) => name)).toEqual(['walk/2.ply', 'walk/3.ply', 'walk/10.ply']);

  const compared = combine(sample, { ...intake(), reference: file('mine.tum') }, false);
  expect([compared.title, compared.origin, compared.reference?.name]).toEqual(['Sample', 'sample', 'mine.tum']);

  const log = (name: string): Intake => ({ ...intake(), scans: [{ ...file(name), isLog: true }] });
  const logged = combine(own, log('hall.log'), false);
  expect(logged.scans.map(({ name }) => name)).toEqual(['hall.log']);
  expect(combine(logged, { ...intake(), reference: file('mine.tum') }, false).scans).toEqual(logged.scans);
  const both = combine(logged, log('attic.log'), true);
  expect([both.title, ...both.scans.map(({ name }) => name)]).toEqual([
    'attic.log and hall.log',
    'attic.log',
    'hall.log',
  ]);
});

test('settings go to the screen and back, and into an address and back', () => {
  const angle = {
    name: 'turn' as const,
    group: 'g',
    unit: 'rad' as const,
    kind: { type: 'number' as const, min: 0, max: 1, step: 0.1 },
  };
  const count = {
    name: 'count' as const,
    group: 'g',
    unit: '' as const,
    kind: { type: 'integer' as const, min: 1, max: 9 },
  };
  const way = {
    name: 'way' as const,
    group: 'g',
    unit: '' as const,
    kind: { type: 'choice' as const, choices: [{ value: 'a' }, { value: 'b' }] },
  };
  expect(toScreen(angle, (35 * Math.PI) / 180)).toBe('35');
  expect(fromScreen(angle, '35')).toBeCloseTo((35 * Math.PI) / 180, 12);
  expect(fromScreen(angle, '90')).toBe(1);
  expect(fromScreen(angle, '')).toBeNull();
  expect(fromScreen(angle, 'wide')).toBeNull();
  expect(fromScreen(count, '3.6')).toBe(4);
  expect(zeroWord('Side of the voxels. 0: derived from the first cloud.')).toBe('auto');
  expect(zeroWord('At most 3.0: no more. 0: all pairs.')).toBe('all');
  expect(zeroWord('Between 0 and 1.')).toBeNull();

  const base = { turn: 0.5, count: 2, way: 'a' };
  const changed = parseSettings('turn=0.25&count=100&way=b&strange=1', base, [angle, count, way]);
  expect(changed).toEqual({ turn: 0.25, count: 9, way: 'b' });
  expect(parseSettings('way=c&count=x', base, [angle, count, way])).toEqual(base);
  expect(parseSettings(writeSettings(changed, base), base, [angle, count, way])).toEqual(changed);
  expect(writeSettings(base, base)).toBe('');
  const fields = [
    { ...angle, label: 'Turn' },
    {
      ...way,
      label: 'Way',
      kind: {
        ...way.kind,
        choices: [
          { value: 'a', label: 'First' },
          { value: 'b', label: 'Second' },
        ],
      },
    },
  ];
  expect(changeWords(fields, base, changed)).toEqual(['Turn: 28.6479° → 14.3239°', 'Way: First → Second']);
});

test('numbers are written as people read them', () => {
  const plain = (text: string): string => text.replaceAll('\u202f', ' ');
  expect(plain(formatLength(0.0157))).toBe('15.7 mm');
  expect(plain(formatLength(0.1214))).toBe('121 mm');
  expect(plain(formatLength(2))).toBe('2.00 m');
  expect(plain(formatStep(-0.0347))).toBe('−34.7 mm');
  expect(plain(formatStep(2.5e-7))).toBe('0.25 µm');
  expect(formatAngle(-Math.PI / 2)).toBe('−90.00°');
  expect(formatFixed(-0.0001, 2)).toBe('0.00');
  expect(formatFixed(Number.NaN, 2)).toBe('not a number');
  expect(plain(formatCount(1234567))).toBe('1 234 567');
  expect(plain(formatDuration(4.26))).toBe('4.3 ms');
  expect(plain(formatDuration(61_000))).toBe('1 min 1 s');
  expect(plain(formatDuration(119_700))).toBe('2 min 0 s');
});

test('results are said in words', () => {
  const cleaning = { num_read: 180, non_finite: 2, too_near: 0, at_range_limit: 3, duplicates: 1, num_kept: 174 };
  expect(cleaningWords(cleaning)).toBe('174 of 180 used; left out: 2 not a number, 3 at the range limit, 1 duplicate');
  expect(directionWords({ x: 0, y: -1, theta: 0.1 })).toContain('90°');
  expect(directionWords({ x: 0, y: 0.1, theta: 1 })).toContain('heading');
});

test('no more points and frames are examined than the documented maximum', () => {
  let num_read = 0;
  const counting = {
    get x() {
      num_read++;
      return 0;
    },
    y: 0,
    theta: 0,
  };
  const points = new Float32Array(2 * 30_000).fill(1);
  mapBounds({ points, offsets: Uint32Array.of(0, 30_000) }, [counting]);
  expect(num_read).toBeLessThan(20_010);
  num_read = 0;
  const offsets = Uint32Array.from({ length: 100 }, (_, frame) => frame);
  lookDirection({ points: new Float32Array(2 * 99).fill(1), offsets }, Array<typeof counting>(99).fill(counting));
  expect(num_read).toBeLessThanOrEqual(50);
});

test('a logarithmic axis fits lines of which one is empty, and one value alone', () => {
  const line = { stride: 1, offset: 0, color: '#000', width: 1, isDashed: false };
  const series = [
    { ...line, x: [], values: [] },
    { ...line, x: [0], values: [0.02] },
  ];
  const colors = {
    text: '',
    muted: '',
    line: '',
    background: '',
    reference: '',
    selected: '',
    estimates: [],
    ramp: [],
  };
  for (const shown of [series, series.slice(0, 1)]) {
    const pen = new SvgPen();
    drawSeries(pen, SIZE, shown, linearAxis({ low: 0, high: 1 }), { x: '', y: '' }, colors, 'log_fitted', '.0e');
    expect(pen.finish(SIZE.width, SIZE.height)).not.toContain('NaN');
  }
});

test('rows without a value come last, whichever way they are sorted', () => {
  const rows = [2, null, 3, 1];
  expect(sorted(rows, (value) => value, false)).toEqual([1, 2, 3, null]);
  expect(sorted(rows, (value) => value, true)).toEqual([3, 2, 1, null]);
});

test('a stop before the first slice of a run is obeyed', async () => {
  const told: unknown[] = [];
  const worker = { postMessage: (message: unknown) => told.push(message) } as unknown as Worker & typeof self;
  Object.assign(globalThis, { self: worker });
  let num_steps = 0;
  const scans = { set_settings() {}, add_scan() {}, summary: () => ({ frames: [] }) };
  const map = { map_points: () => new Float32Array(), map_sizes: () => new Uint32Array() };
  const step = () => ({ stage: num_steps++ > 3 ? 'done' : 'register', frame: null, done: 0, total: 1 });
  const { servePlanar } = await import('../../www/src/engine/planar-thread.js');
  servePlanar({
    Reconstruction: function () {
      return { ...scans, ...map, step };
    },
  } as never);
  const call = (method: string, ...args: unknown[]): unknown =>
    worker.onmessage?.({ data: { id: 0, method, args } } as MessageEvent);
  const input = { scans: [{ name: '0.ply', bytes: new ArrayBuffer(0) }], reference: null, odometry: null };
  await call('load', 1, input, {}, true);
  void call('resume', 2);
  void call('stop');
  // By a channel, too, the first slice is put off until the messages have been read: it has had its turn then.
  const { port1, port2 } = new MessageChannel();
  for (let turn = 0; turn < 2; turn++) {
    const passed = new Promise((resolve) => (port1.onmessage = resolve));
    port2.postMessage(null);
    await passed;
  }
  port1.close();
  expect(num_steps).toBe(0);
  expect(JSON.stringify(told)).toContain('"state":"stopped"');
});
