// @ts-check
/** Depth images with or without colour: which images are which, what belongs together, how many recordings there are. */
import { append } from '../append.js';
import { compareNaturally } from '../natural_order.js';
import { brokenImage, readImage } from './heads.js';
import { isForeignDepthName, isImageName } from './kinds.js';
import { readLists } from './lists.js';
import { baseOf, commonFolder, contains, depthOf, hintOf, hintOfSeries, nameOf, seriesOf } from './names.js';
import { countMatches, pairUp } from './pairs.js';
import { withTimes } from './stamps.js';

/** @typedef {import('../recording.js').ListedFile} ListedFile */
/** @typedef {import('../recording.js').DepthFrame} DepthFrame */
/** @typedef {import('../recording.js').Note} Note */
/** @typedef {import('./heads.js').ImageFacts} ImageFacts */
/** @typedef {import('./names.js').Series} Series */
/** @typedef {(path: string) => Promise<Uint8Array | null>} Peek the first bytes; null where the file cannot be read */

/** @typedef {Series & { facts: ImageFacts, hint: import('./names.js').Hint | null }} ImageSeries */
/** @typedef {{ root: string, depth: ImageSeries, color: ImageSeries | null }} DepthRecording */

/** NYU's raw recordings: `d-TIME-TICKS.pgm` are a Kinect's raw values, not distances. */
const RAW_KINECT = /(^|\/)d-\d+\.\d+-\d+\.pgm$/i;
const RAW_REASON =
  "not used: a Kinect's raw values (NYU), not distances; convert them with the data set's toolbox (get_synched_frames, project_depth_map), or by 351.3 / (1092.5 - value) metres with the bytes of each value swapped, and save PNG of 16 bits in mm";
/** Distances along the ray of each pixel, as simulators write them beside the depth: Isaac Sim, AirSim's type 2, Unreal. */
const RADIAL =
  /(distance_to_camera|euclidean_?(depth|distance)|depth_?perspective|radial_?depth|(^|\/)img_\w*_2_\d+\.pfm$)/i;
const RADIAL_REASON =
  "not used: distances along each pixel's ray, not along the optical axis; give the depth (Isaac Sim: distance_to_image_plane; AirSim: DepthPlanar), or divide each by sqrt(1 + ((u - cx) / fx)^2 + ((v - cy) / fy)^2)";
/** So many files of a series are looked into: one may be broken. */
const LOOKED_INTO = 3;
const REMEDY =
  'save the depth itself as grey PNG images, of 16 bits (millimetres) or 8, or as NumPy arrays (numpy.save)';

/**
 * The recordings of depth images in these files, the longest first, and what is wrong with the images.
 * @param {readonly ListedFile[]} files
 * @param {Peek} peek
 * @returns {Promise<{ recordings: DepthRecording[], notes: Note[], pictures: ImageSeries[] }>}
 */
export async function findDepthRecordings(files, peek) {
  /** @type {ImageSeries[]} */
  const images = [];
  /** @type {Note[]} */
  const broken = [];
  const isRaw = (/** @type {ListedFile} */ { path }) => RAW_KINECT.test(path);
  for (const series of seriesOf(files.filter(isRaw))) broken.push({ file: nameOf(series), reason: RAW_REASON });
  const isRadial = (/** @type {ListedFile} */ { path }) => isImageName(path) && RADIAL.test(path);
  for (const series of seriesOf(files.filter(isRadial))) broken.push({ file: nameOf(series), reason: RADIAL_REASON });
  const isSeen = (/** @type {ListedFile} */ file) => isImageName(file.path) && !isRaw(file) && !isRadial(file);
  for (const series of seriesOf(files.filter(isSeen))) {
    const { facts, fault } = await lookInto(series, peek);
    if (facts) images.push({ ...series, facts, hint: hintOfSeries(series) });
    else if (fault) broken.push({ file: nameOf(series), reason: `not used: ${fault}` });
  }
  const { depth, color } = tellApart(images);
  const recordings = depth
    .map((series) => {
      const partner = partnerOf(series, color, depth);
      return { root: rootOf(series, partner), depth: series, color: partner };
    })
    .sort(
      (a, b) => b.depth.members.length - a.depth.members.length || compareNaturally(nameOf(a.depth), nameOf(b.depth)),
    );
  const used = new Set(recordings.flatMap(({ depth, color }) => [depth, color]));
  const rest = images.filter((series) => !used.has(series));
  const pictures = rest.filter(({ hint }) => hint !== 'depth');
  const notes = misnamedDepth(rest, files);
  if (recordings.length === 0 && notes.length === 0) append(notes, picturesAlone(pictures));
  append(notes, broken);
  return { recordings, notes, pictures: recordings.length > 0 ? pictures : [] };
}

