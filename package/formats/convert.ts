/**
 * Files that are packed, or whose format the engine does not read, as files that it reads: they keep their paths, but for the
 * ending of what was packed, and are converted when they are read. To list them, packed files, files of MATLAB, text scans and text
 * clouds are read and converted once as a whole; of the others a beginning is enough.
 */
import { unpackedName } from '../archive/packed.js';
import { isBagName } from '../bag/names.js';
import { fileError, lost, type Note, notUsed } from '../base/errors.js';
import { lookUp } from '../base/look_up.js';
import { inUtf8, markedUtf16 } from '../base/utf16.js';
import type { Content } from '../files/content.js';
import { HEAD_BYTES } from '../files/heads.js';
import { isCloudName, isImageName } from '../files/kinds.js';
import { isLaserLog, isOfLabels, isTable } from '../files/laser_logs.js';
import { baseOf, folderOf, groupBy, hintOf } from '../files/names.js';
import { knownCamera } from './known_cameras.js';
import { DEPTH_TABLES, FOREIGN, POINT_TABLES, READERS, SCAN_TABLES, SCAN_TEXTS, TEXTS } from './names.js';
import type { CountAlike } from './numpy.js';
import type { Tell } from './scan_checks.js';

/** columns: of x, y and z, or of x and y; polar: the table where they are bearings and ranges */
type PointTable = { columns: number[]; polar: Uint8Array | null };

/** Tables of points are as likely a trajectory where they are called so. */
const TRAJECTORY_WORDS = /traj|pose|odom|path|truth|gt|ref|list|calib|time/i;
const TEXT_CLOUDS = /\.(pts|ptx|asc)$/i;
/** A text of positions that is larger is a cloud, and no trajectory. */
const MIN_XYZ_BYTES = 2e5;
/** What has been converted is kept, up to so many bytes of a file. */
const MAX_KEPT = 2 ** 22;
/** Of more texts, none is looked into for scans, nor for UTF-16. */
const MAX_SCAN_TEXTS = 200;
/** SICK's binary telegrams begin with it; no text does. */
const STX = 2;

/** @param wrap what was made of a file as one of the same kind */
export async function convertFiles<T extends Content>(
  given: readonly T[],
  wrap: (content: Content, of: T) => T,
): Promise<{ files: T[]; notes: Note[] }> {
  const notes: Note[] = [];
  const files = await withUtf8(given, wrap);
  const pointTables = await findPointTables(files);
  const textClouds = new Set(files.filter(({ path, size }) => isTextCloud(path, size, files)));
  const scanTexts = files.filter(({ path }) => SCAN_TEXTS.test(path) || SCAN_TABLES.test(path));
  // Poses and cameras, a file a frame, are no scans.
  const mayBeScans = new Set(scanTexts.length <= MAX_SCAN_TEXTS ? scanTexts : []);
  const hasArrays = files.some(({ path }) => /\.npy$/i.test(path));
  const alike = hasArrays ? await (await import('./numpy.js')).countAlike(files) : undefined;
  /** @returns the file itself, where it is not converted */
  const make = async (file: T): Promise<Content | Content[]> => {
    const { path } = file;
    const points = pointTables.get(file);
    if (points !== undefined) return pointTable(file, points, notes);
    if (textClouds.has(file)) return textFile(file, notes);
    if (FOREIGN.test(path) && !isBagName(path)) return convert(file, notes, alike);
    const isOfDepth = [baseOf(path), baseOf(folderOf(path))].some((name) => hintOf(name) === 'depth');
    if (DEPTH_TABLES.test(path) && isOfDepth) return depthTable(file);
    if (!mayBeScans.has(file)) return file;
    return (/\.json$/i.test(path) ? await jsonClouds(file) : null) ?? scanText(file, notes);
  };
  const converted: T[] = [];
  for (const file of files) {
    try {
      const made = await make(file);
      for (const content of Array.isArray(made) ? made : [made]) {
        converted.push(content === file ? file : wrap(content, file));
      }
    } catch (error) {
      notes.push(notUsed(file.path, error));
    }
  }
  return { files: withKnownCamera(await withVelodynePoses(converted, wrap, notes), wrap, notes), notes };
}

function withKnownCamera<T extends Content>(files: T[], wrap: (content: Content, of: T) => T, notes: Note[]): T[] {
  const known = knownCamera(files);
  const beside = files.find(({ path }) => path === known?.at);
  if (!known || !beside) return files;
  const bytes = new TextEncoder().encode(known.text);
  const path = [folderOf(beside.path), 'camera.yaml'].filter(Boolean).join('/');
  notes.push({ file: beside.path, reason: known.reason });
  return [
    ...files,
    wrap(
      madeOf(beside, async () => bytes, { path, size: bytes.length }),
      beside,
    ),
  ];
}

