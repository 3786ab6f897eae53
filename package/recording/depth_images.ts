/** Depth images with or without colour: which images are which, what belongs together, how many recordings there are. */
import { append } from '../base/append.js';
import type { Note } from '../base/errors.js';
import { compareNaturally } from '../base/natural_order.js';
import { brokenImage, type ImageFacts, readImage } from '../files/heads.js';
import { isForeignDepthName, isImageName } from '../files/kinds.js';
import {
  baseOf,
  commonFolder,
  contains,
  depthOf,
  type Hint,
  hintOf,
  hintOfSeries,
  type Member,
  nameOf,
  type Series,
  seriesOf,
} from '../files/names.js';
import { countMatches, pairUp } from '../files/pairs.js';
import type { DepthFrame, ListedFile } from '../files/recording.js';
import { readLists } from './lists.js';
import { withTimes } from './stamps.js';

/** The first bytes, enough for a header where it is not said how many; null where the file cannot be read. */
export type Peek = (path: string, length?: number) => Promise<Uint8Array | null>;

type ImageSeries = Series & { facts: ImageFacts; hint: Hint | null };
type DepthRecording = { root: string; depth: ImageSeries; color: ImageSeries | null };

/** NYU's raw recordings: `d-TIME-TICKS.pgm` are a Kinect's raw values, not distances. */
const RAW_KINECT = /(^|\/)d-\d+\.\d+-\d+\.pgm$/i;
const RAW_REASON =
  "not used: a Kinect's raw values (NYU), not distances; convert them with the data set's toolbox (get_synched_frames, project_depth_map), or by 351.3 / (1092.5 - value) metres with the bytes of each value swapped, and save PNG of 16 bits in mm";
/** Distances along the ray of each pixel, as simulators write them beside the depth: Isaac Sim, AirSim's type 2, Unreal. */
const RADIAL =
  /(distance_to_camera|euclidean_?(depth|distance)|depth_?perspective|radial_?depth|(^|\/)img_\w*_2_\d+\.pfm$)/i;
const RADIAL_REASON =
  "not used: distances along each pixel's ray, not along the optical axis; give the depth (Isaac Sim: distance_to_image_plane; AirSim: DepthPlanar), or divide each by sqrt(1 + ((u - cx) / fx)^2 + ((v - cy) / fy)^2)";
/** An image that is looked into whole is not larger. */
const MAX_IMAGE_BYTES = 64 * 2 ** 20;
/** So many files of a series are looked into: one may be broken. */
const LOOKED_INTO = 3;
const REMEDY =
  'save the depth itself as grey PNG images, of 16 bits (millimetres) or 8, or as NumPy arrays (numpy.save)';

export interface DepthImages {
  recordings: DepthRecording[];
  notes: Note[];
  pictures: ImageSeries[];
}

