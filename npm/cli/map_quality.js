// @ts-check
/** `scanstitch map-quality`: how crisp maps are, without any truth. */
import { basename } from 'node:path';
import { CommandError, EXIT, isScanstitchError, readArguments, table } from './command.js';
import { readInput } from './inputs.js';

const OPTIONS = /** @type {const} */ ({
  radius: { type: 'string' },
  'max-points': { type: 'string' },
  json: { type: 'boolean', default: false },
});

/** @type {import('./command.js').Command} */
export const mapQuality = {
  name: 'map-quality',
  about: 'mean map entropy and mean plane variance of maps, without any truth',
  help: () => `scanstitch map-quality MAP.ply... [OPTION]...

How crisp maps are: the smaller, the crisper. The figures compare maps of the same scans.
Mean map entropy: Droeschel and Behnke 2014. Mean plane variance: Razlaw et al. 2015; of planar maps, across the lines.

Options:
  --radius METRES    of the neighbourhood of a point (default: 0.3)
  --max-points N     points that are looked at, spread over the map; 0 for all (default: 50000)
  --json             in full precision

Example:
  scanstitch map-quality mine/map.ply theirs/map.ply --radius 0.2
`,
  run,
};

/**
 * @param {import('./command.js').Engine} engine
 * @param {string[]} args
 */
function run(engine, args) {
  const { values, positionals } = readArguments('map-quality', { args, options: OPTIONS, allowPositionals: true });
  if (positionals.length === 0) throw new CommandError('No map was given. See: scanstitch map-quality --help');
  const options = {
    ...(values.radius !== undefined && { radius: number('radius', values.radius) }),
    ...(values['max-points'] !== undefined && { max_points: number('max-points', values['max-points']) }),
  };
  let complaints = 0;
  const complain = (/** @type {string} */ problem) => {
    process.stderr.write(`${problem}\n`);
    complaints += 1;
  };
  const results = positionals.flatMap((path) => {
    const name = basename(path);
    const bytes = readInput({ name, path }, complain);
    if (!bytes) return [];
    try {
      const map = engine.PointCloud.from_ply(bytes, name);
      const quality = engine.map_quality(map, options);
      map.free();
      return [{ name: path, ...quality }];
    } catch (error) {
      if (!isScanstitchError(error)) throw error;
      complain(error.message.startsWith(name) ? error.message : `${name}: ${error.message}`);
      return [];
    }
  });
  if (results.length === 0) throw new CommandError('No map could be used, so nothing was computed.');
  if (values.json) {
    process.stdout.write(`${JSON.stringify(results, null, 2)}\n`);
  } else {
    const heads = ['map', 'mean map entropy (nats)', 'mean plane variance (mm^2)', 'points'];
    const rows = results.map(({ name, mean_map_entropy, mean_plane_variance, num_points }) => [
      name,
      mean_map_entropy.toFixed(4),
      (1e6 * mean_plane_variance).toFixed(2),
      String(num_points),
    ]);
    process.stdout.write(table(heads, rows, new Set([0])));
  }
  return complaints > 0 ? EXIT.partial : EXIT.done;
}

/**
 * @param {string} option
 * @param {string} text
 */
function number(option, text) {
  const value = Number(text);
  if (text.trim() === '' || !(value >= 0)) throw new CommandError(`--${option} is a positive number, not "${text}".`);
  return value;
}