/**
 * What the first of its files are that can be told; where none can, what is wrong with the first.
 * @param {Series} series
 * @param {Peek} peek
 * @returns {Promise<{ facts: ImageFacts | null, fault: string | null }>}
 */
async function lookInto({ members }, peek) {
  const places = Array.from({ length: LOOKED_INTO }, (_, i) =>
    Math.round((i * (members.length - 1)) / (LOOKED_INTO - 1)),
  );
  /** @type {ImageFacts[]} */
  const seen = [];
  /** @type {string | null} */
  let fault = null;
  for (const place of new Set(places)) {
    const path = members[place]?.path ?? '';
    const head = await peek(path);
    if (!head) continue;
    const facts = readImage(head);
    if (facts) seen.push(facts);
    else fault ??= `${members.length > 1 ? `${baseOf(path)}: ` : ''}${brokenImage(path, head)}`;
  }
  const votes = (/** @type {ImageFacts} */ { channels }) => seen.filter((facts) => facts.channels === channels).length;
  return { facts: seen.sort((a, b) => votes(b) - votes(a))[0] ?? null, fault };
}

/**
 * By the header: grey images are depth, coloured ones are colour images. Names decide where both are grey.
 * @param {ImageSeries[]} images
 */
function tellApart(images) {
  const grey = images.filter(({ facts, hint }) => facts.channels === 'grey' && hint !== 'aside');
  const colored = images.filter(({ facts, hint }) => facts.channels !== 'grey' && hint !== 'aside');
  const isPicture = (/** @type {ImageSeries} */ series) => {
    if (series.facts.bits > 8 || series.hint === 'depth') return false;
    const others = grey.filter((other) => other !== series && countMatches(series.members, other.members) > 0);
    if (others.some(({ facts, hint }) => facts.bits > 8 || hint === 'depth')) return true;
    // A grey picture beside nothing but pictures; but where colours of another name lie beside it, it can only be the depth.
    const nameOf = (/** @type {ImageSeries} */ { folder, pattern }) => `${folder}/${pattern}`.replaceAll(/\d+/g, '#');
    const isOtherName = (/** @type {ImageSeries} */ other) => nameOf(other) !== nameOf(series);
    const beside = colored.filter((other) => countMatches(series.members, other.members) > 0);
    return series.hint === 'color' && !beside.some(isOtherName);
  };
  const depth = grey.filter((series) => !isPicture(series));
  const color = [...grey.filter(isPicture), ...colored.filter(({ hint }) => hint !== 'depth')];
  // Colours that are called depth are a picture only where something else is the depth.
  const misnamed = colored.filter(({ hint, members }) => {
    return (
      hint === 'depth' && depth.some((series) => series.hint === 'color' && countMatches(series.members, members) > 0)
    );
  });
  return { depth, color: [...color, ...misnamed] };
}

/**
 * The colour pictures of these depth images: those nearest to them among the folders, and nearer to no others.
 * @param {ImageSeries} depth
 * @param {ImageSeries[]} colors
 * @param {ImageSeries[]} allDepth
 */
function partnerOf(depth, colors, allDepth) {
  const closeness = (/** @type {ImageSeries} */ a, /** @type {ImageSeries} */ b) => {
    return depthOf(commonFolder(a.folder, b.folder));
  };
  const ranked = colors
    .filter((color) => allDepth.every((other) => closeness(other, color) <= closeness(depth, color)))
    .map((color) => {
      const { pairs, way } = pairUp(depth.members, color.members);
      const matched = pairs.filter(({ color }) => color !== null).length;
      return {
        color,
        rank: [
          closeness(depth, color),
          Number(matched > 0 && way !== 'order'),
          Number(color.hint === 'color'),
          matched,
        ],
      };
    })
    .filter(({ color, rank }) => rank[3] !== 0 || (color.members.length > 1 && depth.members.length > 1))
    .sort((a, b) => rankOrder(a.rank, b.rank) || compareNaturally(nameOf(a.color), nameOf(b.color)));
  return ranked[0]?.color ?? null;
}

/** Descending. @param {number[]} a @param {number[]} b */
function rankOrder(a, b) {
  return a.map((value, index) => (b[index] ?? 0) - value).find((difference) => difference !== 0) ?? 0;
}

