/** The thread of the localisation: the map, the scans, and where they are. It reads its messages between two scans. */
import { localizationPixels } from '../../../package/report/localization_pixels.js';
import { otherMessages } from '../engine/other-messages.js';
import { init, type Localization, OccupancyGrid, ParticleFilter, Reconstruction } from '../engine/package.js';
import { addScans, attempt } from '../engine/reading.js';
import { emit, nothingLoaded, reportCrash, serve, type Served } from '../engine/serve.js';
import type {
  Files,
  GridPicture,
  Located,
  LocalizeApi,
  LocalizeEvent,
  MapSource,
  ParticleOptions,
  ParticleState,
  ScanDetails,
  ScansRead,
} from './protocol.js';

/** The page is answered at least this often, unless one scan takes longer. */
const SLICE_MS = 15;
/** The page is told at most this often... */
const TOLD_INTERVAL_MS = 60;
/** ...and telling it takes at most this share of the time. */
const TOLD_SHARE = 0.1;

let map: OccupancyGrid | null = null;
let reconstruction: Reconstruction | null = null;
let localization: Localization | null = null;
/** Over the scans that are located, with options as text. */
let particles: { filter: ParticleFilter; options: string } | null = null;
/** The order being worked on; zero: none. */
let currentRun = 0;

const api: Served<LocalizeApi> = {
  async start(module) {
    await init({ module_or_path: module });
  },

  openMap(source): GridPicture {
    const next = readMap(source);
    forgetResult();
    map?.free();
    map = next;
    const [originX = 0, originY = 0] = next.origin;
    const { width, height, resolution, yaw, remark } = next;
    return { width, height, resolution, originX, originY, yaw, remark, grey_values: next.grey_values() };
  },

  openScans({ scans, odometry }, settings): ScansRead {
    const next = new Reconstruction(settings);
    const read: ScansRead = { num_scans: 0, problems: [], notes: [] };
    for (const file of scans) attempt(read.problems, file.name, () => (read.num_scans += addScans(next, file, read)));
    if (odometry) {
      attempt(read.problems, odometry.name, () => next.set_odometry(odometry.name, new Uint8Array(odometry.bytes)));
    }
    if (read.num_scans === 0) {
      next.free();
      return read;
    }
    forgetResult();
    reconstruction?.free();
    reconstruction = next;
    return read;
  },

  locate(run): number {
    if (!map || !reconstruction) throw nothingLoaded();
    forgetResult();
    localization = reconstruction.localization(map);
    currentRun = run;
    otherMessages()
      .then(() => locateAll(run))
      .catch(reportCrash);
    return localization.num_scans();
  },

  stop() {
    currentRun = 0;
  },

  scan: (index) => details(result(), index),
  file: <K extends keyof Files>(kind: K) => file(kind) as Files[K],
  particles: particlesAt,

  likelihoodField() {
    return result().likelihood_field();
  },
};

function readMap(source: MapSource): OccupancyGrid {
  switch (source.kind) {
    case 'yaml': {
      const { yaml, picture } = source;
      return OccupancyGrid.of_yaml(yaml.name, yaml.bytes, picture.name, picture.bytes);
    }
    case 'picture':
      return OccupancyGrid.of_picture(source.picture.name, source.picture.bytes, source.resolution);
    case 'probabilities':
      return OccupancyGrid.of_probabilities(source.table.name, source.table.bytes);
  }
}

async function locateAll(run: number): Promise<void> {
  let nextTold = 0;
  while (localization && currentRun === run) {
    const sliceStart = performance.now();
    let hasMore = true;
    while (hasMore && performance.now() - sliceStart < SLICE_MS) hasMore = localization.step();
    const before = performance.now();
    if (!hasMore || before >= nextTold) {
      tell(localization, run, hasMore);
      nextTold = performance.now() + Math.max(TOLD_INTERVAL_MS, (performance.now() - before) / TOLD_SHARE);
    }
    if (!hasMore) return;
    await otherMessages();
  }
}

function tell(present: Localization, run: number, hasMore: boolean): void {
  const { scans: _, ...outcome } = present.outcome();
  const located: Located = { outcome, track: present.track(), num_scans: present.num_scans() };
  const last = present.num_located() - 1;
  const event: LocalizeEvent = {
    run,
    state: hasMore ? 'running' : 'done',
    located,
    details: last < 0 ? null : details(present, last),
  };
  emit(event, [located.track.buffer as ArrayBuffer]);
}

function details(present: Localization, index: number): ScanDetails {
  return { index, scan: present.scan(index), points: present.scan_points(index) };
}

function file(kind: keyof Files): Files[keyof Files] {
  const present = result();
  if (kind === 'trajectory') return present.trajectory_tum();
  if (kind === 'report') return `${JSON.stringify(present.result(), null, 2)}\n`;
  if (!map) throw nothingLoaded();
  const { width, height, rgb } = localizationPixels(map, present);
  const rgba = new Uint8ClampedArray(4 * width * height).fill(255);
  for (let i = 0, k = 0; i < rgb.length; i += 3, k += 4) rgba.set(rgb.subarray(i, i + 3), k);
  return { width, height, rgba };
}

function particlesAt(chosen: Partial<ParticleOptions>, scan: number): ParticleState {
  const options = JSON.stringify(chosen);
  if (particles?.options !== options) {
    const filter = new ParticleFilter(result(), chosen);
    forgetParticles();
    particles = { filter, options };
  }
  const { filter } = particles;
  const end = performance.now() + SLICE_MS;
  const passed: ParticleState['passed'] = [];
  let isThere = false;
  while (!isThere && performance.now() < end) {
    isThere = !filter.step_towards(scan);
    passed.push([filter.last(), filter.effective_number()]);
  }
  return { scan: filter.last(), options: filter.options(), isThere, values: filter.particles(), passed };
}

function forgetParticles(): void {
  particles?.filter.free();
  particles = null;
}

function result(): Localization {
  if (!localization) throw nothingLoaded();
  return localization;
}

function forgetResult(): void {
  currentRun = 0;
  forgetParticles();
  localization?.free();
  localization = null;
}

serve<LocalizeApi>(api);