/** Texts in UTF-16, as PowerShell's `>` writes them, in UTF-8. */
async function withUtf8<T extends Content>(
  files: readonly T[],
  wrap: (content: Content, of: T) => T,
): Promise<readonly T[]> {
  if (files.filter(({ path }) => TEXTS.test(path)).length > MAX_SCAN_TEXTS) return files;
  return Promise.all(
    files.map(async (file) => {
      if (!TEXTS.test(file.path)) return file;
      const head = await file.readHead(2).catch(() => new Uint8Array());
      return markedUtf16(head)
        ? wrap(
            madeOf(file, async () => inUtf8(await file.read())),
            file,
          )
        : file;
    }),
  );
}

/** @returns the file itself, where it is not converted */
async function convert(file: Content, notes: Note[], alike: CountAlike = () => 1): Promise<Content | Content[]> {
  const { path } = file;
  const inner = unpackedName(path);
  if (inner !== null) return unpacked(file, inner, notes);
  const ending = path.slice(path.lastIndexOf('.') + 1).toLowerCase();
  if (ending === 'bin') return kittiFile(file, notes);
  if (ending === 'mat') return matFile(file);
  if (ending === 'npy') return (await import('./numpy.js')).npyContents(file, alike);
  if (ending === 'npz') return (await import('./numpy.js')).npzContents(file);
  if (ending === 'pcd') return pcdFile(file);
  const load = lookUp(READERS, ending);
  return load ? (await load()).convert(file, { madeOf, notes }) : file;
}

/** Whether a file is a cloud as text: of a small `.xyz` alone, the positions of a trajectory are as likely. */
function isTextCloud(path: string, size: number, files: readonly Content[]) {
  if (TEXT_CLOUDS.test(path)) return true;
  const isXyz = (name: string) => /\.xyz$/i.test(name) && !TRAJECTORY_WORDS.test(baseOf(name));
  return isXyz(path) && (size > MIN_XYZ_BYTES || files.filter((file) => isXyz(file.path)).length > 1);
}

/** A file that is made of another one when it is read. */
function madeOf(file: Content, make: () => Promise<Uint8Array>, changes: Partial<Content> = {}): Content {
  let kept: Uint8Array | null = null;
  let head: Uint8Array | null = null;
  const read = async () => {
    if (kept) return kept.slice();
    const bytes = await make();
    if (bytes.length <= MAX_KEPT) kept = bytes.slice();
    head = bytes.slice(0, HEAD_BYTES);
    return bytes;
  };
  return {
    path: file.path,
    size: file.size,
    read,
    readHead: async (length) => (head && length <= head.length ? head : await read()).slice(0, length),
    ...changes,
  };
}

/** The first bytes of a file; none of one that cannot be read. */
function headOf(file: Content) {
  return file.readHead(HEAD_BYTES).catch(() => new Uint8Array());
}

/** The clouds of a file, numbered where they are several. */
function cloudsOf(file: Content, make: () => Promise<Uint8Array[]>, sizes: readonly number[], ending: string) {
  const stem = file.path.replace(/\.\w+$/, '');
  return sizes.map((size, at) =>
    madeOf(file, async () => (await make())[at] ?? new Uint8Array(), {
      path: `${stem}${sizes.length > 1 ? `_${at + 1}` : ''}${ending}`,
      size,
      isCloud: true,
    }),
  );
}

async function unpacked(file: Content, inner: string, notes: Note[]): Promise<Content | Content[]> {
  if (/\.tar$/i.test(inner)) {
    throw fileError(file.path, 'An archive within an archive or a folder is not opened', 'Unpack it, or give it alone');
  }
  if (unpackedName(inner) !== null) throw fileError(file.path, 'It is packed twice', 'Unpack it once');
  const [{ unpackWhole }, { bytesInMemory }] = await Promise.all([
    import('../archive/packed.js'),
    import('../archive/open.js'),
  ]);
  const unpack = async () => unpackWhole(file.path, bytesInMemory(await file.read()));
  const { bytes, fault } = await unpack();
  if (fault !== null) notes.push(lost(file.path, `${fault}; what was packed before that is used`));
  const made = madeOf(file, async () => (await unpack()).bytes, { path: inner, size: bytes.length });
  return FOREIGN.test(inner) && unpackedName(inner) === null ? convert(made, notes) : made;
}

async function kittiFile(file: Content, notes: Note[]): Promise<Content> {
  const { isLdrobot } = await import('./ldrobot.js');
  if ((await file.readHead(1))[0] === STX || isLdrobot(await file.readHead(HEAD_BYTES))) return scanText(file, notes);
  const { kittiCloud } = await import('./kitti.js');
  if (!kittiCloud(await file.readHead(HEAD_BYTES), file.size)) return file;
  const make = (bytes: Uint8Array) => kittiCloud(bytes, file.size) ?? new Uint8Array();
  return madeOf(file, async () => make(await file.read()), {
    isCloud: true,
    readHead: async (length) => make(await file.readHead(Math.max(length, HEAD_BYTES))).subarray(0, length),
  });
}