/**
 * The folder of the recording: what holds both kinds of images, or what holds a folder called `depth`.
 * @param {ImageSeries} depth
 * @param {ImageSeries | null} color
 */
function rootOf(depth, color) {
  if (color) return commonFolder(depth.folder, color.folder);
  const [, parent = '', last = ''] = depth.folder.match(/^(?:(.*)\/)?([^/]*)$/) ?? [];
  return hintOf(last) === 'depth' ? parent : depth.folder;
}

/**
 * The frames of a recording, in order, and what stays without a partner.
 * @param {DepthRecording} recording
 * @param {readonly ListedFile[]} files
 * @param {(path: string, size: number) => Promise<Uint8Array | null>} read
 * @returns {Promise<{ frames: DepthFrame[], notes: Note[] }>}
 */
export async function framesOf({ root, depth, color }, files, read) {
  const lists = await readLists(root, files, [...depth.members, ...(color?.members ?? [])], read);
  const [dated, datedColors] = [depth, color].map((series) => withTimes(series?.members ?? [], lists.times));
  const fault = dated?.fault ?? datedColors?.fault ?? null;
  // One kind without times: they are paired by their numbers.
  const timesOf = (/** @type {typeof dated} */ kind) =>
    (kind?.members ?? []).map((member) => (fault === null ? member : { ...member, time: null }));
  const [depths, colors] = [timesOf(dated), timesOf(datedColors)];
  const colorOf = new Map(colors.map((member) => [member.path, member]));
  const listed = depths.flatMap((member) => {
    const color = colorOf.get(lists.partners.get(member.path) ?? '');
    return color ? [{ depth: member, color }] : [];
  });
  const taken = new Set(listed.flatMap(({ depth, color }) => [depth, color]));
  const rest = (/** @type {import('./names.js').Member[]} */ members) => members.filter((member) => !taken.has(member));
  const { pairs, unused, way } = pairUp(rest(depths), rest(colors), listed.length === 0);
  const place = new Map(depths.map(({ path }, index) => [path, index]));
  const all = [...listed, ...pairs].sort((a, b) => inTime(a.depth, b.depth, place));
  const frames = all.map(({ depth, color }) => ({
    name: root === '' ? depth.path : depth.path.slice(root.length + 1),
    depth: depth.path,
    color: color?.path ?? null,
    time: depth.time,
  }));
  const notes = color
    ? pairNotes(
        depth,
        color,
        pairs.filter(({ color }) => !color).map(({ depth }) => depth),
        unused,
        way,
      )
    : [];
  if (fault !== null) {
    const reason = `its time stamps ${fault}; the frames are taken in the order of the files, without times`;
    notes.push({ file: (dated?.fault === null ? color : depth)?.folder || nameOf(depth), reason });
  }
  return { frames, notes: [...notes, ...lists.notes] };
}

/**
 * By time, or in the order of the files.
 * @param {import('./names.js').Member} a
 * @param {import('./names.js').Member} b
 * @param {ReadonlyMap<string, number>} place
 */
function inTime(a, b, place) {
  if (a.time !== null && b.time !== null) return a.time - b.time;
  return (place.get(a.path) ?? 0) - (place.get(b.path) ?? 0);
}

/**
 * @param {ImageSeries} depth
 * @param {ImageSeries} color
 * @param {import('./names.js').Member[]} bare depth images without a picture
 * @param {import('./names.js').Member[]} unused pictures without a depth image
 * @param {ReturnType<typeof pairUp>['way']} way
 * @returns {Note[]}
 */
function pairNotes(depth, color, bare, unused, way) {
  const [numDepth, numColor] = [depth.members.length, color.members.length];
  const [first, last] = [depth.members[0], color.members[0]].map((member) => baseOf(member?.path ?? ''));
  if (way === 'none' && unused.length === numColor) {
    const reason = `none of the ${numColor} colour pictures belongs to one of the ${numDepth} depth images by its name (${last} and ${first}): the map is made without colours. Give both the same numbers`;
    return [{ file: color.folder || nameOf(color), reason }];
  }
  /** @type {Note[]} */
  const notes = [];
  if (way === 'order' && bare.length === 0) {
    const reason = `numbered from ${last}, the depth images from ${first}; as there are ${numColor} of each, they are paired in their order`;
    notes.push({ file: color.folder || nameOf(color), reason });
  }
  const [withIt, withThem] =
    way === 'time'
      ? ['taken within 0.02 s of it', 'taken within 0.02 s of them']
      : ['with its number', 'with their number'];
  return [
    ...notes,
    ...each(
      bare,
      depth,
      `no colour picture ${withIt}: used without colours`,
      (count) => `${count} of ${numDepth} depth images have no colour picture ${withThem} and are used without colours`,
    ),
    ...each(
      unused,
      color,
      `not used: no depth image ${withIt}`,
      (count) => `${count} of ${numColor} colour pictures have no depth image ${withThem} and are not used`,
    ),
  ];
}