/** The recordings of depth images in these files, the longest first, and what is wrong with the images. */
export async function findDepthRecordings(files: readonly ListedFile[], peek: Peek): Promise<DepthImages> {
  const images: ImageSeries[] = [];
  const broken: Note[] = [];
  const isRaw = ({ path }: ListedFile) => RAW_KINECT.test(path);
  for (const series of seriesOf(files.filter(isRaw))) broken.push({ file: nameOf(series), reason: RAW_REASON });
  const isRadial = ({ path }: ListedFile) => isImageName(path) && RADIAL.test(path);
  for (const series of seriesOf(files.filter(isRadial))) broken.push({ file: nameOf(series), reason: RADIAL_REASON });
  const isSeen = (file: ListedFile) => isImageName(file.path) && !isRaw(file) && !isRadial(file);
  for (const series of seriesOf(files.filter(isSeen))) {
    const { facts, fault } = await lookInto(series, peek);
    const hint = hintOfSeries(series);
    const isGrey = facts !== null && hint === 'depth' && (await areShades(series, facts, peek));
    if (facts) images.push({ ...series, facts: isGrey ? { ...facts, channels: 'grey' } : facts, hint });
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

/** What the first of its files are that can be told; where none can, what is wrong with the first. */
async function lookInto({ members }: Series, peek: Peek): Promise<{ facts: ImageFacts | null; fault: string | null }> {
  const places = Array.from({ length: LOOKED_INTO }, (_, i) =>
    Math.round((i * (members.length - 1)) / (LOOKED_INTO - 1)),
  );
  const seen: ImageFacts[] = [];
  let fault: string | null = null;
  for (const place of new Set(places)) {
    const path = members[place]?.path ?? '';
    const head = await peek(path);
    if (!head) continue;
    const facts = readImage(head);
    if (facts) seen.push(facts);
    else fault ??= `${members.length > 1 ? `${baseOf(path)}: ` : ''}${brokenImage(path, head)}`;
  }
  const votes = ({ channels }: ImageFacts) => seen.filter((facts) => facts.channels === channels).length;
  return { facts: seen.sort((a, b) => votes(b) - votes(a))[0] ?? null, fault };
}

/** Whether the first of these images of colours holds shades alone. */
async function areShades({ members }: Series, { format, channels, bits }: ImageFacts, peek: Peek) {
  if (format !== 'PNG' || channels !== 'color' || bits !== 8) return false;
  const whole = await peek(members[0]?.path ?? '', MAX_IMAGE_BYTES);
  const { holdsShades } = await import('../formats/grey_colors.js');
  return whole !== null && holdsShades(whole);
}

/** By the header: grey images are depth, coloured ones are colour images. Names decide where both are grey. */
function tellApart(images: ImageSeries[]) {
  const grey = images.filter(({ facts, hint }) => facts.channels === 'grey' && hint !== 'aside');
  const colored = images.filter(({ facts, hint }) => facts.channels !== 'grey' && hint !== 'aside');
  const isPicture = (series: ImageSeries) => {
    if (series.facts.bits > 8 || series.hint === 'depth') return false;
    const others = grey.filter((other) => other !== series && countMatches(series.members, other.members) > 0);
    if (others.some(({ facts, hint }) => facts.bits > 8 || hint === 'depth')) return true;
    // A grey picture beside nothing but pictures; but where colours of another name lie beside it, it can only be the depth.
    const nameOf = ({ folder, pattern }: ImageSeries) => `${folder}/${pattern}`.replaceAll(/\d+/g, '#');
    const isOtherName = (other: ImageSeries) => nameOf(other) !== nameOf(series);
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

/** The colour pictures of these depth images: those nearest to them among the folders, and nearer to no others. */
function partnerOf(depth: ImageSeries, colors: ImageSeries[], allDepth: ImageSeries[]) {
  const closeness = (a: ImageSeries, b: ImageSeries) => {
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

/** Descending. */
function rankOrder(a: number[], b: number[]) {
  return a.map((value, index) => (b[index] ?? 0) - value).find((difference) => difference !== 0) ?? 0;
}

/** The folder of the recording: what holds both kinds of images, or what holds a folder called `depth`. */
function rootOf(depth: ImageSeries, color: ImageSeries | null) {
  if (color) return commonFolder(depth.folder, color.folder);
  const [, parent = '', last = ''] = depth.folder.match(/^(?:(.*)\/)?([^/]*)$/) ?? [];
  return hintOf(last) === 'depth' ? parent : depth.folder;
}

/** The frames of a recording, in order, and what stays without a partner. */
export async function framesOf(
  { root, depth, color }: DepthRecording,
  files: readonly ListedFile[],
  read: (path: string, size: number) => Promise<Uint8Array | null>,
): Promise<{ frames: DepthFrame[]; notes: Note[] }> {
  const lists = await readLists(root, files, [...depth.members, ...(color?.members ?? [])], read);
  const [dated, datedColors] = [depth, color].map((series) => withTimes(series?.members ?? [], lists.times));
  const fault = dated?.fault ?? datedColors?.fault ?? null;
  // One kind without times: they are paired by their numbers.
  const timesOf = (kind: typeof dated) =>
    (kind?.members ?? []).map((member) => (fault === null ? member : { ...member, time: null }));
  const [depths, colors] = [timesOf(dated), timesOf(datedColors)];
  const colorOf = new Map(colors.map((member) => [member.path, member]));
  const listed = depths.flatMap((member) => {
    const color = colorOf.get(lists.partners.get(member.path) ?? '');
    return color ? [{ depth: member, color }] : [];
  });
  const taken = new Set(listed.flatMap(({ depth, color }) => [depth, color]));
  const rest = (members: Member[]) => members.filter((member) => !taken.has(member));
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

/** By time, or in the order of the files. */
function inTime(a: Member, b: Member, place: ReadonlyMap<string, number>) {
  if (a.time !== null && b.time !== null) return a.time - b.time;
  return (place.get(a.path) ?? 0) - (place.get(b.path) ?? 0);
}

/**
 * @param bare depth images without a picture
 * @param unused pictures without a depth image
 */
function pairNotes(
  depth: ImageSeries,
  color: ImageSeries,
  bare: Member[],
  unused: Member[],
  way: ReturnType<typeof pairUp>['way'],
): Note[] {
  const [numDepth, numColor] = [depth.members.length, color.members.length];
  const [first, last] = [depth.members[0], color.members[0]].map((member) => baseOf(member?.path ?? ''));
  if (way === 'none' && unused.length === numColor) {
    const reason = `none of the ${numColor} colour pictures belongs to one of the ${numDepth} depth images by its name (${last} and ${first}): the map is made without colours. Give both the same numbers`;
    return [{ file: color.folder || nameOf(color), reason }];
  }
  const notes: Note[] = [];
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
 * @param reason of one
 * @param together of many
 */
function each(members: Member[], series: Series, reason: string, together: (count: number) => string): Note[] {
  if (members.length <= 4) return members.map(({ path }) => ({ file: path, reason }));
  const names = members.slice(0, 3).map(({ path }) => baseOf(path));
  return [{ file: series.folder || nameOf(series), reason: `${together(members.length)} (${names.join(', ')}, ...)` }];
}

/** What is called depth and cannot be used as such. */
function misnamedDepth(images: ImageSeries[], files: readonly ListedFile[]): Note[] {
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
      // Those of a color map are no code of distances; those of simulators may be.
      const isCode = channels !== 'palette' && format === 'PNG' && series.facts.bits === 8;
      const lost = isCode
        ? "; distances can be recovered only where they were coded in the colours, as CARLA's: R + 256 G + 65536 B of 16777215 parts of 1000 m"
        : ', which cannot be recovered from it';
      const reason = `called depth, but holds ${held}, not distances${lost}; ${REMEDY}`;
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

/** Pictures without any depth image. */
function picturesAlone(pictures: ImageSeries[]): Note[] {
  const [first] = pictures;
  if (!first) return [];
  const total = pictures.reduce((sum, { members }) => sum + members.length, 0);
  const what =
    total === 1 ? 'a picture, and no depth image with it' : `${total} pictures, and no depth image with them`;
  return [{ file: nameOf(first), reason: `${what}; a map needs the depth image of each picture, a grey PNG` }];
}

/** The recordings that were not chosen, and images that belong to no frame. */
export function leftAside(chosen: DepthRecording, others: DepthRecording[], pictures: ImageSeries[]): Note[] {
  const [strays, recordings] = partition(others, ({ depth }) => depth.folder === chosen.depth.folder);
  const titleOf = ({ root, depth }: DepthRecording) => {
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

/** A folder that holds nothing of the chosen recording. */
export function isApart(root: string, chosen: string) {
  return root !== chosen && !contains(root, chosen);
}

function partition<T>(values: T[], isFirst: (value: T) => boolean): [T[], T[]] {
  return [values.filter(isFirst), values.filter((value) => !isFirst(value))];
}