async function matFile(file: Content): Promise<Content | Content[]> {
  const [{ readMat }, { cloudsOf, contentsOf, tableOf }] = await Promise.all([
    import('./mat.js'),
    import('./array_table.js'),
  ]);
  const variables = await readMat(file.path, await file.read());
  const clouds = cloudsOf(variables);
  if (clouds.length > 1) {
    const { points } = await import('./npy_files.js');
    return clouds.map(({ name, columns, points: rows }) => {
      const ply = points(rows, columns);
      const path = file.path.replace(/\.mat$/i, `_${name}.ply`);
      return madeOf(file, async () => ply, { path, size: ply.length, isCloud: true });
    });
  }
  const make = async () => {
    const table = tableOf(await readMat(file.path, await file.read()));
    if (table) return table;
    const holds = contentsOf(variables);
    const remedy = "Save plain arrays, a row a scan: save('scans.mat', 'ranges', 'angles', '-v7')";
    throw fileError(file.path, `There are neither scans nor poses in this file of MATLAB; it holds ${holds}`, remedy);
  };
  const { length } = await make();
  return madeOf(file, make, { size: length });
}

/** A planar scan as PLY; other clouds the engine reads itself. */
async function pcdFile(file: Content): Promise<Content> {
  const { isPlanarPcd, plyOfPcd } = await import('./planar_pcd.js');
  const head = await headOf(file);
  return isPlanarPcd(head) ? madeOf(file, async () => plyOfPcd(await file.read())) : file;
}

/** @returns a PTX may hold several */
async function textFile(file: Content, notes: Note[]): Promise<Content[]> {
  const { pointColumns, textClouds } = await import('./text_cloud.js');
  const make = async () => {
    const bytes = await file.read();
    const columns = pointColumns(bytes.subarray(0, HEAD_BYTES)) ?? undefined;
    return textClouds(bytes, columns).filter(({ count }) => count > 0);
  };
  const clouds = await make();
  if (clouds.length === 0) {
    throw fileError(file.path, 'No line of it begins with x y z', 'Save the points as text, x y z a line');
  }
  for (const reason of new Set(clouds.flatMap((cloud) => cloud.notes))) notes.push({ file: file.path, reason });
  for (const { loss } of clouds) if (loss !== null) notes.push(lost(file.path, loss));
  const makePly = async () => (await make()).map(({ ply }) => ply);
  const sizes = clouds.map(({ ply }) => ply.length);
  return cloudsOf(file, makePly, sizes, file.path.slice(file.path.lastIndexOf('.')));
}

/** The clouds of a document in JSON; null where it is none. */
async function jsonClouds(file: Content): Promise<Content[] | null> {
  const { cloudsOfJson, isCloudJson } = await import('./json_clouds.js');
  const head = await headOf(file);
  if (!isCloudJson(new TextDecoder().decode(head))) return null;
  const make = async () => cloudsOfJson(new TextDecoder().decode(await file.read()));
  const sizes = (await make()).map(({ length }) => length);
  return cloudsOf(file, make, sizes, '.ply');
}

/** A depth image as text; the file itself where it is none. */
async function depthTable(file: Content): Promise<Content> {
  const { depthOfTable, isDepthTable } = await import('./depth_table.js');
  const head = await headOf(file);
  if (head.includes(0) || !isDepthTable(new TextDecoder().decode(head))) return file;
  const make = async () => depthOfTable(file.path, await file.read());
  const { length } = await make();
  return madeOf(file, make, { path: file.path.replace(/\.\w+$/, '.pfm'), size: length });
}

/** Scans as a program prints or a device sends them; the file itself where it is none. */
async function scanText(file: Content, notes: Note[]): Promise<Content> {
  const head = await headOf(file);
  const isBinary = head.includes(0);
  // Lines of numbers may be a table, but not where words say which program wrote them.
  if (!isBinary && ((isLaserLog(head) && !isTable(head)) || isOfLabels(file.path, head))) return file;
  const [{ fromLdrobot, fromSick, scanReader, tableScanReader }, { isSickBinary }, { isLdrobot }] = await Promise.all([
    import('./scan_messages.js'),
    import('./sick.js'),
    import('./ldrobot.js'),
  ]);
  const decode = (bytes: Uint8Array) => new TextDecoder().decode(bytes);
  const readerOf = (text: string) =>
    SCAN_TABLES.test(file.path) ? tableScanReader(text) : scanReader(text, TRAJECTORY_WORDS.test(baseOf(file.path)));
  const reader = isBinary ? null : readerOf(decode(head));
  const fromBytes = isSickBinary(head) ? fromSick : isLdrobot(head) ? fromLdrobot : null;
  if (!reader && !fromBytes) return file;
  const make = async (tell: Tell = () => undefined) => {
    const bytes = await file.read();
    const text = reader ? reader(decode(bytes), file.path, tell) : (fromBytes?.(bytes, file.path, tell) ?? '');
    return new TextEncoder().encode(text);
  };
  const { length } = await make((reason, isLoss = false) => {
    notes.push(isLoss ? lost(file.path, reason) : { file: file.path, reason });
  });
  return madeOf(file, () => make(), { size: length });
}