/**
 * A few files one by one, many in one note.
 * @param {import('./names.js').Member[]} members
 * @param {Series} series
 * @param {string} reason of one
 * @param {(count: number) => string} together of many
 * @returns {Note[]}
 */
function each(members, series, reason, together) {
  if (members.length <= 4) return members.map(({ path }) => ({ file: path, reason }));
  const names = members.slice(0, 3).map(({ path }) => baseOf(path));
  return [{ file: series.folder || nameOf(series), reason: `${together(members.length)} (${names.join(', ')}, ...)` }];
}

/**
 * What is called depth and cannot be used as such.
 * @param {ImageSeries[]} images
 * @param {readonly ListedFile[]} files
 * @returns {Note[]}
 */
function misnamedDepth(images, files) {
  const colored = images.filter(({ hint }) => hint === 'depth');
  const foreign = seriesOf(files.filter(({ path }) => isForeignDepthName(path)));
  return [
    ...colored.map((series) => {
      const { channels, format } = series.facts;
      const held =
        channels === 'palette'
          ? 'the numbers of a palette'
          : format === 'JPEG'
            ? 'a JPEG picture'
            : `${series.facts.bits}-bit colours`;
      const reason = `called depth, but holds ${held}, not distances, which cannot be recovered from it; ${REMEDY}`;
      return { file: nameOf(series), reason };
    }),
    ...foreign
      .filter((series) => series.members.length > 1 && hintOfSeries(series) === 'depth')
      .map((series) => {
        return {
          file: nameOf(series),
          reason: `depth is read from PNG, PGM and PFM images, not from this format; ${REMEDY}`,
        };
      }),
  ];
}

/**
 * Pictures without any depth image.
 * @param {ImageSeries[]} pictures
 * @returns {Note[]}
 */
function picturesAlone(pictures) {
  const [first] = pictures;
  if (!first) return [];
  const total = pictures.reduce((sum, { members }) => sum + members.length, 0);
  const what =
    total === 1 ? 'a picture, and no depth image with it' : `${total} pictures, and no depth image with them`;
  return [{ file: nameOf(first), reason: `${what}; a map needs the depth image of each picture, a grey PNG` }];
}

/**
 * The recordings that were not chosen, and images that belong to no frame.
 * @param {DepthRecording} chosen
 * @param {DepthRecording[]} others
 * @param {ImageSeries[]} pictures
 * @returns {Note[]}
 */
export function leftAside(chosen, others, pictures) {
  const [strays, recordings] = partition(others, ({ depth }) => depth.folder === chosen.depth.folder);
  const titleOf = (/** @type {DepthRecording} */ { root, depth }) => {
    return root === '' || (root === chosen.root && depth !== chosen.depth) ? nameOf(depth) : root;
  };
  const titles = [...new Set(recordings.map(titleOf))];
  const used = `one is used at a time, the longest: ${titleOf(chosen)}, with ${chosen.depth.members.length}`;
  return [
    ...strays.map(({ depth }) => {
      return {
        file: nameOf(depth),
        reason: `not used: not named as the other depth images, ${nameOf(chosen.depth)}`,
      };
    }),
    ...titles.map((title) => {
      const count = recordings
        .filter((recording) => titleOf(recording) === title)
        .reduce((sum, { depth }) => sum + depth.members.length, 0);
      const images = count === 1 ? 'one depth image' : `${count} depth images`;
      return { file: title, reason: `not used: another recording, of ${images}; ${used}` };
    }),
    ...pictures
      .filter(({ folder }) => !others.some(({ root }) => isApart(root, chosen.root) && contains(root, folder)))
      .map((series) => {
        const count = series.members.length === 1 ? 'an image' : 'images';
        return { file: nameOf(series), reason: `not used: ${count} that no frame needs` };
      }),
  ];
}

/** A folder that holds nothing of the chosen recording. @param {string} root @param {string} chosen */
export function isApart(root, chosen) {
  return root !== chosen && !contains(root, chosen);
}

/** @template T @param {T[]} values @param {(value: T) => boolean} isFirst @returns {[T[], T[]]} */
function partition(values, isFirst) {
  return [values.filter(isFirst), values.filter((value) => !isFirst(value))];
}
