/**
 * The camera of depth images in a file of another program: OpenCV (YAML, XML), ROS's camera_info, Open3D, RealSense, Kalibr,
 * ORB-SLAM, ScanNet, BOP, nerfstudio, InfiniTAM, Azure Kinect, plain numbers. Fields are known by their names, matrices by their form:
 * `fx 0 cx, 0 fy cy, 0 0 1`, row by row or column by column.
 */
import { fileError } from '../base/errors.js';
import { haveDecimalCommas } from '../base/units.js';
import { inUtf8 } from '../base/utf16.js';
import type { Size } from '../files/heads.js';
import { readDocument, readLabels } from './documents.js';
import { EXIF_BYTES, focalShare } from './exif.js';
import { isSameAspect } from './image_sizes.js';
import { type Camera, type Chosen, round, scaled } from './scaled_camera.js';

const REMEDY = 'Give a matrix fx 0 cx 0 fy cy 0 0 1, or fx fy cx cy, in pixels';
/** Longer files are no cameras; a thousand frames with a matrix each fit. */
export const MAX_CAMERA_BYTES = 16 * 2 ** 20;

/** Names of the two focal lengths and the principal point, without case and signs. */
const PARAMETERS = [
  ['fx', 'fy', 'cx', 'cy'],
  ['fx', 'fy', 'ppx', 'ppy'],
  ['fx', 'fy', 'mx', 'my'],
  ['fx', 'fy', 'u0', 'v0'],
  ['flx', 'fly', 'cx', 'cy'],
  ['fu', 'fv', 'cu', 'cv'],
  ['focalx', 'focaly', 'principalx', 'principaly'],
  ['focallengthx', 'focallengthy', 'principalpointx', 'principalpointy'],
];
const WIDTHS = ['width', 'w', 'imagewidth', 'imgwidth', 'resx'];
const HEIGHTS = ['height', 'h', 'imageheight', 'imgheight', 'resy'];
const DEPTH_SCALE = /(depthscale|depthmapfactor|depthfactor|depthshift|depthunit(s|scalefactor)?)$/;
/** Models that are no pinhole with a little distortion: their focal lengths mean something else. */
const OTHER_MODELS = /omni|eucm|double_?sphere|\bds\b|fisheye|equidistant|kannala|mei\b/i;

function plain(name: string) {
  return name.toLowerCase().replaceAll(/[^a-z0-9]/g, '');
}

/**
 * The cameras that a file describes, in its order.
 * @returns empty: it describes none
 */
export function readCameras(bytes: Uint8Array): Camera[] {
  const text = new TextDecoder().decode(inUtf8(bytes)).replace(/^\uFEFF/, '');
  const numbers = plainNumbers(text);
  const plainCameras = numbers ? ofNumbers(numbers) : [];
  if (plainCameras.length > 0) return plainCameras;
  const blocks = ofBlocks(text);
  if (blocks.length > 0 || numbers) return blocks;
  const colmap = ofColmap(text);
  if (colmap.length > 0) return colmap;
  const readers = [readDocument, readLabels, readTable];
  return readers.map((read) => ofTree(read(text))).find((cameras) => cameras.length > 0) ?? [];
}

/** The rows of a table under the names of its columns. */
function readTable(text: string): Record<string, number>[] {
  const [names = [], ...rows] = text.split(/\r\n|\r|\n/).map((line) => line.split(/[,;\t]/).map((cell) => cell.trim()));
  const isRow = (row: string[]) => row.length === names.length;
  return rows.filter(isRow).map((row) => Object.fromEntries(names.map((name, at) => [name, Number(row[at])])));
}