/**
 * Tables of points, two or more, where nothing else could be scans; one alone is rather a trajectory, unless its
 * columns say that a
 * laser wrote it.
 */
async function findPointTables<T extends Content>(files: readonly T[]): Promise<Map<T, PointTable>> {
  const tables: Map<T, PointTable> = new Map();
  const isOther = ({ path = '' }) => isCloudName(path) || isImageName(path) || isBagName(path) || FOREIGN.test(path);
  const named = files.filter(({ path }) => POINT_TABLES.test(path) && !TRAJECTORY_WORDS.test(baseOf(path)));
  if (named.length === 0 || files.some(isOther)) return tables;
  const [{ isLaserTable, looksLikePoints, numberRows }, { polarTable }, { isNumberedPoints }] = await Promise.all([
    import('./text_cloud.js'),
    import('./polar.js'),
    import('./point_scans.js'),
  ]);
  let isOfLaser = false;
  for (const file of files) {
    const head = await headOf(file);
    const isNumbered = isNumberedPoints(new TextDecoder().decode(head));
    const columns = named.includes(file) && !isNumbered ? looksLikePoints(head) : null;
    const isTold = columns !== null && isLaserTable(head);
    if (!isTold && isLaserLog(head)) return new Map();
    const polar = columns?.length === 2 && file.size <= MAX_KEPT ? polarTable(numberRows(await file.read())) : null;
    if (columns !== null) tables.set(file, { columns, polar });
    isOfLaser ||= isTold || polar !== null;
  }
  return tables.size < 2 && !isOfLaser ? new Map() : tables;
}

function pointTable(file: Content, { columns, polar }: PointTable, notes: Note[]): Content {
  if (polar) {
    notes.push({ file: file.path, reason: 'its columns are taken for bearings, evenly spaced, and ranges' });
    return madeOf(file, async () => polar, { size: polar.length });
  }
  const make = async () => (await import('./text_cloud.js')).textClouds(await file.read(), columns)[0]?.ply;
  return madeOf(file, async () => (await make()) ?? new Uint8Array(), { isCloud: true });
}

/** Poses of KITTI's left camera as those of its laser, for the clouds that are there. */
async function withVelodynePoses<T extends Content>(
  files: T[],
  wrap: (content: Content, of: T) => T,
  notes: Note[],
): Promise<T[]> {
  const clouds = files.filter(({ path, isCloud }) => isCloud && /\.bin$/i.test(path));
  if (clouds.length < 2) return files;
  const { besideClouds, cameraFromVelodyne, frameOf, posesOf, velodynePoses } = await import('./kitti.js');
  const [folder = ''] = [...groupBy(clouds, ({ path }) => folderOf(path)).keys()];
  const { calibration, poses } = besideClouds(files, folder);
  if (!poses) return files;
  const text = async (file: Content) => new TextDecoder().decode(await file.read());
  const cameras = posesOf(await text(poses));
  if (!cameras) return files;
  const Tr = calibration ? cameraFromVelodyne(await text(calibration)) : null;
  if (!Tr) {
    const remedy = 'give the calib.txt of its sequence, with Tr';
    notes.push({
      file: poses.path,
      reason: `poses of the camera, compared as they are, for the laser's place is unknown; ${remedy}`,
    });
    return files;
  }
  const numbers = clouds.map(({ path }) => frameOf(path) ?? -1).sort((a, b) => a - b);
  const used = cameras.length === clouds.length ? cameras : numbers.flatMap((number) => [cameras[number] ?? []]);
  if (used.some((pose) => pose.length === 0)) return files;
  const bytes = new TextEncoder().encode(velodynePoses(used, Tr));
  const reason = `poses of the left camera, carried over to the laser by Tr of ${baseOf(calibration?.path ?? '')}`;
  notes.push({ file: poses.path, reason });
  const made = madeOf(poses, async () => bytes, { size: bytes.length });
  return files.flatMap((file) => (file === poses ? [wrap(made, poses)] : file === calibration ? [] : [file]));
}
