/**
 * A workbench file: the scans of a map with what lies beside them, the settings, and the steps by which the map was mended. It is a ZIP
 * archive, and opens as what it was made from: all else follows from these to the same bytes.
 */
import { fileError } from '../base/errors.js';
import type { Content } from '../files/content.js';
import { baseOf, folderOf } from '../files/names.js';
import { empty, type Mended, type Recording } from '../files/recording.js';
import { readSteps, stepsText } from './steps_file.js';

const [PARTS, STEPS] = ['workbench.json', 'map.steps.json'];
/** Raised when an older reader could not open what a newer writer keeps. */
const VERSION = 1;
const REMEDY = 'Save the workbench once more, or unpack it and open the scans alone';

/** A file of the recording, by its path. */
export interface BenchFile {
  path: string;
  bytes: Uint8Array;
}

export interface Workbench extends Mended {
  scans: readonly (BenchFile & { isLog: boolean })[];
  reference: BenchFile | null;
  odometry: BenchFile | null;
}

/** The files of the archive by their names. */
export function workbenchFiles({
  scans,
  reference,
  odometry,
  table,
  ...mended
}: Workbench): Record<string, Uint8Array> {
  // What comes from a workbench keeps its name.
  const within = ({ path }: BenchFile) => `recording/${path.replace(/^\/*(recording\/)?/, '')}`;
  const parts = {
    scanstitch_workbench: VERSION,
    scans: scans.map(within),
    logs: scans.filter(({ isLog }) => isLog).map(within),
    table,
    reference: reference && within(reference),
    odometry: odometry && within(odometry),
  };
  const files = [...scans, ...(reference ? [reference] : []), ...(odometry ? [odometry] : [])];
  const text = (content: string) => new TextEncoder().encode(content);
  return {
    [PARTS]: text(`${JSON.stringify(parts, null, 1)}\n`),
    [STEPS]: text(stepsText(mended)),
    ...Object.fromEntries(files.map((file) => [within(file), file.bytes])),
  };
}

/**
 * The files of a workbench among those of an archive, as the recording that they are; null where it is none.
 * @returns rejects with a ScanstitchError where something is wrong with it
 */
export async function openWorkbench(files: readonly Content[]): Promise<Content[] | null> {
  const parts = files.find(({ path }) => baseOf(path) === PARTS);
  const text = parts && new TextDecoder().decode(await parts.read());
  if (!parts || !text?.includes('"scanstitch_workbench"')) return null;
  const folder = folderOf(parts.path);
  const file = (name: unknown) => {
    const found = files.find(({ path }) => path === (folder === '' ? name : `${folder}/${String(name)}`));
    if (!found) throw wrong(`It has no file ${JSON.stringify(name)}, which it names`);
    return found;
  };
  const { scanstitch_workbench: version, scans, logs, table, reference, odometry } = partsOf(text);
  if (version !== VERSION)
    throw wrong(`It is a workbench of version ${JSON.stringify(version)}, and this program reads ${VERSION}`);
  const steps = stepsOf(new TextDecoder().decode(await file(STEPS).read()));
  const recording: Recording = {
    ...empty(),
    kind: 'planar_scans',
    root: folder,
    scans: namesOf(scans).map((name) => file(name).path),
    logs: namesOf(logs).map((name) => file(name).path),
    reference: typeof reference === 'string' ? [file(reference).path] : [],
    odometry: typeof odometry === 'string' ? file(odometry).path : null,
    mended: { ...steps, ...(typeof table === 'string' && { table }) },
  };
  const used = new Set([...recording.scans, ...recording.reference, recording.odometry]);
  return files.filter(({ path }) => used.has(path)).map((content) => ({ ...content, given: recording }));
}

function stepsOf(text: string) {
  try {
    return readSteps(text);
  } catch (error) {
    throw fileError(STEPS, (error as Error).message, REMEDY);
  }
}

function wrong(problem: string) {
  return fileError(PARTS, problem, REMEDY);
}

function partsOf(text: string): Record<string, unknown> {
  try {
    return JSON.parse(text);
  } catch {
    throw wrong('It is no JSON');
  }
}

function namesOf(value: unknown): string[] {
  if (Array.isArray(value) && value.every((name) => typeof name === 'string')) return value;
  throw wrong('It lists no scans');
}