/** All of a text's numbers; null where there is anything else but comments and brackets. */
function plainNumbers(text: string) {
  const withPoints = haveDecimalCommas(text.split('\n')) ? text.replaceAll(',', '.') : text;
  const words = withPoints
    .replaceAll(/(#|\/\/).*/g, ' ')
    .split(/[\s,;[\]]+/)
    .filter((word) => word !== '');
  const numbers = words.map(Number);
  return words.length > 0 && words.length <= 32 && numbers.every(Number.isFinite) ? numbers : null;
}

function ofNumbers(numbers: number[]): Camera[] {
  const matrix = ofMatrix(numbers);
  if (matrix) return [camera('', matrix)];
  const isSize = (pair: number[]) => pair.every((side) => Number.isInteger(side) && side > 1);
  const [a = 0, b = 0, ...rest] = numbers;
  // Of six, two are the image's size, in front or behind: the principal point lies about its middle.
  if (numbers.length === 6 && isSize([a, b]) && isCentre(rest.slice(2), [a, b])) {
    return [{ ...camera('', rest), size: { width: a, height: b } }];
  }
  const size = numbers.slice(4);
  if (numbers.length === 6 && isSize(size) && isCentre(numbers.slice(2, 4), size)) {
    return [{ ...camera('', numbers), size: { width: size[0] ?? 0, height: size[1] ?? 0 } }];
  }
  // LSD-SLAM and DSO: shares of the image's sides, then one coefficient of the distortion.
  if ((numbers.length === 4 || numbers.length === 5) && isShares(numbers)) {
    return [{ ...camera('', numbers), distortion: numbers.slice(4), isInShares: true }];
  }
  // TUM's tools: the parameters, then five coefficients of the distortion.
  if (numbers.length === 4 || numbers.length === 9) {
    return isFocal(a) && isFocal(b) ? [{ ...camera('', inOrder(numbers)), distortion: numbers.slice(4) }] : [];
  }
  return [];
}

/** Two cameras between empty lines, of the colours and of the depth images, as InfiniTAM has them: size, focal lengths, centre. */
function ofBlocks(text: string): Camera[] {
  const cameras = text.split(/\n\s*\n/).flatMap((block) => ofNumbers(plainNumbers(block) ?? []));
  return cameras.length === 2 ? cameras.map((one, at) => ({ ...one, label: at === 0 ? 'color' : 'depth' })) : [];
}

/** `ID MODEL WIDTH HEIGHT PARAMETERS` a line, as COLMAP's cameras.txt; its pixels are counted from the image's corner. */
function ofColmap(text: string): Camera[] {
  const lines = [...text.matchAll(/^\s*\d+\s+([A-Z_]+)\s+(\d+)\s+(\d+)((?:\s+-?[\d.]+(?:e[-+]?\d+)?)+)\s*$/gim)];
  return lines.flatMap(([, model = '', width, height, rest = '']) => {
    const numbers = rest.trim().split(/\s+/).map(Number);
    const isSimple = /^(SIMPLE_|RADIAL$)/.test(model);
    const [fx = 0, fy = 0, cx = 0, cy = 0, ...distortion] = isSimple ? [numbers[0] ?? 0, ...numbers] : numbers;
    if (OTHER_MODELS.test(model) || !isFocal(fx)) return [];
    const size = { width: Number(width), height: Number(height) };
    return [{ ...camera(model, [fx, fy, cx - 0.5, cy - 0.5]), size, distortion }];
  });
}

function isCentre([x = 0, y = 0]: number[], [width = 0, height = 0]: number[]) {
  return Math.abs(x / width - 0.5) < 0.25 && Math.abs(y / height - 0.5) < 0.25;
}

/** Fields of view of 12 to 127 degrees, and a centre near the middle, in shares of the image's sides. */
function isShares([fx = 0, fy = 0, cx = 0, cy = 0]: number[]) {
  return [fx, fy].every((focal) => focal > 0.25 && focal < 5) && isCentre([cx, cy], [1, 1]);
}

/** @param value pixels */
function isFocal(value: number) {
  return Math.abs(value) > 10 && Math.abs(value) < 1e5;
}

/**
 * fx fy cx cy of four numbers that stand as fx cx fy cy, as OpenLORIS has them: focal lengths agree within a few
 * percent, and the
 * principal point is none of them.
 */
function inOrder(numbers: number[]) {
  const [a = 0, b = 0, c = 0, d = 0] = numbers;
  const areAlike = (one: number, other: number) => Math.abs(Math.abs(one) - Math.abs(other)) < 0.02 * Math.abs(one);
  return areAlike(a, c) && !areAlike(a, b) ? [a, c, b, d] : numbers;
}

function camera(label: string, [fx = 0, fy = fx, cx = 0, cy = 0]: number[]): Camera {
  const isFlipped = fx < 0 || fy < 0;
  const focal = { fx: Math.abs(fx), fy: Math.abs(fy) };
  return { label, ...focal, cx, cy, size: null, distortion: [], depth_scale: null, ...(isFlipped && { isFlipped }) };
}

/** fx, fy, cx, cy of a camera's matrix of 3 x 3, 3 x 4 or 4 x 4 numbers, in rows or in columns; null: it is none. */
function ofMatrix(numbers: number[]) {
  const columns = { 9: 3, 12: 4, 16: 4 }[numbers.length];
  if (columns === undefined) return null;
  const rows = numbers.length / columns;
  const at = (row: number, column: number) => numbers[row * columns + column] ?? 0;
  const turned = (row: number, column: number) => numbers[column * rows + row] ?? 0;
  for (const entry of [at, turned]) {
    const [fx, skew, fy] = [entry(0, 0), entry(0, 1), entry(1, 1)];
    const isCamera = isFocal(fx) && isFocal(fy) && Math.abs(skew) < 0.01 * Math.abs(fx) && entry(1, 0) === 0;
    const lastRow = [entry(2, 0), entry(2, 1), entry(2, 2)];
    if (isCamera && lastRow.join() === '0,0,1') return [fx, fy, entry(0, 2), entry(1, 2)];
  }
  return null;
}

/** key: the name without case and signs */
type Field = { name: string; key: string; value: unknown };

function ofTree(tree: unknown): Camera[] {
  const found: Camera[] = [];
  const waiting: { value: unknown; label: string; size: Size | null; distortion: number[] }[] = [
    { value: tree, label: '', size: null, distortion: [] },
  ];
  const scale = { value: null as number | null };
  for (let next = waiting.shift(); next; next = waiting.shift()) {
    const { value, label } = next;
    if (typeof value !== 'object' || value === null) continue;
    const all: Field[] = Object.entries(value).map(([name, inner]) => ({ name, key: plain(name), value: inner }));
    const here = {
      size: Array.isArray(value) ? next.size : (sizeOf(all) ?? next.size),
      distortion: Array.isArray(value) ? next.distortion : (distortionOf(all) ?? next.distortion),
    };
    scale.value ??= depthScaleOf(all);
    for (const { beside, ...one } of Array.isArray(value) ? [] : ofFields(all, label)) {
      const size = sizeBeside(all, beside, one.label) ?? here.size;
      found.push({ size, distortion: here.distortion, ...one });
    }
    const place = all.find(({ key }) => key === 'location')?.value ?? '';
    for (const { name, value: inner } of all)
      waiting.push({ value: inner, label: `${label} ${name} ${place}`, ...here });
  }
  return found.map((one) => ({ ...one, depth_scale: scale.value }));
}

/** beside: what stands before and after the names of its parameters */
type FoundCamera = Pick<Camera, 'label' | 'fx' | 'fy' | 'cx' | 'cy' | 'depth_scale' | 'isFlipped'> & {
  beside: string[];
  size?: Size;
  distortion?: number[];
};

/** The cameras whose parameters are fields of one object. */
function ofFields(all: Field[], label: string): FoundCamera[] {
  if (all.some(({ key, value }) => /model$/.test(key) && OTHER_MODELS.test(String(value)) && !/distortion/.test(key)))
    return [];
  const ofKey = new Map(all.map(({ key, value }) => [key, value]));
  const found: FoundCamera[] = [];
  const add = (name: string, numbers: number[], beside: string[]) => {
    const { size, distortion, ...parameters } = camera(`${label} ${name}`, numbers);
    found.push({ ...parameters, beside });
  };
  for (const names of PARAMETERS) {
    if (found.length > 0) break;
    for (const { name, key } of all) {
      const place = key.indexOf(names[0] ?? '');
      if (place < 0) continue;
      const [before, after] = [key.slice(0, place), key.slice(place + (names[0] ?? '').length)];
      const values = names.map((parameter) => ofKey.get(before + parameter + after));
      const numbers = values.filter((value) => typeof value === 'number');
      if (numbers.length === 4 && isFocal(numbers[0] ?? 0)) add(name, numbers, [before, after]);
    }
  }
  for (const { name, key, value } of found.length > 0 ? [] : all) {
    const numbers = numbersOf(value);
    const parameters =
      numbers &&
      (ofMatrix(numbers) ?? (/intrinsic|projection/.test(key) && numbers.length === 4 ? inOrder(numbers) : null));
    if (parameters && isFocal(parameters[0] ?? 0)) add(name, parameters, ['', '']);
    const focal = parameters || found.length > 0 ? null : focalOfView(key, value, sizeOf(all));
    if (focal) add(name, focal, ['', '']);
    if (key === 'modelparameters' && numbers && !label.includes('PV0')) found.push(...ofAzureKinect(numbers, label));
  }
  return found;
}

/** A field of view that does not say between which sides. */
const OPEN_VIEW = /(^|[^h])fov(_?(deg|rad))?$|field_?of_?view$/i;

/** What a field of view from side to side makes of images of this size: degrees, or radians by its name. */
function focalOfView(key: string, value: unknown, size: Size | null) {
  if (
    !size ||
    typeof value !== 'number' ||
    !/^(h?fov(x|h)?(deg(rees)?|rad(ians)?)?|horizontalfov(deg|rad)?|fieldofview|cameraanglex)$/.test(key)
  )
    return null;
  const angle = /rad|angle/.test(key) || value < Math.PI ? value : (value * Math.PI) / 180;
  const focal = size.width / 2 / Math.tan(angle / 2);
  return isFocal(focal) ? [focal, focal, (size.width - 1) / 2, (size.height - 1) / 2] : null;
}

/** The size of the images where several cameras' stand side by side: `depthWidth`, `colorWidth`. */
function sizeBeside(all: Field[], [before = '', after = '']: string[], label: string): Size | null {
  const role = /depth/i.test(label) ? 'depth' : /colou?r|rgb/i.test(label) ? 'color' : '';
  const named = (names: string[]) =>
    all.find(({ key }) => names.some((name) => [before + name + after, role + name, `m${role}${name}`].includes(key)));
  const [width, height] = [named(WIDTHS)?.value, named(HEIGHTS)?.value];
  return typeof width === 'number' && typeof height === 'number' ? { width, height } : null;
}

function sizeOf(all: Field[]): Size | null {
  const named = (names: string[]) => all.find(({ key }) => names.includes(key.replace(/^camera1?/, '')))?.value;
  const [width, height] = [named(WIDTHS), named(HEIGHTS)];
  if (typeof width === 'number' && typeof height === 'number') return { width, height };
  const pair = numbersOf(all.find(({ key }) => /^(resolution|imagesize|size)$/.test(key))?.value);
  return pair?.length === 2 ? { width: pair[0] ?? 0, height: pair[1] ?? 0 } : sizeInTitle(all);
}

/** As rs-enumerate-devices writes it. */
function sizeInTitle(all: Field[]): Size | null {
  const title = all.find(({ name }) => /^Intrinsic of /.test(name))?.name ?? '';
  const [, width, height] = title.match(/(\d+)x(\d+)/) ?? [];
  return width === undefined ? null : { width: Number(width), height: Number(height) };
}

function distortionOf(all: Field[]): number[] | null {
  const listed = all.find(
    ({ key, value }) => /^(d\d?|(.*)(coeffs|coefficients|distortion|distcoeffs|dist))$/.test(key) && numbersOf(value),
  );
  if (listed) return numbersOf(listed.value);
  const single = all.filter(({ key, value }) => /^(camera1?)?[kp][1-6]$/.test(key) && typeof value === 'number');
  return single.length > 0 ? single.map(({ value }) => Number(value)) : null;
}

/**
 * Raw values per metre. Programs mean three things by the same name: RealSense metres a raw value (0.001), BOP millimetres a
 * raw value (0.1, 1), Open3D and TUM raw values per metre (1000, 5000).
 */
function depthScaleOf(all: Field[]) {
  const isScale = ({ key, value }: Field) =>
    typeof value === 'number' && (DEPTH_SCALE.test(key) || (key === 'scale' && value >= 100));
  const value = all.find(isScale)?.value;
  if (typeof value !== 'number' || !(value > 0) || !(value < 1e6)) return null;
  const scale = value < 0.01 ? 1 / value : value < 5 ? 1000 / value : value;
  return Number(scale.toPrecision(7));
}

/** All numbers of a list, of a list of lists, or of OpenCV's and ROS's `data`; null where there is anything else. */
function numbersOf(value: unknown): number[] | null {
  const list = typeof value === 'object' && value !== null && 'data' in value ? value.data : value;
  if (!Array.isArray(list) || list.length > 16) return null;
  const flat = list.flat();
  return flat.length > 0 && flat.length <= 16 && flat.every((number) => typeof number === 'number') ? flat : null;
}

/**
 * What the modes of an Azure Kinect's depth camera leave of its sensor's 1024 x 1024 pixels (Azure Kinect Sensor SDK):
 * pixels of the sensor a pixel, where the image begins, and its size.
 */
const AZURE_MODES = [
  { binning: 1, left: 192, top: 180, width: 640, height: 576 },
  { binning: 2, left: 96, top: 90, width: 320, height: 288 },
  { binning: 2, left: 0, top: 0, width: 512, height: 512 },
  { binning: 1, left: 0, top: 0, width: 1024, height: 1024 },
];

/** Parameters in shares of the sensor: cx, cy, fx, fy, then the distortion. */
function ofAzureKinect([cx = 0, cy = 0, fx = 0, fy = 0, ...distortion]: number[], label: string): FoundCamera[] {
  return AZURE_MODES.map(({ binning, left, top, width, height }) => {
    const side = 1024 / binning;
    return {
      label: `${label} depth`,
      ...{ fx: fx * side, fy: fy * side, cx: cx * side - left - 0.5, cy: cy * side - top - 0.5 },
      ...{ depth_scale: null, beside: ['', ''], size: { width, height }, distortion },
    };
  });
}

/**
 * The camera of depth images of this size.
 * @param name of the file
 * @param size of the images; null: not known
 */
export function cameraFor(name: string, bytes: Uint8Array, size: Size | null): Chosen {
  const photographed = size && ofPicture(bytes, size);
  if (photographed) return photographed;
  const cameras = readCameras(bytes);
  const ranked = cameras
    .map((one) => ({ one, rank: rankOf(one, size) }))
    .sort((a, b) => b.rank - a.rank)
    .map(({ one }) => one);
  const [best] = ranked;
  if (!best) throw fileError(name, 'No camera was found in this file', REMEDY);
  if (!size && best.isInShares) throw fileError(name, 'Its numbers are shares of the sides of images', REMEDY);
  const { camera, notes } = size ? scaled(name, best, size) : { camera: best, notes: [] };
  if (camera.isFlipped)
    notes.push('its negative focal length, of a renderer with a left-handed world, is taken as positive');
  if (OPEN_VIEW.test(camera.label) && size?.width !== size?.height)
    notes.push('its field of view is taken from side to side; of one from top to bottom, give fx fy cx cy');
  const strong = camera.distortion.filter((coefficient) => Math.abs(coefficient) > 1e-6);
  if (strong.length > 0) {
    const figures = strong.slice(0, 3).map((coefficient) => Number(coefficient.toPrecision(3)));
    notes.push(`its lens distortion (${figures.join(', ')}) is not applied: depth images are taken as rectified`);
  }
  return { camera, notes };
}

/**
 * The camera of a colour picture by its EXIF data, taken for that of depth images that belong to it pixel by pixel.
 * @returns null: it is no picture, or does not say
 */
function ofPicture(bytes: Uint8Array, size: Size): Chosen | null {
  const share = focalShare(bytes.subarray(0, EXIF_BYTES));
  if (share === null) return null;
  const focal = share * Math.hypot(size.width, size.height);
  const found = camera('EXIF', [focal, focal, (size.width - 1) / 2, (size.height - 1) / 2]);
  const note = `its EXIF data give the focal length, ${round(focal)} pixels; it is taken for that of the depth images, too`;
  return { camera: { ...found, size }, notes: [note] };
}

function rankOf(one: Camera, size: Size | null) {
  const role = /depth|\bir\b|infra/i.test(one.label) ? 2 : /colou?r|rgb/i.test(one.label) ? -1 : 0;
  if (!size) return role;
  // Several modes without their sizes: the one whose principal point lies in the middle.
  if (!one.size) return role - 10 * Math.hypot(one.cx / size.width - 0.5, one.cy / size.height - 0.5);
  if (one.size.width === size.width && one.size.height === size.height) return role + 8;
  return isSameAspect(one.size, size) ? role + 4 : role - 8;
}

/** A camera as the engine reads it. */
export function engineCamera({ fx, fy, cx, cy, depth_scale }: Camera) {
  const scale = depth_scale === null ? {} : { depth_scale };
  return new TextEncoder().encode(JSON.stringify({ fx, fy, cx, cy, ...scale }));
}
